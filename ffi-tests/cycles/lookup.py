"""Cycles (Blender's Python module) shows the light that wis builds with the matrix of docs/integrating.md.

Pictures of the world alone, a hundredth of a degree wide, in a few directions: radiance over pdf must be one number.
"""

import math
import os
import sys
import tempfile

import bpy
import numpy as np
from mathutils import Vector

import wisdirect as wis

WIDTH, HEIGHT, DIRECTIONS = 64, 32, 8
WORLD_FROM_MAP = [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def world(pixels):
    """A scene of a camera and an environment texture, which interpolates linearly."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 1, False, False
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    image = bpy.data.images.new("map", WIDTH, HEIGHT, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    # Blender's first row is the lowest.
    image.pixels.foreach_set(np.concatenate([pixels[::-1], np.ones((HEIGHT, WIDTH, 1))], axis=2).astype(np.float32).ravel())
    image.update()
    image.pack()
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    nodes = scene.world.node_tree.nodes
    texture = nodes.new("ShaderNodeTexEnvironment")
    texture.image, texture.interpolation = image, "Linear"
    scene.world.node_tree.links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])
    lens = bpy.data.cameras.new("camera")
    lens.angle = math.radians(0.01)
    camera = bpy.data.objects.new("camera", lens)
    camera.rotation_mode = "QUATERNION"
    scene.collection.objects.link(camera)
    scene.camera = camera
    return scene, camera


def seen(scene, camera, direction, folder):
    camera.rotation_quaternion = Vector(direction).to_track_quat("-Z", "Y")
    scene.render.filepath = os.path.join(folder, "seen.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    colours = np.array(image.pixels[:]).reshape(4, 4, 4)[1:3, 1:3, :3].mean(axis=(0, 1))
    bpy.data.images.remove(image)
    return float(colours @ LUMINANCE)


def main():
    random = np.random.default_rng(3)
    pixels = (random.random((HEIGHT, WIDTH, 3)) + 0.05).astype(np.float32)
    environment = wis.Environment(pixels, world_from_map=WORLD_FROM_MAP)
    scene, camera = world(pixels)
    wi = random.normal(size=(DIRECTIONS, 3))
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    with tempfile.TemporaryDirectory() as folder:
        radiance = np.array([seen(scene, camera, d, folder) for d in wi])
    ratio = radiance / wis.Sampler().pdf(environment, wi)
    spread = ratio.std() / ratio.mean()
    print(f"Blender {bpy.app.version_string}: radiance / pdf in {DIRECTIONS} directions has a relative standard deviation of {spread:.5f}")
    return 0 if spread < 0.01 else 1


if __name__ == "__main__":
    sys.exit(main())
