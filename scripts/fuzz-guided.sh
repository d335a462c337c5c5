#!/bin/sh
# Fuzzes the kernel with its coverage as the guide: fuzz-guided.sh OUTPUT_FOLDER MINUTES [INPUT | keep]
# The flags are those that cargo-fuzz passes, without a sanitizer: these work with the stable compiler. Only the kernel counts edges.
# The first run begins with fuzz/corpus.tar.gz. What was reached stays in OUTPUT_FOLDER/corpus for the next run.
# With INPUT, a file that an earlier run left, that input alone. With keep, the fewest inputs that reach what OUTPUT_FOLDER/corpus
# reaches become fuzz/corpus.tar.gz.
set -eu
cd "$(dirname "$0")/.."
minutes=$2
target=$(mkdir -p "${CARGO_TARGET_DIR:-target}/guided" && cd "${CARGO_TARGET_DIR:-target}/guided" && pwd)
mkdir -p "$1/corpus"
out=$(cd "$1" && pwd)
kept=$(pwd)/fuzz/corpus.tar.gz
input=${3:-}
case $input in '' | keep) ;; *) input=$(cd "$(dirname "$input")" && pwd)/$(basename "$input") ;; esac
longest=1152 # bytes: 12 calls of 96
# With --target the flags do not reach build scripts, which no engine is linked to.
platform=$(rustc -vV | sed -n 's/^host: //p')
pass="-Cpasses=sancov-module -Ccodegen-units=1"
for argument in level=4 inline-8bit-counters pc-table trace-compares; do
    pass="$pass -Cllvm-args=-sanitizer-coverage-$argument"
done
RUSTFLAGS="$pass" cargo build --quiet --profile instruments --config 'profile.instruments.panic="abort"' --package wis-capi --target "$platform" --target-dir "$target"
(cd fuzz/guided && cargo build --quiet --release --target-dir "$target")
export WIS_LIBRARY="$target/$platform/instruments/libwis.so"
fuzz=$target/release/wis-fuzz-guided
cd "$out"
if [ "$input" = keep ]; then
    rm -rf kept
    mkdir kept
    "$fuzz" -merge=1 -max_len=$longest kept corpus > log.txt 2>&1
    # No times and owners, so that equal inputs make an equal archive.
    tar --sort=name --mtime=@0 --owner=0 --group=0 --numeric-owner -cf - -C kept . | gzip -n9 > "$kept"
    echo "$(ls kept | wc -l) inputs, $(wc -c < "$kept") bytes"
    exit
fi
if [ -n "$input" ]; then
    exec "$fuzz" "$input"
fi
tar -xzf "$kept" --skip-old-files -C corpus
if ! "$fuzz" corpus -max_total_time=$((minutes * 60)) -max_len=$longest -len_control=20 -timeout=30 \
    -artifact_prefix="$out/" -print_final_stats=1 > log.txt 2>&1; then
    grep -v '^#' log.txt | tail -n 20
    echo "FAILED: make fuzz-guided INPUT=$(ls -t "$out"/crash-* "$out"/timeout-* "$out"/oom-* 2> /dev/null | head -n 1)"
    exit 1
fi
# Edges of the kernel; reached at the beginning and at the end, with the number of inputs.
grep -E '^INFO: Loaded 1 PC tables' log.txt
grep -E '^#.*(INITED|DONE) +cov:' log.txt
