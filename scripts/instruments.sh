#!/bin/sh
# Runs cargo on ffi-tests against an installed library: instruments.sh LIBRARY_FOLDER run|test|clippy [ARGUMENTS...]
# The peers are compiled for this very machine, so that none is held back; the library is the one that ships.
set -eu
cd "$(dirname "$0")/.."
WIS_LIB_DIR=$(cd "$1" && pwd)
subcommand=$2
shift 2
export WIS_LIB_DIR RUSTFLAGS="-C target-cpu=native"
exec cargo "$subcommand" --quiet --profile instruments --package wis-ffi-tests \
    --target-dir "${CARGO_TARGET_DIR:-target}/native" "$@"
