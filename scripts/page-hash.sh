#!/bin/sh
# Prints what a measured page was made from, as sixteen hexadecimal digits: the recorded bits of the library and the sources of
# the instrument that wrote the page. page-hash.sh NAME, the instrument's name in ffi-tests/src/bin, or gallery
set -eu
cd "$(dirname "$0")/.."
sources() {
    find tests -name '*.rs' -exec grep -l 'const RECORD' {} +
    if [ "$1" = gallery ]; then
        find c-examples/gallery c-examples/relight/mesh.c c-examples/relight/tracer.c c-examples/render -name '*.[ch]' -not -name 'page.*'
        return
    fi
    find ffi-tests/src -name '*.rs' -not -path '*/bin/*' -not -path '*/hardcases/*'
    find ffi-tests/src/bin -path "*/bin/$1.rs" -o -path "*/bin/$1/*.rs"
}

sources "$1" | LC_ALL=C sort | xargs cat | sha256sum | cut -c 1-16
