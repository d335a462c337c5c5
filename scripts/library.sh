#!/bin/sh
# Makes the libraries that clients link of those that cargo made: library.sh <cargo's folder> <new folder> <version> <version of the ABI>
# CROSS: the prefix of another platform's binutils.
#
# The archive becomes one object in which nothing but wis_* is global, and wis_* is hidden. A Rust archive brings the compiler's own
# mathematics (fmod, sqrt, round, ...) as weak symbols: a linker that meets them gives them to the client in place of those of its C
# library, or fails on what they need in turn. A plug-in that exported the wis_* of its archive would call those of a host or another
# plug-in that exports them, too.
set -eu
made=$1
lib=$2
version=$3
abi=$4
cross=${CROSS:-}
objcopy=${OBJCOPY:-${cross}objcopy}
mkdir -p "$lib"
rm -f "$lib"/libwis.* "$lib"/wis.dll

# Windows and macOS know no hidden symbols of archives, and rustc leaves none but wis_* global there.
if [ -e "$made/wis.dll" ]; then
    "${cross}strip" --strip-debug -o "$lib/libwis.a" "$made/libwis.a" 2> /dev/null
    "${cross}strip" --strip-all -o "$lib/wis.dll" "$made/wis.dll"
    cp "$made/libwis.dll.a" "$lib"
    exit
elif [ ! -e "$made/libwis.so" ]; then
    cp "$made/libwis.a" "$lib"
    # What it takes of the system's library is bound when it is loaded: its stubs are Apple's.
    ld64.lld-14 -arch "$(echo "$PLATFORM" | sed 's/aarch64/arm64/; s/-.*//')" -platform_version macos 11.0 11.0 -dylib -dead_strip -all_load \
        -undefined dynamic_lookup -install_name "@rpath/libwis.$abi.dylib" -exported_symbol '_wis_*' "$made/libwis.a" -o "$lib/libwis.$abi.dylib"
    ln -sf "libwis.$abi.dylib" "$lib/libwis.dylib"
    exit
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Linkers and readers that load a plugin for link-time optimisation complain about members that they do not know.
functions=$("${cross}nm" --extern-only --defined-only "$made/libwis.a" 2> /dev/null | awk '$2 == "T" && $3 ~ /^wis_/ { print $3 }')
[ -n "$functions" ] || { echo "library: no wis_* in $made/libwis.a" >&2; exit 1; }

# What no function reaches stays out; sections stay apart, so that a client's --gc-sections drops what it does not call.
roots=$(for function in $functions; do printf -- '--undefined=%s ' "$function"; done)
# The list is split into words on purpose.
# shellcheck disable=SC2086
"${LD:-${cross}ld}" --relocatable --gc-sections $roots "$made/libwis.a" -o "$work/all.o"

# Debian's objcopy cannot change a visibility. A linker can: of two symbols with one name it takes the stricter visibility.
# The list is split into words on purpose.
# shellcheck disable=SC2086
printf '.hidden %s\n' $functions | "${AS:-${cross}as}" --noexecstack -o "$work/hidden.o" -
"${LD:-${cross}ld}" --relocatable "$work/all.o" "$work/hidden.o" -o "$work/both.o"
"$objcopy" --wildcard --keep-global-symbol='wis_*' --strip-debug "$work/both.o" "$work/wis.o"
"${AR:-${cross}ar}" rcsD "$lib/libwis.a" "$work/wis.o"

"$objcopy" --strip-all "$made/libwis.so" "$lib/libwis.so.$version"
ln -sf "libwis.so.$version" "$lib/libwis.so.$abi"
ln -sf "libwis.so.$abi" "$lib/libwis.so"
