#!/bin/sh
# The instructions of one call, entry included: check-instructions.sh <folder of the library> <output folder> [--lines]
#
# Calls are wis_environment_init, wis_direct, wis_product_prepare, and wis_sample and wis_pdf of a product, alone and for 64 (of which one counts). Prints
# them beside their goal. Fails where they are above the goal and above the most that is allowed.
# --lines: also the cache lines that a call touches.
set -eu
cd "$(dirname "$0")/.."
library=$1
out=$2
mkdir -p "$out"

# call, directions of it, material, width of the map, goal, the most instructions (those of 2026-11-28 and 2 %), those on record, those of
# version 0.2; of products, those before they were laid in one pass. Of several directions one counts. A mix is Lambert and GGX 0.2, narrow is
# GGX 0.05. A build has no goal but the most.
goals="
build   1  lambert 1024 534100000 534100000 523641220 -
direct  1  lambert 256  2700 2653 2620 11395
direct  1  ggx     256  3600 4422 4371 20487
direct  1  lambert 1024 2700 2656 2623 11076
direct  1  mix     1024 3400 3359 3293 -
direct  1  ggx     1024 3600 4426 4375 19891
prepare 1  lambert 1024 6500 6579 6450 18787
prepare 1  ggx     1024 16000 17996 17643 32227
prepare 1  mix     1024 16000 16530 16206 -
prepare 1  narrow  1024 30000 33230 32578 -
sample  1  lambert 1024 1200 2096 2055 3213
sample  1  ggx     1024 1200 2375 2328 3564
pdf     1  lambert 1024 800 1299 1277 2283
pdf     1  ggx     1024 800 1568 1537 2557
sample  64 lambert 1024 500 555 544 1098
sample  64 ggx     1024 500 607 595 1260
pdf     64 lambert 1024 300 378 371 685
pdf     64 ggx     1024 300 398 390 758
"
# Calls that are counted, and those whose lines are: their mean is printed.
calls=64
traced=16

if ! grep -q avx2 /proc/cpuinfo; then
    echo "skip: the numbers on record are those of AVX2"
    exit 0
fi
cc -std=c99 -O2 -g -no-pie -Iinclude c-examples/goals.c "$library/libwis.a" -o "$out/goals"
rm -f "$out"/*.environment

# run TOOL MATERIAL WIDTH CALLS CALL DIRECTIONS: the program under valgrind, with the environment that the first run of that width kept. Names and variables
# stand on the stack, and copies take 12 instructions more where it begins at an odd multiple of 16: so they are the same everywhere.
run() {
    tool=$1
    shift
    cd "$out"
    [ -e "$2.environment" ] || [ "${entry:-}" = wis_environment_init ] || ./goals "$2" "$1" 1 "$2.environment" direct 1 > /dev/null 2>&1
    # The options are split into words on purpose.
    # shellcheck disable=SC2086
    env -i "$(command -v valgrind)" $tool ./goals "$2" "$1" "$3" "$2.environment" "$4" "$5" 2>&1
}

# instructions CALL DIRECTIONS MATERIAL WIDTH
instructions() {
    case $1 in
        build) entry=wis_environment_init ;;
        prepare) entry=wis_product_prepare ;;
        *) entry=wis_$1 ;;
    esac
    call=$1
    counted=$((calls * $2))
    # What is built is counted where no file is.
    [ "$1" != build ] || { rm -f "$out/$4.environment"; call=direct; counted=1; }
    run "--tool=callgrind --toggle-collect=$entry --callgrind-out-file=callgrind" "$3" "$4" $calls "$call" "$2" |
        awk -v calls=$counted '$2 == "Collected" { printf "%d\n", $4 / calls + 0.5; found = 1 } END { exit !found }'
}

# Cache lines of code and data from the first instruction of wis_direct to the one that follows its call.
lines() {
    entry=$(nm "$out/goals" | awk '$3 == "wis_direct" { sub(/^0+/, "", $1); print $1 }')
    run "--tool=lackey --trace-mem=yes --basic-counts=no" "$1" "$2" $traced direct 1 | awk -v entry="$entry" -v calls=$traced '
        function number(hex,  i, value) {
            for (i = 1; i <= length(hex); i++) value = 16 * value + index("0123456789abcdef", substr(hex, i, 1)) - 1
            return value
        }
        function touch(of,  first, last) {
            last = int((at + size - 1) / 64)
            for (first = int(at / 64); first <= last; first++)
                if (!((call, of, first) in seen)) { seen[call, of, first] = 1; lines[of]++ }
        }
        $1 == "environment" || $1 == "sampler" { low[$1] = number($2); high[$1] = number($3); next }
        $1 !~ /^[ILSM]$/ { next }
        { split($2, part, ","); sub(/^0+/, "", part[1]) }
        $1 == "I" && part[1] == entry { inside = 1; call++ }
        $1 == "I" && inside && part[1] == after { inside = 0 }
        $1 == "I" && !inside { before = part[1]; size = part[2]; next }
        !inside { next }
        $1 == "I" && part[1] == entry { after = sprintf("%x", number(before) + size) }
        {
            at = number(part[1])
            size = part[2]
            of = "stack and others"
            if ($1 == "I") of = "code"
            else for (name in low) if (at >= low[name] && at < high[name]) of = name
            touch(of)
        }
        END {
            for (of in lines) all += lines[of]
            if (call != calls) exit 1
            printf "%d code, %d environment, %d sampler, %d stack and others, %d all\n", lines["code"] / calls, lines["environment"] / calls,
                lines["sampler"] / calls, lines["stack and others"] / calls, all / calls
        }'
}

grown=0
printf '%-8s %10s %-8s %5s %12s %8s %8s %8s\n' call directions material map instructions goal recorded 0.2
while read -r call directions material width goal most recorded before; do
    [ -n "$call" ] || continue
    count=$(instructions "$call" "$directions" "$material" "$width")
    verdict=""
    [ "$count" -le "$goal" ] || verdict="above its goal"
    if [ "$count" -gt "$goal" ] && [ "$count" -gt "$most" ]; then
        verdict="has grown"
        grown=$((grown + 1))
    fi
    printf '%-8s %10d %-8s %5d %12d %8d %8d %8s %s\n' "$call" "$directions" "$material" "$width" "$count" "$goal" "$recorded" "$before" "$verdict"
    [ "${3:-}" != --lines ] || [ "$call" != direct ] || echo "         cache lines: $(lines "$material" "$width")"
done << END
$goals
END
[ "$grown" = 0 ]
