#!/bin/sh
# Runs every example that reads a map over sound and broken files: check-maps.sh BUILD OUTPUT_FOLDER
#
# Each ends in time: with what the file holds and no NaN, or with status 1 and a sentence on what was found and what is wanted.
set -eu
cd "$(dirname "$0")/.."
build=$1
mkdir -p "$2"
out=$(cd "$2" && pwd)
maps=$out/maps
seconds=20
list=$out/list
failed=$out/failed
: > "$failed"
rm -rf "$maps"
python3 scripts/make-maps.py "$maps" > "$list"

# The reader alone, under sanitizers, which see what hostile files do to memory.
parts=c-examples/render
flags="-O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all"
# Flags are split into words on purpose.
# shellcheck disable=SC2046,SC2086
c++ -std=c++11 $flags $(pkg-config --cflags OpenEXR) -c "$parts/exr.cpp" -o "$out/exr.o"
# shellcheck disable=SC2046,SC2086
cc -std=c99 $flags c-examples/maps/read.c "$parts/hdr.c" "$parts/light.c" "$parts/read.c" "$out/exr.o" \
    $(pkg-config --libs OpenEXR) -lstdc++ -lm -o "$out/read"

# run NAME KIND PATTERN COMMAND...: a pattern is looked for in what the command prints.
run() {
    name=$1 kind=$2 pattern=$3
    shift 3
    status=0
    timeout "$seconds" "$@" > "$out/printed" 2>&1 || status=$?
    expected=0
    [ "$kind" = good ] || expected=1
    if [ $status != $expected ] || ! grep -qE -- "$pattern" "$out/printed" || grep -qwE -- '-?nan|-?inf' "$out/printed"; then
        { echo "$name: status $status where $expected is right, or not '$pattern', or NaN: $*" && head -c 2000 "$out/printed"; } >> "$failed"
    fi
}

tab=$(printf '\t')
while IFS=$tab read -r name kind pattern; do
    map=$maps/$name
    run "$name" "$kind" "$pattern" "$out/read" "$map"
    [ "$kind" = bad ] || pattern='|'
    run "$name" "$kind" "$pattern" "$build/demo" --map "$map" --size 16x16 --spp 4 --reference-spp 16 --threads 1 --out "$out/demo.png"
    run "$name" "$kind" "$pattern" "$build/pathtracer" --map "$map" --width 4 --height 2 --most 1 --repeats 1 --reference 1
    case $kind.$name in
        bad.* | good.black.hdr | good.tiny.hdr | good.float.exr)
            run "$name" "$kind" "$pattern" "$build/gallery-program" --map "$map" --only spot --size 256x240 --seconds 0.02 \
                --reference 0.04 --out "$out/gallery" ;;
    esac
done < "$list"
cat "$failed"
echo "$(wc -l < "$list") maps, of which $(grep -c "^[^ ]*${tab}good" "$list") sound"
[ ! -s "$failed" ]
