#!/bin/sh
# Builds the page of the browser, OUTPUT/index.html: web.sh OUTPUT_FOLDER
# The core library for WebAssembly is that of the toolchain, or it is compiled from Debian's source of the same version, in half a minute.
set -eu
cd "$(dirname "$0")/.."
target=wasm32-unknown-unknown
mkdir -p "$1"
mkdir -p "${CARGO_TARGET_DIR:-target}"
build=$(realpath "${CARGO_TARGET_DIR:-target}")
# Numbers in lanes and conversions that saturate, which every browser of today has.
flags="-C target-feature=+simd128,+nontrapping-fptoint,+bulk-memory"

if [ -d "$(rustc --print target-libdir --target $target)" ]; then
    rustc=rustc
else
    scripts/setup.sh web
    rustc=/usr/bin/rustc
    version=$($rustc --version | cut -d ' ' -f 2)
    sources=/usr/src/rustc-$version/library
    [ -d "$sources" ] || { echo "web: rust-web-src is not of version $version, as rustc-web is" >&2; exit 1; }
    sysroot=$build/web-$version
    libraries=$sysroot/lib/rustlib/$target/lib
    if [ ! -e "$libraries/done" ]; then
        mkdir -p "$libraries"
        # library NAME FOLDER OPTIONS...
        library() {
            name=$1
            folder=$2
            shift 2
            # As cargo's build-std has it: these sources may use what is not stable.
            # The flags are split into words on purpose.
            # shellcheck disable=SC2086
            RUSTC_BOOTSTRAP=1 $rustc --crate-name "$name" --crate-type rlib --edition 2024 --target $target --sysroot "$sysroot" \
                -O -C panic=abort -C codegen-units=1 -C embed-bitcode=yes $flags -Z force-unstable-if-unmarked --cap-lints allow \
                --out-dir "$libraries" "$@" "$sources/$folder/src/lib.rs"
        }
        echo "web: compiling the core library of Rust $version for $target"
        library core core
        library compiler_builtins compiler-builtins/compiler-builtins --cfg 'feature="compiler-builtins"' --cfg 'feature="mem"'
        library alloc alloc
        touch "$libraries/done"
    fi
    flags="$flags --sysroot $sysroot"
fi

RUSTC=$rustc RUSTFLAGS=$flags ${CARGO:-cargo} build --quiet --release --package wis-web --target $target
exports=$(sed -n 's/^pub extern "C" fn \([a-z_]*\).*/--export=\1/p' web/src/lib.rs)
# The list is split into words on purpose.
# shellcheck disable=SC2086
wasm-ld --no-entry --gc-sections --strip-all -O2 -z stack-size=1048576 $exports \
    "$build/$target/release/libwis_web.a" -o "$build/wis.wasm"
web/bundle.py "$build/wis.wasm" "$1/index.html"
echo "The page is $1/index.html: $(wc -c < "$1/index.html") bytes. The WebAssembly in it has $(wc -c < "$build/wis.wasm")."
