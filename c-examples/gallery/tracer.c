/* Rays against a mesh, by Embree. */
#include "tracer.h"

#include <string.h>

bool tracer_init(Tracer *tracer, const Mesh *mesh) {
    size_t vertices = mesh->vertex_count * sizeof *mesh->positions;
    size_t triangles = mesh->triangle_count * sizeof *mesh->triangles;
    RTCGeometry geometry;
    void *to_vertices, *to_triangles;
    tracer->scene = NULL;
    tracer->device = rtcNewDevice(NULL);
    if (tracer->device == NULL) {
        return false;
    }
    tracer->scene = rtcNewScene(tracer->device);
    geometry = rtcNewGeometry(tracer->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    to_vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                          sizeof *mesh->positions, mesh->vertex_count);
    to_triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                           sizeof *mesh->triangles, mesh->triangle_count);
    if (to_vertices != NULL && to_triangles != NULL) {
        memcpy(to_vertices, mesh->positions, vertices);
        memcpy(to_triangles, mesh->triangles, triangles);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(tracer->scene, geometry);
        rtcCommitScene(tracer->scene);
    }
    rtcReleaseGeometry(geometry);
    return rtcGetDeviceError(tracer->device) == RTC_ERROR_NONE;
}

void tracer_free(Tracer *tracer) {
    if (tracer->scene != NULL) {
        rtcReleaseScene(tracer->scene);
    }
    if (tracer->device != NULL) {
        rtcReleaseDevice(tracer->device);
    }
    memset(tracer, 0, sizeof *tracer);
}

static struct RTCRay make_ray(Vec3 origin, Vec3 direction) {
    struct RTCRay ray = {0};
    ray.org_x = origin.x;
    ray.org_y = origin.y;
    ray.org_z = origin.z;
    ray.dir_x = direction.x;
    ray.dir_y = direction.y;
    ray.dir_z = direction.z;
    ray.tfar = INFINITY;
    ray.mask = ~0u;
    return ray;
}

bool tracer_hit(const Tracer *tracer, Vec3 origin, Vec3 direction, Hit *hit) {
    struct RTCIntersectContext context;
    struct RTCRayHit query;
    memset(&query, 0, sizeof query);
    query.ray = make_ray(origin, direction);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcInitIntersectContext(&context);
    rtcIntersect1(tracer->scene, &context, &query);
    hit->triangle = query.hit.primID;
    hit->u = query.hit.u;
    hit->v = query.hit.v;
    return query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
}

bool tracer_occluded(const Tracer *tracer, Vec3 origin, Vec3 direction) {
    struct RTCIntersectContext context;
    struct RTCRay ray = make_ray(origin, direction);
    rtcInitIntersectContext(&context);
    rtcOccluded1(tracer->scene, &context, &ray);
    return ray.tfar < 0.0f; /* -inf: something is in the way */
}
