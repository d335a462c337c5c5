#!/bin/sh
# Links a client that calls the C library's mathematics with the archive: check-mathematics.sh <installed tree> <output folder>
set -eu
cd "$(dirname "$0")/../c-examples/consumers"
archive=$1/lib/libwis.a
include=$1/include
out=$2
mkdir -p "$out"
# Without -fno-builtin a compiler would compute some of them itself.
flags="-Wall -Wextra -Wpedantic -Werror -fno-builtin -O1"

fail() {
    echo "mathematics: $1" >&2
    exit 1
}

# build PROGRAM COMPILER ARGUMENTS...: links and runs it.
build() {
    program=$out/$1
    shift
    echo "$*"
    # The flags are split into words on purpose.
    # shellcheck disable=SC2086
    "$@" $flags -I"$include" -o "$program"
    "$program"
}

# Names of the C library that a program has code of its own for.
own() {
    nm --defined-only "$1" | awk '{ print $NF }' |
        grep -xE '(fmod|fma|cbrt|sqrt|round|trunc|ceil)f?|fminf?|fmaxf?|rust_eh_personality' || true
}

for language in "cc -std=c99 -x c" "c++ -std=c++11 -x c++"; do
    # The words are a compiler and its options.
    # shellcheck disable=SC2086
    set -- $language mathematics.c -x none
    build after "$@" "$archive" -lm
    build before "$@" -lm "$archive"
    build collected "$@" -Wl,--gc-sections "$archive" -lm
    build static "$@" -static "$archive" -lm
    for program in after before collected; do
        [ -z "$(own "$out/$program")" ] || fail "$program: the archive gave $(own "$out/$program")"
    done
    # The client calls one function: the sections of the others must not stay.
    nm "$out/collected" | grep -q ' wis_product_prepare' && fail "--gc-sections keeps what nobody calls"
done

# g++ names the library itself; a C program without it gets nothing from the archive in its place.
build absent c++ -std=c++11 -x c++ mathematics.c -x none "$archive"
[ -z "$(own "$out/absent")" ] || fail "absent: the archive gave $(own "$out/absent")"
# shellcheck disable=SC2086
if cc -std=c99 $flags -I"$include" mathematics.c "$archive" -o "$out/without" 2> "$out/without.txt"; then
    [ -z "$(own "$out/without")" ] || fail "without -lm: the archive gave $(own "$out/without")"
else
    grep -q fmod "$out/without.txt" || fail "without -lm: $(cat "$out/without.txt")"
    ! grep -q rust "$out/without.txt" || fail "without -lm: $(cat "$out/without.txt")"
fi
