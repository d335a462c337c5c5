#!/bin/sh
# Checks that an installed tree carries the licences of all that is linked into the libraries: check-licences.sh <installed tree>
set -eu
cd "$(dirname "$0")/.."
installed=$1/share/licenses/wis

for text in LICENSE-MIT LICENSE-APACHE; do
    cmp "$text" "$installed/$text"
done

# Each line: a crate that the libraries are made of. Macros run in the compiler only.
crates=$(cargo tree --package wis-capi --edges normal,no-proc-macro --prefix none --format '{p}' --no-dedupe --offline |
    awk '!/\(/ { print $1 "-" substr($2, 2) }' | sort -u)
[ -n "$crates" ] || { echo "licences: no crates" >&2; exit 1; }
registry=${CARGO_HOME:-$HOME/.cargo}/registry/src
for crate in $crates; do
    source=$(ls -d "$registry"/*/"$crate" | head -n 1)
    name=${crate%-*}
    texts=$(cd "$source" && ls | grep -E '^(LICEN[CS]E|COPYING|NOTICE|ATTRIBUTION)')
    [ -n "$texts" ] || { echo "licences: $crate has none" >&2; exit 1; }
    for text in $texts; do
        cmp "$source/$text" "$installed/$name/$text"
    done
    echo "$crate: $texts" | tr '\n' ' '
    echo
done
