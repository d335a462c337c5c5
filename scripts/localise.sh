#!/bin/sh
# Makes one object of an archive in which nothing but wis_* is global, and wis_* is hidden: localise.sh <archive> <new archive>
#
# A Rust archive brings the compiler's own mathematics (fmod, sqrt, round, ...) as weak symbols. A linker that meets them
# gives them to the client in place of those of its C library, or fails on what they need in turn.
#
# A plug-in that exported the wis_* of its archive would call those of a host or another plug-in that exports them, too.
set -eu
archive=$1
result=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Linkers and readers that load a plugin for link-time optimisation complain about members that they do not know.
functions=$(nm --extern-only --defined-only "$archive" 2> /dev/null | awk '$2 == "T" && $3 ~ /^wis_/ { print $3 }')
[ -n "$functions" ] || { echo "localise: no wis_* in $archive" >&2; exit 1; }

# What no function reaches stays out; sections stay apart, so that a client's --gc-sections drops what it does not call.
roots=$(for function in $functions; do printf -- '--undefined=%s ' "$function"; done)
# The list is split into words on purpose.
# shellcheck disable=SC2086
${LD:-ld} --relocatable --gc-sections $roots "$archive" -o "$work/all.o"

# Debian's objcopy cannot change a visibility. A linker can: of two symbols with one name it takes the stricter visibility.
# The list is split into words on purpose.
# shellcheck disable=SC2086
printf '.hidden %s\n' $functions | ${AS:-as} --noexecstack -o "$work/hidden.o" -
${LD:-ld} --relocatable "$work/all.o" "$work/hidden.o" -o "$work/both.o"
${OBJCOPY:-objcopy} --wildcard --keep-global-symbol='wis_*' --strip-debug "$work/both.o" "$work/wis.o"
rm -f "$result"
${AR:-ar} rcsD "$result" "$work/wis.o"
