#!/bin/sh
# Runs every check of the repository, one line each, and shows the output of those that fail: test.sh [build folder]
set -u
cd "$(dirname "$0")/.."

mkdir -p "${1:-build}/test"
build=$(cd "${1:-build}" && pwd)
logs=$build/test
stage=$logs/stage
# Not the prefix that the package is made for: the installed tree must work from where it was moved to.
installed=$stage/opt/wis
# Where the kernel's tests leave them.
examples=${CARGO_TARGET_DIR:-target}/debug/examples
verdicts=$logs/verdicts
: > "$verdicts"

# step NAME COMMAND...
step() {
    name=$1
    shift
    start=$(date +%s)
    if "$@" > "$logs/$name.log" 2>&1 < /dev/null; then
        verdict="ok  "
    else
        verdict="FAIL"
    fi
    echo "$verdict" >> "$verdicts"
    printf '%s  %-14s %4d s\n' "$verdict" "$name" $(($(date +%s) - start))
    [ "$verdict" = "ok  " ] || sed 's/^/      /' "$logs/$name.log"
}

# cargo_step NAME SUBCOMMAND...: skipped where that part of the toolchain is not installed.
cargo_step() {
    name=$1
    shift
    if cargo "$1" --version > /dev/null 2>&1; then
        step "$name" cargo "$@"
    else
        echo "skip  $name: cargo $1 is not installed"
    fi
}

install_staged() {
    rm -rf "$stage"
    make --no-print-directory install BUILD="$build" DESTDIR="$stage" PREFIX=/opt/wis
}

# Twins in C++ and Rust must print what the C programs print.
minimal() {
    for program in minimal wavelets pathtracer-small; do
        make --no-print-directory "$build/$program" "$build/$program-cpp" BUILD="$build" &&
            "$build/$program" > "$logs/$program.txt" && cat "$logs/$program.txt" &&
            "$build/$program-cpp" > "$logs/$program-cpp.txt" && diff "$logs/$program.txt" "$logs/$program-cpp.txt" || return 1
    done
    "$examples/minimal" | diff "$logs/minimal.txt" - && "$examples/pathtracer" | diff "$logs/pathtracer-small.txt" - &&
        make --no-print-directory "$build/first" "$build/pathtracer" BUILD="$build" &&
        (cd "$logs" && rm -f first.pgm && "$build/first" && [ -s first.pgm ]) &&
        "$build/pathtracer" --width 8 --height 4 --most 4 --repeats 1 --reference 4 > /dev/null
}

minimal_valgrind() {
    for program in minimal minimal-cpp wavelets; do
        valgrind --quiet --error-exitcode=1 --leak-check=full "$build/$program" || return 1
    done
}

demo() {
    make --no-print-directory "$build/demo" BUILD="$build" &&
        "$build/demo" --size 96x54 --reference-spp 64 --out "$logs/demo.png" && [ -s "$logs/demo.png" ] &&
        make --no-print-directory "$build/gallery-program" BUILD="$build" &&
        "$build/gallery-program" --only spot --size 256x240 --seconds 0.1 --reference 0.2 --out "$logs/gallery" &&
        [ -s "$logs/gallery/spot.png" ] && [ -s "$logs/gallery/spot-crop.png" ]
}

# Clippy compiles tests, where it is installed, and lints on the way: a pass of its own would check all that they depend on once more.
clippy_driver=$(command -v clippy-driver || true)

# linted NAME COMMAND...: fails for a warning, too.
linted() {
    report=$logs/$1.txt
    shift
    RUSTC_WORKSPACE_WRAPPER=$clippy_driver "$@" > "$report" 2>&1
    verdict=$?
    cat "$report"
    [ $verdict = 0 ] && ! grep -q '^warning' "$report"
}

# The kernel's, the fuzzer's and those of chores; and the benchmarks as far as they compile.
test_kernel() {
    linted kernel cargo test --workspace --exclude wis-ffi-tests --exclude wis-capi --no-fail-fast &&
        linted benchmarks cargo test --workspace --exclude wis-ffi-tests --exclude wis-capi --bench kernel --no-run
}

instruments() {
    RUSTC_WORKSPACE_WRAPPER=$clippy_driver scripts/instruments.sh "$installed/lib" "$@"
}

# Their own tests link the shared library.
test_instruments() {
    linted instruments scripts/instruments.sh "$installed/lib" test --lib --bins
}

# The packages that this takes are another architecture's: it runs where they are.
aarch64() {
    if scripts/check-aarch64.sh --check; then
        step aarch64 scripts/check-aarch64.sh
    else
        echo "skip  aarch64: make check-aarch64 installs what it needs"
    fi
}

# The kernel, for which cargo builds in one folder,
kernel() {
    cargo_step format fmt --all --check
    step rust-tests test_kernel
    step crate scripts/check-crate.sh
    aarch64
    # The other lane installed the library long ago, if it could.
    while [ ! -e "$logs/installed" ]; do sleep 1; done
    step sanitizers scripts/check-sanitizers.sh "$installed/lib" "$logs/sanitizers"
    step growth scripts/check-growth.sh "$installed/lib" "$logs/growth"
    step minimal minimal
    step valgrind minimal_valgrind
    step demo demo
    step maps scripts/check-maps.sh "$build" "$logs/maps"
}

# and what takes the installed library, for which it builds in others.
library() {
    cargo_step clippy-capi clippy --release --package wis-capi -- -D warnings
    step install install_staged
    touch "$logs/installed"
    step header scripts/check-header.sh
    step size scripts/check-size.sh "$installed/lib" "$logs/size"
    step instructions scripts/check-instructions.sh "$installed/lib" "$logs/instructions"
    step symbols scripts/check-symbols.sh "$installed/lib"
    step licences scripts/check-licences.sh "$installed"
    step mathematics scripts/check-mathematics.sh "$installed" "$logs/mathematics"
    step freestanding scripts/check-freestanding.sh "$installed" "$logs/freestanding"
    step consumers scripts/check-consumers.sh "$installed" "$logs/consumers"
    step hosts scripts/check-hosts.sh "$installed/lib" "$logs/hosts"
    step integrating scripts/check-integrating.sh "$logs/integrating"
    step abi scripts/check-abi.sh
    step dist scripts/dist.sh "$build"
    step python scripts/test-python.sh "$build" "$installed"
    step instruments test_instruments
    step fuzz scripts/fuzz.sh "$installed/lib" 0.5 1
    # In the installed library, as a client has it.
    step hardcases instruments run --bin hardcases -- docs/measurements/hard-cases.md --check
    # Times mean nothing on a machine that is busy; that instruments run, that errors fall and that the light misses no goal by far does.
    step report-quick instruments run --bin measure -- report --quick --out "$logs/report" --cache "$logs/report-cache"
    step light-quick instruments run --bin measure -- light --quick "$logs/light.md"
    step rooms-quick instruments run --bin measure -- rooms --quick "$logs/rooms.md"
}

# Side by side, for two cores.
rm -f "$logs/installed"
kernel &
library
wait

failed=$(grep -c FAIL "$verdicts")
echo "$(($(wc -l < "$verdicts") - failed)) passed, $failed failed"
[ "$failed" = 0 ]
