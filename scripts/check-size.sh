#!/bin/sh
# The code that a renderer links: check-size.sh <folder of the whole library> <output folder>
#
# Prints .text beside its goal. Fails where it is above the goal and above the most that is allowed.
set -eu
cd "$(dirname "$0")/.."
whole=$1
out=$2
mkdir -p "$out"

# name, goal, the most bytes (those on record and 2 %), bytes on record
goals="
renderer-shared 200000 431400 430430
shipped-shared  200000 400900 400718
rays-shared     150000 129100 127086
whole-shared    400000 551800 548988
static-minimal  128000 304700 304327
static-rays     128000 109100 107399
"

text() { size -A "$1" | awk '$1 == ".text" { print $2 }'; }

# library NAME VARIABLES OF make...: what only other parts use belongs to them, so that no warning is left.
library() {
    name=$1
    shift
    make --no-print-directory lib FEATURES= "$@" BUILD="$out/$name" > "$out/$name.log" 2>&1 || { cat "$out/$name.log"; exit 1; }
    if grep '^warning' "$out/$name.log"; then exit 1; fi
}
library renderer
# The same as it is shipped with a renderer: without the calls that are made while it is written.
library shipped CHECKS=
# Rays alone, at the width of every processor.
library rays PRODUCTS= CHECKS= LEVELS=
# program NAME LIBRARY: built, and run
program() {
    cc -std=c99 -O2 -Iinclude -ffunction-sections -Wl,--gc-sections c-examples/minimal.c "$2/libwis.a" -o "$out/$1"
    "$out/$1"
}
seen=$(program minimal "$whole")
echo "$seen"
[ "$seen" = "$(program minimal-rays "$out/rays/lib")" ]

measured() {
    case $1 in
        whole-shared) text "$(readlink -f "$whole/libwis.so")" ;;
        static-minimal) text "$out/minimal" ;;
        static-rays) text "$out/minimal-rays" ;;
        *) text "$(readlink -f "$out/${1%-shared}/lib/libwis.so")" ;;
    esac
}

grown=0
printf '%-16s %8s %8s %8s\n' .text bytes goal recorded
while read -r name goal most recorded; do
    [ -n "$name" ] || continue
    bytes=$(measured "$name")
    verdict=""
    [ "$bytes" -le "$goal" ] || verdict="above its goal"
    if [ "$bytes" -gt "$goal" ] && [ "$bytes" -gt "$most" ]; then
        verdict="has grown"
        grown=$((grown + 1))
    fi
    printf '%-16s %8d %8d %8d %s\n' "$name" "$bytes" "$goal" "$recorded" "$verdict"
done << END
$goals
END
[ "$grown" = 0 ]
