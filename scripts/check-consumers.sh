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

# The README's command lines, as they are printed.
mkdir -p "$out/readme"
cp c-examples/minimal.c "$out/readme/main.c"
cp c-examples/direct.h "$out/readme"
grep -o '`cc main\.c [^`]*`' README.md | tr -d '`' > "$out/readme/lines"
[ "$(wc -l < "$out/readme/lines")" = 2 ]
while read -r line; do
    echo "$line"
    (cd "$out/readme" && rm -f main && env -u PKG_CONFIG_PATH PREFIX="$prefix" sh -c "$line && ./main")
done < "$out/readme/lines"

# From the sources, in the target folder of this repository, so that nothing is compiled twice.
cmake -S c-examples/consumers/fetchcontent -B "$out/fetchcontent" -DFETCHCONTENT_SOURCE_DIR_WIS="$PWD" \
    -DWIS_CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
cmake --build "$out/fetchcontent"
(cd "$out/fetchcontent" && ctest --output-on-failure)

cmake -S c-examples/consumers/cmake -B "$out/cmake" -DCMAKE_PREFIX_PATH="$prefix"
cmake --build "$out/cmake"
cd "$out/cmake"
ctest --output-on-failure
