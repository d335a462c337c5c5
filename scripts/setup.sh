#!/bin/sh
# Installs the Debian packages that a target needs and that are missing:
# setup.sh KIND, of which there is a list below
set -eu

# Each line: the package, and a command or a pattern of files that shows it is there.
demo_needs="
binutils    objcopy
fonts-dejavu-core /usr/share/fonts/truetype/dejavu/DejaVuSans.ttf
g++         g++
gcc         gcc
libc6-dev   /usr/include/stdlib.h
libopenexr-dev /usr/include/OpenEXR/ImfInputFile.h
libstb-dev  /usr/include/stb/stb_image_write.h
pkg-config  pkg-config
"
gallery_needs="$demo_needs
libassimp-dev /usr/include/assimp/cimport.h
libembree-dev /usr/include/embree3/rtcore.h
"
test_needs="$gallery_needs
clang         clang
cmake         cmake
libclang-dev  /usr/lib/llvm-*/lib/libclang.so
libclang-rt-dev /usr/lib/llvm-*/lib/clang/*/lib/linux/libclang_rt.asan-x86_64.a
patch         patch
python3       python3
python3-venv  /usr/lib/python3*/ensurepip/__init__.py
valgrind      valgrind
"

browser_needs="
chromium      chromium
"
renderers_needs="
libllvm19     /usr/lib/x86_64-linux-gnu/libLLVM.so.19*
python3-venv  /usr/lib/python3*/ensurepip/__init__.py
"
core_needs="
rust-web-src  /usr/src/rustc-*/library/core/src/lib.rs
rustc-web     /usr/bin/rustc
"
web_needs="
lld           wasm-ld
python3       python3
"
dist_needs="
cmake                       cmake
g++-aarch64-linux-gnu       aarch64-linux-gnu-g++
g++-mingw-w64-x86-64-win32  x86_64-w64-mingw32-g++
libc6-dev-arm64-cross       /usr/aarch64-linux-gnu/lib/libc.a
lld                         ld64.lld-14
llvm-14                     llvm-nm-14
pkg-config                  pkg-config
qemu-user                   qemu-aarch64
wine64                      /usr/lib/wine/wine64
"
docs_needs="
doxygen       doxygen
"
coverage_needs="
llvm-19       llvm-cov-19
"
guided_needs="
g++           g++
"
bits_needs="
gcc-aarch64-linux-gnu aarch64-linux-gnu-gcc
gcc-i686-linux-gnu    i686-linux-gnu-gcc
libc6-dev-arm64-cross /usr/aarch64-linux-gnu/lib/libc.a
libc6-dev-i386-cross  /usr/i686-linux-gnu/lib/libc.a
qemu-user             qemu-aarch64
"

kinds=$(sed -n 's/^\([a-z]*\)_needs=.*/\1/p' "$0" | sort -u | tr '\n' ' ')
case " $kinds " in
    *" ${1:-none} "*) eval "needs=\$${1}_needs" ;;
    *) echo "usage: $0 one of $kinds" >&2; exit 2 ;;
esac

# Prints the packages whose command or file is absent.
missing() {
    echo "$needs" | while read -r package witness; do
        case "$witness" in
            '') ;;
            # The pattern is expanded on purpose.
            # shellcheck disable=SC2086
            /*) ls $witness > /dev/null 2>&1 || printf '%s ' "$package" ;;
            *) command -v "$witness" > /dev/null || printf '%s ' "$package" ;;
        esac
    done
}

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi
}

# The lists of a fresh machine may be absent or old, so a failed attempt is repeated after an update.
install_packages() {
    export DEBIAN_FRONTEND=noninteractive
    as_root apt-get install -y -q --no-install-recommends "$@" ||
        { as_root apt-get update -q && as_root apt-get install -y -q --no-install-recommends "$@"; }
}

if ! command -v cargo > /dev/null; then
    echo "setup: cargo is missing: install Rust 1.85 or newer, see https://rustup.rs" >&2
    exit 1
fi

packages=$(missing)
[ -n "$packages" ] || exit 0

echo "setup: installing $packages"
if ! command -v apt-get > /dev/null || { [ "$(id -u)" != 0 ] && ! command -v sudo > /dev/null; }; then
    echo "setup: please install these packages by hand (no apt-get, or neither root nor sudo): $packages" >&2
    exit 1
fi
# The list is split into words on purpose.
# shellcheck disable=SC2086
install_packages $packages
