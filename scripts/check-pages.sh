#!/bin/sh
# Says which measured pages were made from other sources than those that are there: check-pages.sh
# A page ends with a line <!-- made from HASH by NAME -->, which the instrument of that name wrote.
set -eu
cd "$(dirname "$0")/.."
stale=0
for page in docs/*.md docs/measurements/*.md; do
    [ -e "$page" ] || continue
    line=$(sed -n 's/^<!-- made from \([0-9a-f]*\) by \([a-z-]*\) -->$/\1 \2/p' "$page")
    [ -n "$line" ] || continue
    made=${line% *}
    name=${line#* }
    now=$(scripts/page-hash.sh "$name")
    if [ "$made" = "$now" ]; then
        echo "ok    $page"
    else
        echo "stale $page: made from $made, the sources are $now: make $name"
        stale=1
    fi
done
scripts/performance-page.py --check || stale=1
exit $stale
