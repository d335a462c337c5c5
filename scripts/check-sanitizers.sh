#!/bin/sh
# Runs the C side under the address and undefined-behaviour sanitizers: check-sanitizers.sh LIBRARY_FOLDER OUTPUT_FOLDER
#
# They see what C code does with the library's memory and headers; the Rust side is watched by guard pages and valgrind.
set -eu
cd "$(dirname "$0")/.."
library=$(cd "$1" && pwd)/libwis.a
mkdir -p "$2"
out=$(cd "$2" && pwd)
export ASAN_OPTIONS=detect_leaks=1 UBSAN_OPTIONS=print_stacktrace=1
# clang's where its run-time library is there, else gcc's.
c=cc cpp=c++
echo 'int main(void) { return 0; }' > "$out/probe.c"
if clang -fsanitize=address,undefined "$out/probe.c" -o "$out/probe" 2> /dev/null; then c=clang cpp=clang++; fi
sanitizers="-g -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer"
flags="-O1 $sanitizers -D_POSIX_C_SOURCE=200809L -Iinclude"
programs=0

# compile NAME STANDARD SOURCES AND LIBRARIES...
compile() {
    name=$1 standard=$2
    shift 2
    compiler=$c
    case $* in *.cpp*) compiler=$cpp ;; esac
    # The flags are split into words on purpose.
    # shellcheck disable=SC2086
    $compiler -std="$standard" $flags "$@" -o "$out/$name-san"
}

# execute NAME ARGUMENTS...: in the folder of outputs.
execute() {
    name=$1
    shift
    (cd "$out" && "./$name-san" "$@") > "$out/$name-san.txt" 2>&1 || { cat "$out/$name-san.txt" >&2; exit 1; }
    programs=$((programs + 1))
}

# run NAME SOURCE STANDARD [LIBRARIES...]
run() {
    name=$1 source=$2 standard=$3
    shift 3
    compile "$name" "$standard" "$source" "$library" "$@"
    execute "$name"
}

run minimal c-examples/minimal.c c99
run minimal-cpp c-examples/minimal.cpp c++11
run first c-examples/first.c c99 -lm
run wavelets c-examples/wavelets.c c99 -lm
run wavelets-cpp c-examples/wavelets.cpp c++11
run pathtracer-small c-examples/pathtracer/small.c c99 -lm
run pathtracer-small-cpp c-examples/pathtracer/small.cpp c++11
run consumer c-examples/consumers/check.c c99
run consumer-cpp c-examples/consumers/check.cpp c++11

parts=c-examples/render
# The lists are split into words on purpose.
# shellcheck disable=SC2046
compile exr.o c++11 -fno-sanitize=vptr $(pkg-config --cflags OpenEXR) -c "$parts/exr.cpp"
exr="$out/exr.o-san $(pkg-config --libs OpenEXR) -lstdc++"
# shellcheck disable=SC2086
compile pathtracer c99 c-examples/pathtracer/main.c "$parts/environment.c" "$parts/hdr.c" "$parts/image.c" "$parts/light.c" "$parts/material.c" \
    "$parts/options.c" "$parts/parallel.c" "$parts/read.c" "$parts/sky.c" "$parts/stb.c" "$library" $exr -lm -lpthread
execute pathtracer --width 8 --height 4 --most 4 --repeats 1 --reference 4
# shellcheck disable=SC2086
compile demo c99 c-examples/demo/main.c c-examples/demo/scene.c "$parts"/*.c "$library" $exr -lm -lpthread
execute demo --size 32x16 --spp 4 --reference-spp 16 --threads 2 --out demo.png

CC=$c scripts/check-hosts.sh "$1" "$out/hosts" "$sanitizers"
echo "$programs programs and the hosts, compiled by $($c --version | head -n 1): nothing found"
