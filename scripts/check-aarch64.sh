#!/bin/sh
# Runs the tests of numbers and of recorded bits on AArch64, in an emulator: check-aarch64.sh [--check]
# Installs the Debian packages that this takes, which are another architecture's. --check: only answers whether they are there.
set -eu
cd "$(dirname "$0")/.."
target=aarch64-unknown-linux-gnu

# A compiler with the target's standard library: rustup's if it is there, else Debian's.
has_target() { [ -d "$("$1" --print target-libdir --target $target 2> /dev/null || echo /nowhere)" ]; }

compiler() {
    for candidate in rustc /usr/bin/rustc; do
        if command -v $candidate > /dev/null && has_target $candidate; then
            echo $candidate
            return
        fi
    done
}

is_ready() {
    [ -n "$(compiler)" ] && command -v aarch64-linux-gnu-gcc > /dev/null && command -v qemu-aarch64 > /dev/null &&
        [ -e /usr/aarch64-linux-gnu/lib/crt1.o ] && [ -e /lib/ld-linux-aarch64.so.1 ]
}

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi
}

# Packages of another architecture stand beside those of this one. Debian 12 has the newer compiler under another name.
install() {
    command -v dpkg > /dev/null || return 1
    export DEBIAN_FRONTEND=noninteractive
    as_root dpkg --add-architecture arm64 && as_root apt-get update -q || return 1
    common="gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user libc6:arm64 libgcc-s1:arm64"
    for rust in "rustc-web libstd-rust-web-dev:arm64" "rustc libstd-rust-dev:arm64"; do
        # The lists are split into words on purpose.
        # shellcheck disable=SC2086
        as_root apt-get install -y -q --no-install-recommends $common $rust && is_ready && return 0
    done
    return 1
}

if [ "${1:-}" = --check ]; then
    is_ready
    exit
fi
if ! is_ready; then
    install || { echo "check-aarch64: no compiler, linker or emulator for AArch64 here" >&2; exit 1; }
fi

RUSTC=$(compiler)
export RUSTC CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER=qemu-aarch64
# tests ARGUMENTS...: a filter that meets none is a failure, too.
tests() {
    said=$(cargo test --target $target --target-dir "${CARGO_TARGET_DIR:-target}/aarch64" --ignore-rust-version "$@")
    echo "$said"
    echo "$said" | grep -q '^running [1-9]'
}
tests --package wis --test renderer simd::
tests --package wis-fuzz --bin wis-digests
