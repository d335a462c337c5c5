#!/bin/sh
# Builds the page of the browser, OUTPUT/index.html: web.sh OUTPUT_FOLDER
set -eu
cd "$(dirname "$0")/.."
target=wasm32-unknown-unknown
mkdir -p "$1" "${CARGO_TARGET_DIR:-target}"
build=$(realpath "${CARGO_TARGET_DIR:-target}")
scripts/setup.sh web
# Numbers in lanes and conversions that saturate, which every browser of today has.
compiler=$(scripts/core.sh $target "-C target-feature=+simd128,+nontrapping-fptoint,+bulk-memory")
eval "$compiler"
${CARGO:-cargo} build --quiet --release --package wis-web --target $target
exports=$(sed -n 's/^pub extern "C" fn \([a-z_]*\).*/--export=\1/p' web/src/lib.rs)
# The list is split into words on purpose.
# shellcheck disable=SC2086
wasm-ld --no-entry --gc-sections --strip-all -O2 -z stack-size=1048576 $exports \
    "$build/$target/release/libwis_web.a" -o "$build/wis.wasm"
web/bundle.py "$build/wis.wasm" "$1/index.html"
echo "The page is $1/index.html: $(wc -c < "$1/index.html") bytes. The WebAssembly in it has $(wc -c < "$build/wis.wasm")."
