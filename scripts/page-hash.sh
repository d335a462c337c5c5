#!/bin/sh
# Prints what a measured page was made from, as sixteen hexadecimal digits: the recorded bits of the library and the sources of
# the instrument that wrote the page. page-hash.sh NAME: an instrument of ffi-tests/src/bin, or gallery, pathtracer-page, hardcases, renderers
set -eu
cd "$(dirname "$0")/.."
sources() {
    echo fuzz/digests/record.txt
    case $1 in
        gallery)
            find c-examples/direct.h c-examples/gallery c-examples/render -name '*.[ch]' -not -name 'page.*' ;;
        pathtracer-page) find c-examples/direct.h c-examples/pathtracer c-examples/render -name '*.[ch]' -not -name 'small.c' ;;
        hardcases) find ffi-tests/src/bin/hardcases.rs ffi-tests/src/hardcases -name '*.md' -o -name '*.rs' ;;
        renderers) find ffi-tests/mitsuba ffi-tests/pictures.rs ffi-tests/rpt ffi-tests/threers python/wisdirect -name '*.py' -o -name '*.rs' -o -name requirements.txt ;;
        *)
            find ffi-tests/src -name '*.rs' -not -path '*/bin/*' -not -path '*/hardcases/*'
            find ffi-tests/src/bin -path "*/bin/$1.rs" -o -path "*/bin/$1/*" -o -path "*/bin/measure/$1/*" -o -path "*/bin/measure/*.rs" -not -path "*/measure/*/*" ;;
    esac
}

sources "$1" | LC_ALL=C sort | xargs cat | sha256sum | cut -c 1-16
