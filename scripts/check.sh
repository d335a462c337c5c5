#!/bin/sh
# The loop of a developer: format, lints of the kernel, the repository's own rules, unit and law tests of the renderer's path.
# `make test` runs everything else: wavelets, the boundary, consumers, instruments.
set -eu
cd "$(dirname "$0")/.."
cargo fmt --all --check
cargo clippy --quiet --package wis --lib -- -D warnings
cargo test --quiet --package wis --test house --test renderer --no-fail-fast
