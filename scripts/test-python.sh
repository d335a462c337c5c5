#!/bin/sh
# Installs the Python package from its source distribution, in an environment of its own, and runs its tests:
# test-python.sh <build folder> <folder with include/ and lib/ of the C library>
set -eu
cd "$(dirname "$0")/.."
mkdir -p "$1"
build=$(cd "$1" && pwd)
library=$2
venv=$build/python-venv
if [ ! -e "$venv/made" ]; then
    rm -rf "$venv"
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check numpy pytest 'cffi>=1.15' 'setuptools>=77'
    touch "$venv/made"
fi
rm -rf "$build/sdist"
(cd python && "$venv/bin/python" setup.py --quiet sdist --dist-dir "$build/sdist")
# Out of the tree, but with its compiled crates.
CARGO_TARGET_DIR=$(realpath -m "${CARGO_TARGET_DIR:-target}") \
    "$venv/bin/pip" install --quiet --disable-pip-version-check --no-build-isolation --no-deps --force-reinstall "$build"/sdist/*.tar.gz
"${CC:-cc}" -std=c99 -O2 -Wall -Wextra -Wpedantic -I"$library/include" python/tests/twenty.c "$library/lib/libwis.a" -o "$build/twenty"
"$build/twenty" > "$build/twenty.txt"
export WIS_TWENTY="$build/twenty.txt" PYTHONDONTWRITEBYTECODE=1
"$venv/bin/python" -m pytest -q -p no:cacheprovider python/tests
