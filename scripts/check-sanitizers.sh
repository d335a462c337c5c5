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
# clang's where its run-time library is there (Debian: libclang-rt-14-dev), else gcc's.
c=cc cpp=c++
echo 'int main(void) { return 0; }' > "$out/probe.c"
if clang -fsanitize=address,undefined "$out/probe.c" -o "$out/probe" 2> /dev/null; then c=clang cpp=clang++; fi
flags="-O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer -Iinclude"

# run NAME SOURCE STANDARD [LIBRARIES...]
run() {
    name=$1 source=$2 standard=$3
    shift 3
    compiler=$c
    case $source in *.cpp) compiler=$cpp ;; esac
    # The flags are split into words on purpose.
    # shellcheck disable=SC2086
    $compiler -std="$standard" $flags "$source" "$library" "$@" -o "$out/$name-san"
    "$out/$name-san" > "$out/$name-san.txt" 2>&1 || { cat "$out/$name-san.txt" >&2; exit 1; }
}

run minimal c-examples/minimal.c c99
run minimal-cpp c-examples/minimal.cpp c++11
run wavelets c-examples/wavelets.c c99
run wavelets-cpp c-examples/wavelets.cpp c++11
run measured c-examples/measured.c c99 -lm
run pathtracer-small c-examples/pathtracer/small.c c99 -lm
run pathtracer-small-cpp c-examples/pathtracer/small.cpp c++11
run memory c-examples/hosts/memory.c gnu99 -lm
run control c-examples/hosts/control.c gnu99 -lm
run soak c-examples/hosts/soak.c gnu99 -lpthread -lm
run consumer c-examples/consumers/check.c c99
run consumer-cpp c-examples/consumers/check.cpp c++11
echo "12 programs, compiled by $c: nothing found"
