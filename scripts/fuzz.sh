#!/bin/sh
# Fuzzes an installed library: fuzz.sh LIBRARY_FOLDER MINUTES [SEED]
#
# First what is on record: inputs that the guided fuzzer kept.
# Without a seed two processes side by side, with seeds of their own; with one that seed alone, for a failure of any length.
set -eu
cd "$(dirname "$0")/.."
library=$(cd "$1" && pwd)/libwis.so
minutes=$2
built=${CARGO_TARGET_DIR:-target}/instruments
fuzz=$built/wis-fuzz
cargo build --quiet --profile instruments --package wis-fuzz --bin wis-fuzz

rm -rf "$built/corpus"
mkdir "$built/corpus"
tar -xzf fuzz/corpus.tar.gz -C "$built/corpus"
"$fuzz" "$library" --corpus "$built/corpus"

run() { "$fuzz" "$library" --minutes "$minutes" --seed "$1"; }

if [ $# -gt 2 ]; then
    run "$3"
else
    # The day is the seed, so that each finds something else and a failure is found again.
    first=$(($(date +%s) / 86400 * 2))
    run $((first + 1)) &
    run "$first"
    wait $!
fi
