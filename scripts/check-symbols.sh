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

# Neither library carries what only a debugger reads, and the shared one no names but those that it exports.
sections() { readelf --section-headers --wide "$1" 2> /dev/null | grep -oE '\.(debug|zdebug|symtab|llvm)[a-z_]*' || true; }
[ -z "$(sections "$lib/libwis.so")" ] || fail "the shared library is not stripped" "$(sections "$lib/libwis.so")"
[ "$(sections "$lib/libwis.a")" = .symtab ] || fail "the archive has more than its symbols" "$(sections "$lib/libwis.a")"

# What the shared library exports is what the headers declare, no more and no less.
exported=$(nm --dynamic --defined-only "$lib/libwis.so" | awk '{ print $NF }' | LC_ALL=C sort)
declared=$(cat include/wis.h include/wis_*.h | grep -v '^ *[/*]' | grep -o '\bwis_[a-z0-9_]*(' | tr -d '(' | LC_ALL=C sort)
[ "$exported" = "$declared" ] || fail "exported symbols and declared functions differ" "exported:
$exported
declared:
$declared"

# So is what the archive defines for others, weak symbols included: a client's fmod is that of its C library.
[ "$(ar t "$lib/libwis.a" | wc -l)" = 1 ] || fail "the archive is more than one object" "$(ar t "$lib/libwis.a")"
global=$(nm --extern-only --defined-only "$lib/libwis.a" | awk 'NF == 3 { print $2, $3 }' | LC_ALL=C sort)
[ "$global" = "$(echo "$declared" | sed 's/^/T /')" ] || fail "the archive's global symbols" "$global"

# Hidden, or a plug-in that links the archive would export them, and call those of its host.
exported=$(readelf --symbols --wide "$lib/libwis.a" 2> /dev/null | awk '$5 == "GLOBAL" && $6 != "HIDDEN" && $7 != "UND" { print $8 }')
[ -z "$exported" ] || fail "what links the archive exports" "$exported"

# What it wants from outside.
wanted=$(nm --undefined-only "$lib/libwis.a" | awk '$1 == "U" { print $2 }' | grep -vxE 'mem(cpy|move|set|cmp)' || true)
[ -z "$wanted" ] || fail "the archive wants" "$wanted"

# No static that can be written: sections of data are empty, but for those that are read only once addresses stand in them.
writable=$(readelf --section-headers --wide "$lib/libwis.a" 2> /dev/null | sed -E 's/^ *\[ *[0-9]+\] *//' |
    awk '$1 ~ /^\.(data|bss|tdata|tbss)/ && $1 !~ /^\.data\.rel\.ro/ && $5 !~ /^0+$/ { print $1, $5 }')
[ -z "$writable" ] || fail "the archive has statics that can be written" "$writable"

# A panic path that survived would leave its symbols.
panics=$(nm "$lib/libwis.a" | grep -i panic || true)
[ -z "$panics" ] || fail "a panic path survives in the kernel" "$panics"

echo "$(echo "$declared" | wc -l) functions, $soname"
