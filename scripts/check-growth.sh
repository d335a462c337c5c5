#!/bin/sh
# Holds the work of every function to what the headers state: check-growth.sh LIBRARY_FOLDER OUTPUT_FOLDER
set -eu
cd "$(dirname "$0")/.."
library=$(cd "$1" && pwd)/libwis.so
cargo build --quiet --profile instruments --package wis-fuzz --bin wis-growth
"${CARGO_TARGET_DIR:-target}/instruments/wis-growth" "$library" "$2"
