#!/bin/sh
# Compares the binary interface of the recorded headers with packaging/abi.txt: check-abi.sh [--record]
#
# What is compared: declarations of functions and callbacks, values of constants, sizes and offsets of structs.
set -eu
cd "$(dirname "$0")/.."
headers="include/wis.h include/wis_lights.h include/wis_wavelets.h"
record=packaging/abi.txt
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Declarations without comments, each on one line with single spaces.
# The list is split into words on purpose.
# shellcheck disable=SC2086
sed -e 's|^ *///.*||' -e 's|/\*.*\*/||' $headers | awk '/^\/\*/, /\*\// { next } /^#|^extern "C"|^}$/ { next } { print }' |
    tr '\n' ' ' | tr -s ' ' > "$work/code"

{
    echo '#include <stddef.h>'
    echo '#include <stdio.h>'
    for header in $headers; do echo "#include \"$(basename "$header")\""; done
    echo 'int main(void) {'
    {
        # shellcheck disable=SC2086
        sed -n 's/^#define \(WIS_[A-Z0-9_]*\) [^ ].*/\1/p' $headers | grep -v '^WIS_VERSION$'
        grep -oE 'WIS_[A-Z0-9_]+ = [0-9]+' "$work/code" | sed 's/ = .*//'
    } | LC_ALL=C sort | sed 's/.*/    printf("constant & = %lld\\n", (long long)&);/'
    # A struct's fields end with a semicolon; the name of each is the last word before an array's size.
    grep -oE 'typedef struct wis_[a-z_]+ \{[^}]*\}' "$work/code" | awk '{
        name = $3
        printf "    printf(\"struct %s: %%zu bytes, alignment %%zu\\n\", sizeof(%s), _Alignof(%s));\n", name, name, name
        sub(/^[^{]*\{/, "")
        count = split($0, field, ";")
        for (i = 1; i < count; i++) {
            gsub(/\[[^]]*\]/, "", field[i])
            words = split(field[i], word, /[ *]+/)
            printf "    printf(\"struct %s.%s: %%zu, %%zu bytes\\n\", offsetof(%s, %s), sizeof(((%s *)0)->%s));\n", name, word[words], name, word[words], name, word[words]
        }
    }'
    echo '    return 0;'
    echo '}'
} > "$work/layout.c"
cc -std=c11 -Iinclude "$work/layout.c" -o "$work/layout"
{
    "$work/layout"
    grep -oE '(enum wis_status|uint32_t|const char \*) ?wis_[a-z0-9_]+\([^;]*;' "$work/code" | sed 's/^/function /' | LC_ALL=C sort
    grep -oE 'typedef [a-z_ ]+\*?\(\*wis_[a-z_]+\)\([^;]*;' "$work/code" | sed 's/^typedef/callback/' | LC_ALL=C sort
} > "$work/abi.txt"

if [ "${1:-}" = --record ]; then
    cp "$work/abi.txt" "$record"
elif ! diff "$record" "$work/abi.txt"; then
    echo "abi: the binary interface changed: see docs/abi.md, and record it by scripts/check-abi.sh --record" >&2
    exit 1
fi
