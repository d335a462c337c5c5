#!/bin/sh
# Builds and runs the consumers against an installed tree: check-consumers.sh <installed tree> <output folder>
set -eu
cd "$(dirname "$0")/.."
prefix=$1
out=$2
rm -rf "$out"
mkdir -p "$out/cc" "$out/pkgconfig"

make --no-print-directory -C c-examples/consumers/cc PREFIX="$prefix" OUT="$out/cc"
"$out/cc/check"

export PKG_CONFIG_PATH="$prefix/lib/pkgconfig"
make --no-print-directory -C c-examples/consumers/pkgconfig OUT="$out/pkgconfig"
LD_LIBRARY_PATH="$prefix/lib" "$out/pkgconfig/check"

# The command lines of README.md and docs/linking.md, as they are printed.
mkdir -p "$out/printed"
cp c-examples/minimal.c "$out/printed/main.c"
cp c-examples/direct.h "$out/printed"
grep -h -o '`cc main\.c [^`]*`' README.md docs/linking.md | tr -d '`' | sort -u > "$out/printed/lines"
[ "$(wc -l < "$out/printed/lines")" = 3 ]
while read -r line; do
    echo "$line"
    (cd "$out/printed" && rm -f main && env -u PKG_CONFIG_PATH PREFIX="$prefix" sh -c "$line && ./main")
done < "$out/printed/lines"

# From the sources, in the target folder of this repository, so that nothing is compiled twice.
cmake -S c-examples/consumers/fetchcontent -B "$out/fetchcontent" -DFETCHCONTENT_SOURCE_DIR_WIS="$PWD" \
    -DWIS_CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
cmake --build "$out/fetchcontent"
(cd "$out/fetchcontent" && ctest --output-on-failure)

cmake -S c-examples/consumers/cmake -B "$out/cmake" -DCMAKE_PREFIX_PATH="$prefix"
cmake --build "$out/cmake"
cd "$out/cmake"
ctest --output-on-failure
