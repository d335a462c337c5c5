#!/bin/sh
# Builds the C library for a processor without an operating system (ARM Cortex-M4F) and links all of it without anything else:
# check-thumb.sh OUTPUT_FOLDER
set -eu
cd "$(dirname "$0")/.."
mkdir -p "$1"
program=$1/thumb
target=thumbv7em-none-eabihf
compiler=$(scripts/core.sh $target)
eval "$compiler"
folder=${CARGO_TARGET_DIR:-target}/thumb
cargo build --quiet --release --package wis-capi --target $target --target-dir "$folder"
linker=$(rustc --print sysroot)/lib/rustlib/$(rustc -vV | sed -n 's/^host: //p')/bin/rust-lld
functions=$(cat include/wis*.h | grep -v '^ *[/*]' | grep -o '\bwis_[a-z0-9_]*(' | tr -d '(' | sort -u)
wanted=$(printf -- '--undefined=%s ' $functions)
# The list is split into words on purpose.
# shellcheck disable=SC2086
"$linker" -flavor gnu --entry=wis_version --gc-sections --no-undefined $wanted "$folder/$target/release/libwis.a" -o "$program"
# Panic paths are not looked for: this optimiser leaves some that it proves unreachable on x86-64, where check-symbols.sh does.
linked=$(nm "$program" | grep -c ' T wis_')
[ "$linked" = "$(echo "$functions" | wc -l)" ] || { echo "$linked functions are linked" >&2; exit 1; }
echo "$linked functions for $target, $(wc -c < "$program") bytes, nothing undefined"
