"""Builds the C library with cargo, and its cffi module from include/wis.h.

Not maturin: it generates declarations from the crate that it builds, and capi/ holds none of its own; given wis.h instead, cffi
stops at its first directive. Here the header is reduced to what cffi reads. The module finds the library at run time, so one
wheel serves all versions of Python and no C compiler is needed.
"""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import cffi
from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = Path(__file__).resolve().parent
# A source distribution has what it takes of the repository.
ROOT = HERE / "rust" if (HERE / "rust").exists() else HERE.parent
SOURCES = ("src", "capi", "include", "packaging/licences", "docs/crate.md", "Cargo.lock", "LICENSE-MIT", "LICENSE-APACHE")
VERSION = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.M)[1]
# What the library asks of glibc, 2.14 of memcpy, is in 2.17, the oldest that wheels have a name for.
LINUX = "manylinux_2_17_"


def declarations():
    """wis.h without comments, guards and directives but numbers."""
    text = (ROOT / "include" / "wis.h").read_text()
    text = re.sub(r"[ \t]*(/\*.*?\*/|//[^\n]*)", "", text, flags=re.S)
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.S)
    text = re.sub(r"\((\d+) << (\d+)\)", lambda shift: str(int(shift[1]) << int(shift[2])), text)
    return re.sub(r"^#(?!define \w+ \d+$).*$", "", text, flags=re.M)


def module(text):
    """The cffi module wisdirect._wis, and the names of the arguments of each function, which errors tell."""
    ffi = cffi.FFI()
    ffi.set_source("wisdirect._wis", None)
    ffi.cdef(text)
    functions = re.findall(r"\b(wis_\w+)\(([^)]*)\);", text)
    arguments = {name: [re.search(r"(\w+)(\[\d*\])?$", of.strip())[1] for of in given.split(",")] for name, given in functions}
    return ffi, arguments


def library():
    """Path of the shared library that cargo builds: the renderer's part, wis.h."""
    command = ["cargo", "rustc", "--release", "--package", "wis-capi", "--lib", "--crate-type", "cdylib", "--no-default-features",
               "--features", "avx2,products,checks", "--message-format", "json-render-diagnostics", "--", "-C", "strip=symbols"]
    flags = (os.environ.get("RUSTFLAGS", "") + " " + (ROOT / "capi" / "flags").read_text()).split()
    answer = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True, env={**os.environ, "RUSTFLAGS": " ".join(flags)}).stdout
    made = [json.loads(line) for line in answer.splitlines()]
    files = [file for of in made if of["reason"] == "compiler-artifact" and of["target"]["name"] == "wis" for file in of["filenames"]]
    return next(Path(file) for file in files if Path(file).suffix in (".so", ".dylib", ".dll"))


class Build(build_py):
    def run(self):
        super().run()
        folder = Path(self.build_lib) / "wisdirect"
        ffi, arguments = module(declarations())
        ffi.emit_python_code(str(folder / "_wis.py"))
        built = library()
        with open(folder / "_wis.py", "a") as file:
            file.write(f"LIBRARY = {built.name!r}\nARGUMENTS = {arguments!r}\n")
        shutil.copy(built, folder)
        for text in ("LICENSE-MIT", "LICENSE-APACHE"):
            shutil.copy(ROOT / text, folder)
        shutil.copytree(ROOT / "packaging" / "licences", folder / "licences", dirs_exist_ok=True)


class Wheel(bdist_wheel):
    def get_tag(self):
        platform = super().get_tag()[2]
        return "py3", "none", platform.replace("linux_", LINUX) if platform.startswith("linux_") else platform


class Sources(sdist):
    def make_release_tree(self, base_dir, files):
        super().make_release_tree(base_dir, files)
        rust = Path(base_dir) / "rust"
        for name in SOURCES:
            given, to = ROOT / name, rust / name
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copytree(given, to) if given.is_dir() else shutil.copy(given, to)
        # Without tests, benchmarks and the other members, which are not there, and their profiles.
        text = re.sub(r"^members = .*$", 'members = ["capi"]', (ROOT / "Cargo.toml").read_text(), flags=re.M)
        (rust / "Cargo.toml").write_text(re.sub(r"^\[(\[|profile\.(?!release)).*?(?=^\[|\Z)", "", text, flags=re.M | re.S))


class Platform(Distribution):
    def has_ext_modules(self):
        return True


setup(version=VERSION, distclass=Platform, cmdclass={"build_py": Build, "bdist_wheel": Wheel, "sdist": Sources},
      options={"build": {"build_base": str(ROOT / "build" / "python")}})
