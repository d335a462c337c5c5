#!/bin/sh
# What a Rust renderer gets: documentation without warnings, a small package, examples without `unsafe`.
set -eu
cd "$(dirname "$0")/.."
limit=1000000

# Neither part nor level may be needed by what is always there.
cargo check --quiet --no-default-features --package wis

RUSTDOCFLAGS="-D warnings" cargo doc --quiet --no-deps --all-features --package wis

cargo package --quiet --list --allow-dirty --package wis > "${TMPDIR:-/tmp}/wis-package.$$"
size=$(grep -vxE '\.cargo_vcs_info\.json|Cargo\.toml\.orig' "${TMPDIR:-/tmp}/wis-package.$$" | tar -cz -T - | wc -c)
rm "${TMPDIR:-/tmp}/wis-package.$$"
echo "the package takes $size bytes compressed, at most $limit"
[ "$size" -le "$limit" ]

if grep -l unsafe examples/*.rs; then
    echo "an example has unsafe code" >&2
    exit 1
fi
