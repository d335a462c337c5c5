#!/bin/sh
# Compiles the code of docs/integrating.md, one block after the other: check-integrating.sh <output folder>
set -eu
cd "$(dirname "$0")/.."
out=$1
mkdir -p "$out"
{
    echo '#include "c-examples/integrating/renderer.h"'
    # Line numbers of the page, for the compiler's messages.
    awk '/^```c$/ { code = 1; printf "#line %d \"docs/integrating.md\"\n", NR + 1; next } /^```$/ { code = 0 } code' docs/integrating.md
} > "$out/integrating.c"
cc -std=c99 -Wall -Wextra -Wpedantic -Werror -Wno-unused-function -fsyntax-only -I. -Iinclude "$out/integrating.c"
blocks=$(grep -c '^#line' "$out/integrating.c")
[ "$blocks" -ge 10 ] || { echo "integrating: only $blocks blocks of code were found" >&2; exit 1; }
echo "$blocks blocks compile"
