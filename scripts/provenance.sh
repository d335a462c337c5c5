#!/bin/sh
# Prints the last lines of a measured page, which tell what it was made from: provenance.sh NAME, as in page-hash.sh
# The commit counts as changed where files other than pages and README.md, which quotes them, differ from it.
set -eu
cd "$(dirname "$0")/.."
commit=$(git rev-parse --short HEAD 2> /dev/null || echo unknown)
[ -z "$(git status --porcelain --untracked-files=no -- ':!docs' ':!README.md' 2> /dev/null)" ] || commit="$commit, with changes"
printf 'Commit %s.\n\n<!-- made from %s by %s -->\n' "$commit" "$(scripts/page-hash.sh "$1")" "$1"
