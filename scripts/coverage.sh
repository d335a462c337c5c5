#!/bin/sh
# Counts the lines of the kernel that its tests run: coverage.sh OUTPUT_FOLDER [SECONDS]
# Half an hour of a core. Groups of tests one after the other, in one thread: threads that count the same lines wait for each other.
# A group that takes more than SECONDS (200) of processor time is ended and does not count, and is named. llvm-19 reads what
# rustc 1.95 writes.
set -eu
cd "$(dirname "$0")/.."
mkdir -p "$1"
out=$(cd "$1" && pwd)
seconds=${2:-200}
export RUSTFLAGS="-C instrument-coverage" CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-target}/coverage" LLVM_PROFILE_FILE="$out/build.profraw"
rm -f "$out"/*.profraw
cargo test --quiet --package wis --no-run --message-format=json > "$out/build.json"
objects=$(sed -n 's/.*"executable":"\([^"]*deps[^"]*\)".*/\1/p' "$out/build.json" | sort -u)
[ -n "$objects" ]
arguments=""
for object in $objects; do
    name=$(basename "$object")
    # house reads sources; it runs none of the kernel.
    case $name in house-*) continue ;; esac
    arguments="$arguments -object $object"
    groups=$("$object" --list | sed -n 's/: test$//p' | awk -F:: '{ print (NF > 2 ? $1 "::" $2 "::" : $1 "::") }' | sort -u)
    for group in $groups; do
        (
            ulimit -t "$seconds"
            LLVM_PROFILE_FILE="$out/$name-%p.profraw" exec "$object" --quiet --test-threads=1 "$group" > /dev/null 2>&1
        ) || echo "$name $group does not count: it failed, or took longer than $seconds s"
    done
done
ls "$out"/*-*.profraw > /dev/null
llvm-profdata-19 merge -sparse "$out"/*-*.profraw -o "$out/all.profdata"
# The list of objects is split into words on purpose.
# shellcheck disable=SC2086
llvm-cov-19 report $arguments -instr-profile="$out/all.profdata" --ignore-filename-regex='(registry|rustc|/tests/|library)' |
    awk '{ print $1, $8, $9, $10 }' | column -t > "$out/lines.txt"
cat "$out/lines.txt"
