#!/bin/sh
# Checks what the libraries export and contain: check-symbols.sh <folder with libwis.a and libwis.so>
set -eu
cd "$(dirname "$0")/.."
lib=$1

fail() {
    echo "$1:" >&2
    echo "$2" >&2
    exit 1
}

# Before 1.0 a minor version may break the interface, so it is part of the SONAME.
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
case $version in
    0.*) abi=${version%.*} ;;
    *) abi=${version%%.*} ;;
esac
soname=$(readelf --dynamic "$lib/libwis.so" | sed -n 's/.*SONAME.*\[\(.*\)\]/\1/p')
[ "$soname" = "libwis.so.$abi" ] || fail "the SONAME of version $version is" "$soname"
[ "$(readlink -f "$lib/$soname")" = "$(readlink -f "$lib/libwis.so.$version")" ] || fail "no such file" "$lib/$soname"

# What the shared library exports is what the header declares, no more and no less.
exported=$(nm --dynamic --defined-only "$lib/libwis.so" | awk '{ print $NF }' | LC_ALL=C sort)
declared=$(grep -v '^ *[/*]' include/wis.h | grep -o '\bwis_[a-z0-9_]*(' | tr -d '(' | LC_ALL=C sort)
[ "$exported" = "$declared" ] || fail "exported symbols and declared functions differ" "exported:
$exported
declared:
$declared"

# The kernel is one object after link-time optimisation; a panic path that survived would leave its symbols there.
symbols=$(nm --print-file-name "$lib/libwis.a" 2> /dev/null)
kernel=$(echo "$symbols" | grep ' T wis_' | cut -d: -f2 | sort -u)
[ "$(echo "$kernel" | wc -l)" = 1 ] || fail "the kernel is more than one object" "$kernel"
panics=$(echo "$symbols" | grep -F ":$kernel:" | grep -i panic || true)
[ -z "$panics" ] || fail "a panic path survives in the kernel" "$panics"

echo "$(echo "$declared" | wc -l) functions, kernel object $kernel"
