#!/bin/sh
# Builds and runs hosts that are hard on a plug-in: check-hosts.sh <library folder> <output folder> [flags of the compiler CC]
set -eu
library=$(cd "$1" && pwd)
mkdir -p "$2"
out=$(cd "$2" && pwd)
cd "$(dirname "$0")/../c-examples/hosts"
archive=$library/libwis.a
cc=${CC:-cc}
flags="-std=gnu99 -O1 -Wall -Wextra -Werror -I../../include ${3:-}"

# build NAME LIBRARIES...
build() {
    name=$1
    shift
    # The flags are split into words on purpose.
    # shellcheck disable=SC2086
    $cc $flags "$name.c" "$@" "$archive" -lm -lpthread -ldl -o "$out/$name"
}

cp -L "$library/libwis.so" "$out/first.so"
cp -L "$library/libwis.so" "$out/second.so"
build copies
"$out/copies" "$out/first.so" "$out/second.so"
build threads
"$out/threads" "$out/first.so"
build memory
"$out/memory"
build control
"$out/control"
build fibers
"$out/fibers"
build soak
"$out/soak"

# The flags are split into words on purpose.
# shellcheck disable=SC2086
for name in plugin again; do $cc $flags -shared -fPIC plugin.c "$archive" -o "$out/$name.so"; done
# shellcheck disable=SC2086
$cc $flags -rdynamic own.c -ldl -o "$out/own"
"$out/own" "$out/plugin.so" "$out/again.so" "$out/first.so"

rustc --edition 2024 --crate-type staticlib -o "$out/libother.a" other.rs
for order in first last; do
    if [ "$order" = first ]; then build beside "$out/libother.a"; else build beside "$archive" "$out/libother.a"; fi
    "$out/beside"
done
