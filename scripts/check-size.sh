#!/bin/sh
# The code that a renderer links: check-size.sh <folder of the whole library> <output folder>
#
# Prints .text beside its goal. Fails where it is above the goal and above the most that is allowed.
set -eu
cd "$(dirname "$0")/.."
whole=$1
out=$2
mkdir -p "$out"

# name, goal, the most bytes (sizes of 2026-11-28 and 5 %), bytes on record
goals="
renderer-shared 200000 458000 436062
shipped-shared  200000 422000 401694
rays-shared     150000 141000 134174
whole-shared    400000 626000 596438
static-minimal  128000 332000 317416
static-rays     128000 119000 113448
"

text() { size -A "$1" | awk '$1 == ".text" { print $2 }'; }

make --no-print-directory lib FEATURES= BUILD="$out/renderer" > "$out/renderer.log" 2>&1 || { cat "$out/renderer.log"; exit 1; }
# What only other parts use belongs to them.
if grep '^warning' "$out/renderer.log"; then exit 1; fi
# The same as it is shipped with a renderer: without the calls that are made while it is written.
make --no-print-directory lib FEATURES= CHECKS= BUILD="$out/shipped" > "$out/shipped.log" 2>&1 || { cat "$out/shipped.log"; exit 1; }
if grep '^warning' "$out/shipped.log"; then exit 1; fi
# Rays alone, at the width of every processor.
make --no-print-directory lib FEATURES= PRODUCTS= CHECKS= LEVELS= BUILD="$out/rays" > "$out/rays.log" 2>&1 || { cat "$out/rays.log"; exit 1; }
if grep '^warning' "$out/rays.log"; then exit 1; fi
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
        renderer-shared) text "$(readlink -f "$out/renderer/lib/libwis.so")" ;;
        shipped-shared) text "$(readlink -f "$out/shipped/lib/libwis.so")" ;;
        rays-shared) text "$(readlink -f "$out/rays/lib/libwis.so")" ;;
        whole-shared) text "$(readlink -f "$whole/libwis.so")" ;;
        static-minimal) text "$out/minimal" ;;
        static-rays) text "$out/minimal-rays" ;;
    esac
}

grown=0
printf '%-16s %8s %8s %8s\n' .text bytes goal recorded
for name in renderer-shared shipped-shared rays-shared whole-shared static-minimal static-rays; do
    read -r goal most recorded << END
$(echo "$goals" | awk -v name="$name" '$1 == name { print $2, $3, $4 }')
END
    bytes=$(measured "$name")
    verdict=""
    [ "$bytes" -le "$goal" ] || verdict="above its goal"
    if [ "$bytes" -gt "$goal" ] && [ "$bytes" -gt "$most" ]; then
        verdict="has grown"
        grown=$((grown + 1))
    fi
    printf '%-16s %8d %8d %8d %s\n' "$name" "$bytes" "$goal" "$recorded" "$verdict"
done
[ "$grown" = 0 ]
