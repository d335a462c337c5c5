#!/bin/sh
# Prints the compiler for a platform and its flags, as assignments: eval "$(core.sh TARGET [FLAGS])" sets RUSTC and RUSTFLAGS.
# The kernel needs the core library alone. That of the toolchain serves, if it is installed; else Debian's source of it is compiled,
# in half a minute of one processor.
set -eu
cd "$(dirname "$0")/.."
target=$1
flags=${2:-}
if [ -d "$(rustc --print target-libdir --target "$target")" ]; then
    echo "export RUSTC=rustc RUSTFLAGS='$flags'"
    exit
fi
scripts/setup.sh core >&2
rustc=/usr/bin/rustc
version=$($rustc --version | cut -d ' ' -f 2)
sources=/usr/src/rustc-$version/library
[ -d "$sources" ] || { echo "core: rust-web-src is not of version $version, as rustc-web is" >&2; exit 1; }
mkdir -p "${CARGO_TARGET_DIR:-target}"
sysroot=$(realpath "${CARGO_TARGET_DIR:-target}")/core-$version
libraries=$sysroot/lib/rustlib/$target/lib

# library NAME FOLDER OPTIONS...: these sources may use what is not stable, as in cargo's build-std.
library() {
    name=$1
    folder=$2
    shift 2
    # The flags are split into words on purpose.
    # shellcheck disable=SC2086
    RUSTC_BOOTSTRAP=1 $rustc --crate-name "$name" --crate-type rlib --edition 2024 --target "$target" --sysroot "$sysroot" \
        -O -C panic=abort -C codegen-units=1 -C embed-bitcode=yes $flags -Z force-unstable-if-unmarked --cap-lints allow \
        --out-dir "$libraries" "$@" "$sources/$folder/src/lib.rs" >&2
}
if [ ! -e "$libraries/done" ]; then
    echo "core: compiling the core library of Rust $version for $target" >&2
    mkdir -p "$libraries"
    library core core
    # With memcpy and its like where no system has them.
    case $target in wasm* | *-none-*) mem="--cfg feature=\"mem\"" ;; *) mem="" ;; esac
    # shellcheck disable=SC2086
    library compiler_builtins compiler-builtins/compiler-builtins --cfg 'feature="compiler-builtins"' $mem
    library alloc alloc
    touch "$libraries/done"
fi
echo "export RUSTC=$rustc RUSTFLAGS='$flags --sysroot $sysroot'"
