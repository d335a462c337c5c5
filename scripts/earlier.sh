#!/bin/sh
# Builds the library of version 0.2 from the history into build/0.2, once: the report and the goals measure it beside the current one, and
# the products of 0.1 that it still had.
# Where the history is not there, as in a shallow clone, they leave it out.
set -eu
cd "$(dirname "$0")/.."
commit=af7e63d
out=$PWD/build/0.2

[ ! -e "$out/lib/libwis.so" ] || exit 0
if ! git cat-file -e "$commit^{commit}" 2> /dev/null; then
    echo "earlier: no commit $commit here: version 0.2 is left out" >&2
    exit 0
fi
rm -rf "$out"
mkdir -p "$out/source"
git archive "$commit" | tar -x -C "$out/source"
env -u CARGO_TARGET_DIR -u RUSTFLAGS make --no-print-directory -C "$out/source" lib BUILD="$out" > "$out/log" 2>&1 || { cat "$out/log" >&2; exit 1; }
rm -rf "$out/source"
