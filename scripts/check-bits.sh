#!/bin/sh
# Compares the digests of the renderer's calls between levels of optimisation and platforms with those on record:
# check-bits.sh OUTPUT_FOLDER [--all]. After a change of bits on purpose, fuzz/digests/record.txt becomes what wis-digests prints.
# 32-bit x86 and AArch64 take a compiler with their standard library, rustup's or Debian's, and what `setup.sh bits` installs.
# A platform without them is left out, and the last line says so. With --all rustup adds them, and one that is left out is a failure.
set -eu
cd "$(dirname "$0")/.."
mkdir -p "$1"
out=$(cd "$1" && pwd)
all=${2:-}
record=fuzz/digests/record.txt
ran="" left=""
target=${CARGO_TARGET_DIR:-target}/bits

# build NAME ARGUMENTS...: the program, in a folder of its own where the compiler is another one.
build() {
    name=$1
    shift
    cargo build --quiet --package wis-fuzz --bin wis-digests --ignore-rust-version --target-dir "$target/$name" "$@"
}

# compiler TARGET: prints one that has it.
compiler() {
    for candidate in rustc /usr/bin/rustc; do
        if command -v $candidate > /dev/null &&
            [ -d "$($candidate --print target-libdir --target "$1" 2> /dev/null || echo /nowhere)" ]; then
            echo $candidate
            return
        fi
    done
}

# compare NAME COMMAND...: with the record.
compare() {
    name=$1
    shift
    "$@" > "$out/$name.txt"
    if ! cmp -s "$record" "$out/$name.txt"; then
        echo "check-bits: $name has other bits" >&2
        diff "$record" "$out/$name.txt" | head -n 10 >&2
        exit 1
    fi
    echo "$name: $(wc -l < "$out/$name.txt") digests"
    ran="$ran $name"
}

# other TARGET LINKER [RUNNER]: another platform.
other() {
    RUSTC=$(compiler "$1")
    if [ -z "$RUSTC" ] && [ "$all" = --all ] && command -v rustup > /dev/null; then
        rustup target add "$1" && RUSTC=$(compiler "$1")
    fi
    if [ -z "$RUSTC" ] || ! command -v "$2" > /dev/null || { [ $# -gt 2 ] && ! command -v "$3" > /dev/null; }; then
        echo "$1: left out, no compiler, linker or emulator"
        left="$left $1"
        return
    fi
    export RUSTC
    variable=CARGO_TARGET_$(echo "$1" | tr 'a-z-' 'A-Z_')_LINKER
    export "$variable=$2"
    # Without a dynamic linker of the platform.
    RUSTFLAGS="-C target-feature=+crt-static" build "$1" --release --target "$1"
    # No runner: the processor itself runs it.
    # shellcheck disable=SC2086
    compare "$1" ${3:-} "$target/$1/$1/release/wis-digests"
    unset RUSTC
}

build native --release
compare release "$target/native/release/wis-digests"
build native
compare debug "$target/native/debug/wis-digests"
for level in 1 2; do
    CARGO_PROFILE_DEV_OPT_LEVEL=$level build "level-$level"
    compare "level-$level" "$target/level-$level/debug/wis-digests"
done
other i686-unknown-linux-gnu i686-linux-gnu-gcc
other aarch64-unknown-linux-gnu aarch64-linux-gnu-gcc qemu-aarch64
echo "the same digests:$ran; left out:${left:- none}"
[ "$all" != --all ] || [ -z "$left" ]
