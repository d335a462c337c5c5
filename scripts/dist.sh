#!/bin/sh
# Packs what a client needs, or checks that a client can be built from it: dist.sh <build folder> [--check]
set -eu
cd "$(dirname "$0")/.."
build=$(cd "$1" && pwd)
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
name=wis-$version-$(uname -m)-$(uname -s | tr '[:upper:]' '[:lower:]')
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT

make --no-print-directory install BUILD="$build" DESTDIR="$stage" PREFIX="/$name" > /dev/null
doc=$stage/$name/share/doc/wis
mkdir -p "$doc/docs/gallery" "$doc/docs/measurements" "$doc/c-examples"
cp README.md CHANGELOG.md "$doc"
cp docs/*.md docs/*.png docs/*.svg "$doc/docs"
cp docs/gallery/*.png "$doc/docs/gallery"
cp docs/measurements/*.md "$doc/docs/measurements"
cp c-examples/minimal.c c-examples/direct.h c-examples/minimal.cpp "$doc/c-examples"
# The same bytes for the same sources: no owner, no time, names in order.
tar --create --sort=name --owner=0 --group=0 --numeric-owner --mtime=@0 --directory "$stage" "$name" | gzip -n > "$build/$name.tar.gz"
echo "$build/$name.tar.gz: $(du -h "$build/$name.tar.gz" | cut -f 1)"
[ "${2:-}" = --check ] || exit 0

# What was packed, in another place and without cargo on the path.
mkdir "$stage/unpacked"
tar --extract --gzip --file "$build/$name.tar.gz" --directory "$stage/unpacked"
cd "$stage/unpacked/$name"
env -i PATH=/usr/bin:/bin cc share/doc/wis/c-examples/minimal.c -Iinclude lib/libwis.a -o minimal
./minimal
env -i PATH=/usr/bin:/bin PKG_CONFIG_PATH=lib/pkgconfig sh -c 'cc share/doc/wis/c-examples/minimal.c $(pkg-config --cflags --libs wis) -o shared'
LD_LIBRARY_PATH=lib ./shared
for file in share/licenses/wis/LICENSE-MIT share/doc/wis/docs/integrating.md include/wis.hpp; do
    [ -s "$file" ] || { echo "dist: $file is missing" >&2; exit 1; }
done
