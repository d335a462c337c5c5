#!/bin/sh
# Builds and runs the program without a C library: check-freestanding.sh <installed tree> <output folder>
set -eu
cd "$(dirname "$0")/.."
prefix=$1
out=$2
program=$out/freestanding

mkdir -p "$out"
rm -f "$program"
make --no-print-directory -C c-examples/freestanding PREFIX="$prefix" OUT="$out"
if nm "$program" | grep -i panic; then
    echo "the program holds a panic path" >&2
    exit 1
fi
if nm --undefined-only "$program" | grep .; then
    echo "the program has undefined symbols" >&2
    exit 1
fi
"$program"
