#!/bin/sh
# Packs what a client without Rust needs, and builds clients of what was packed: dist.sh <build folder> [native | TARGET]
# Other platforms are compiled with the core library alone (core.sh), linked by Debian's tools, and run by qemu-user and wine. No Mac is
# at hand, and no emulator of one: there, the functions of the shared library are compared with those of the headers.
set -eu
cd "$(dirname "$0")/.."
build=$(cd "$1" && pwd)
platform=${2:-native}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
# The prefix of compilers and binutils, and what runs the platform's programs.
CROSS="" run=""
case $platform in
    native) system=$(uname -m)-$(uname -s | tr '[:upper:]' '[:lower:]') ;;
    *-linux-gnu) system=${platform%%-*}-linux CROSS=${platform%%-*}-linux-gnu- run=qemu-${platform%%-*} ;;
    *-windows-gnu) system=${platform%%-*}-windows CROSS=${platform%%-*}-w64-mingw32- run=/usr/lib/wine/wine64 ;;
    *-apple-darwin) system=${platform%%-*}-macos ;;
    *) echo "dist: no tools for $platform" >&2; exit 2 ;;
esac
name=wis-$version-$system

if [ "$platform" = native ]; then
    lib=$build/lib
else
    scripts/setup.sh dist
    export CROSS PLATFORM="$platform"
    lib=$build/dist/$platform/lib
    # What cargo calls the linker of a platform.
    export "CARGO_TARGET_$(echo "$platform" | tr 'a-z-' 'A-Z_')_LINKER=${CROSS}gcc"
    kinds=$(case $platform in *-apple-*) echo staticlib ;; *) echo staticlib,cdylib ;; esac)
    (
        compiler=$(scripts/core.sh "$platform")
        eval "$compiler"
        RUSTFLAGS="$RUSTFLAGS $(tr '\n' ' ' < capi/flags)"
        cargo rustc --quiet --release --package wis-capi --lib --crate-type "$kinds" --target "$platform"
    )
    scripts/library.sh "${CARGO_TARGET_DIR:-target}/$platform/release" "$lib" "$version" "$(make --no-print-directory print-abi)"
fi
tree=$stage/$name
make --no-print-directory install-files LIB="$lib" DESTDIR="$stage" PREFIX="/$name" > /dev/null
doc=$tree/share/doc/wis
mkdir -p "$doc/docs/gallery" "$doc/docs/measurements" "$doc/c-examples"
cp README.md CHANGELOG.md "$doc"
cp docs/*.md docs/*.png docs/*.svg "$doc/docs"
cp docs/gallery/*.png "$doc/docs/gallery"
cp docs/measurements/*.md "$doc/docs/measurements"
cp c-examples/minimal.c c-examples/direct.h c-examples/minimal.cpp "$doc/c-examples"
if [ -e "$tree/lib/wis.dll" ]; then
    mkdir "$tree/bin"
    mv "$tree/lib/wis.dll" "$tree/bin"
fi
# The same bytes for the same sources: no owner, no time, names in order.
tar --create --sort=name --owner=0 --group=0 --numeric-owner --mtime=@0 --directory "$stage" "$name" | gzip -n > "$build/$name.tar.gz"
echo "$build/$name.tar.gz: $(du -h "$build/$name.tar.gz" | cut -f 1)"

# What was packed, in another place and without cargo on the path.
mkdir "$stage/unpacked"
tar --extract --gzip --file "$build/$name.tar.gz" --directory "$stage/unpacked"
sources=$PWD
cd "$stage/unpacked/$name"
for file in share/licenses/wis/LICENSE-MIT share/doc/wis/docs/integrating.md include/wis.hpp lib/libwis.a; do
    [ -s "$file" ] || { echo "dist: $file is missing" >&2; exit 1; }
done
if [ "$system" = "${platform%%-*}-macos" ]; then
    llvm-nm-14 --extern-only --defined-only --format=just-symbols lib/libwis.dylib | sed 's/^_//' | sort > exported
    cat include/wis*.h | grep -v '^ *[/*]' | grep -o '\bwis_[a-z0-9_]*(' | tr -d '(' | sort -u > declared
    diff declared exported
    echo "$(wc -l < exported) functions; never run"
    exit
fi
export WINEDEBUG=-all WINEPREFIX="$stage/wine" WINEPATH="$PWD/bin" QEMU_LD_PREFIX="/usr/${CROSS%-}" LD_LIBRARY_PATH="$PWD/lib"
examples=share/doc/wis/c-examples
without_rust="env PATH=/usr/bin:/bin PKG_CONFIG_PATH=lib/pkgconfig"
# Static and shared, C and C++; the words of commands are split on purpose.
# shellcheck disable=SC2046,SC2086
{
    $without_rust "${CROSS:-}gcc" $examples/minimal.c -Iinclude lib/libwis.a -o c-static
    $without_rust "${CROSS:-}g++" -std=c++11 $examples/minimal.cpp -Iinclude lib/libwis.a -static -o cpp-static
    $without_rust "${CROSS:-}gcc" $examples/minimal.c $($without_rust pkg-config --cflags --libs wis) -o c-shared
    $without_rust "${CROSS:-}gcc" $examples/minimal.c $($without_rust pkg-config --cflags --static --libs wis) -static -o c-whole
    for program in c-static cpp-static c-shared c-whole; do
        $run ./$(ls $program $program.exe 2> /dev/null)
    done
}
# Twenty rays have the bits of this machine's library.
cc "$sources/python/tests/twenty.c" -Iinclude "$build/lib/libwis.a" -o native
./native > native.txt
"${CROSS}gcc" "$sources/python/tests/twenty.c" -Iinclude lib/libwis.a -o twenty.exe
$run ./twenty.exe | tr -d '\r' | cmp - native.txt
# Both targets of the CMake package.
set --
if [ -n "$CROSS" ]; then
    set -- -DCMAKE_SYSTEM_NAME="$(case $platform in *windows*) echo Windows ;; *) echo Linux ;; esac)" -DCMAKE_C_COMPILER="${CROSS}gcc" \
        -DCMAKE_CXX_COMPILER="${CROSS}g++" -DCMAKE_CROSSCOMPILING_EMULATOR="$run" -DCMAKE_EXE_LINKER_FLAGS="-static-libgcc -static-libstdc++"
fi
cmake -S "$sources/c-examples/consumers/cmake" -B cmake -DCMAKE_PREFIX_PATH="$PWD" "$@" > /dev/null
cmake --build cmake > /dev/null
cd cmake
ctest --output-on-failure
