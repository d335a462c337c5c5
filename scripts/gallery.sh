#!/bin/sh
# Renders the gallery into BUILD/gallery: gallery.sh BUILD DATA PAGE MAP
# DATA: a folder with envmaps/ and meshes/, which may be absent. PAGE: not empty to write docs/gallery.md and its pictures, too.
# MAP: not empty for one light in all pictures.
set -eu
build=$1
data=$2
page=$3
[ -d "$data" ] || echo "gallery: no folder '$data': with a sky and a knot that are made here"
if [ -z "$page" ]; then
    "$build/gallery-program" --out "$build/gallery" --data "$data" ${4:+--map "$4"}
else
    # Longer references than a look at the gallery needs: the page shows them.
    "$build/gallery-program" --out "$build/gallery" --data "$data" --reference 40 --page "$build/gallery/parts"
    # Each part goes where page.md has its name in braces.
    awk 'NR == FNR && /^=== / { name = substr($0, 5); next }
        NR == FNR { part[name] = part[name] between[name] $0; between[name] = "\n"; next }
        { while (match($0, /[{][a-z ]*[}]/)) $0 = substr($0, 1, RSTART - 1) part[substr($0, RSTART + 1, RLENGTH - 2)] substr($0, RSTART + RLENGTH); print }' \
        "$build/gallery/parts" c-examples/gallery/page.md > docs/gallery.md
    { echo && scripts/provenance.sh gallery; } >> docs/gallery.md
    mkdir -p docs/gallery
    # The pictures that the page shows.
    sed -n 's|.*(gallery/\([a-z]*\)\.png)$|\1|p' docs/gallery.md | while read -r name; do
        cp "$build/gallery/$name-crop.png" "docs/gallery/$name.png"
    done
fi
[ -z "$page" ] || scripts/performance-page.py
echo "The pictures are in $build/gallery"
