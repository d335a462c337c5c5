#!/bin/sh
# Runs renderers from registries as clients: test-renderers.sh <build folder> mitsuba <page> [--quick] | rpt <page> | threers <page> | cycles
set -eu
cd "$(dirname "$0")/.."
mkdir -p "$1"
build=$(cd "$1" && pwd)
renderer=$2
shift 2
folder=ffi-tests/$renderer
if [ -e "$folder/Cargo.toml" ]; then
    exec cargo run --quiet --release --manifest-path "$folder/Cargo.toml" --target-dir "${CARGO_TARGET_DIR:-target}/$renderer" -- "$@"
fi
venv=$build/$renderer
# Made anew when a version changes.
if ! cmp -s "$folder/requirements.txt" "$venv/requirements.txt"; then
    rm -rf "$venv"
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$folder/requirements.txt"
    cp "$folder/requirements.txt" "$venv/requirements.txt"
fi
"$venv/bin/pip" install --quiet --disable-pip-version-check ./python
export WIS_BUILD="$build" PYTHONDONTWRITEBYTECODE=1
if [ "$renderer" = cycles ]; then
    exec "$venv/bin/python" "$folder/lookup.py"
fi
# Older ones lack instructions that Mitsuba's compiler emits.
DRJIT_LIBLLVM_PATH=$(find /usr/lib -name 'libLLVM.so.19*' | sort | tail -n 1)
[ -n "$DRJIT_LIBLLVM_PATH" ] || { echo "renderers: libLLVM 19 is missing: scripts/setup.sh renderers" >&2; exit 1; }
export DRJIT_LIBLLVM_PATH
"$venv/bin/python" -m pytest -q -p no:cacheprovider python/tests/test_mitsuba.py
"$venv/bin/python" "$folder/main.py" "$@"
{ echo && scripts/provenance.sh renderers; } >> "$1"
