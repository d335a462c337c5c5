#!/bin/bash
# From a clone to a first picture of one's own, step by step, with the time of each: first-picture.sh [repository] [folder]
# Dependencies are fetched anew where CARGO_HOME is an empty folder.
set -eu
repository=${1:-$(cd "$(dirname "$0")/.." && pwd)}
folder=${2:-$(mktemp -d)}
mkdir -p "$folder"
cd "$folder"
unset CARGO_TARGET_DIR
echo "| step | wall time | processor time |"
echo "| --- | --- | --- |"

# step NAME COMMAND...
step() {
    name=$1
    shift
    TIMEFORMAT='%R %U %S'
    taken=$({ time "$@" > step.log 2>&1; } 2>&1) || { cat step.log >&2; exit 1; }
    echo "$taken" | awk -v name="$name" '{ printf "| %s | %.1f s | %.1f s |\n", name, $1, $2 + $3 }'
}

step '`git clone`' git clone --quiet "$repository" wis
step '`cargo fetch`: the crates that wis needs' cargo fetch --quiet --locked --manifest-path wis/capi/Cargo.toml
step '`make lib`' make -C wis lib
cp wis/c-examples/first.c main.c
step '`cc -O2 main.c -Iwis/include wis/build/lib/libwis.a -lm`' cc -O2 main.c -Iwis/include wis/build/lib/libwis.a -lm -o main
step '`./main`: the picture' ./main
[ -s first.pgm ]
