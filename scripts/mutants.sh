#!/bin/sh
# Breaks one rule at a time and requires that a test notices: mutants.sh [NAME...], names of tests/mutants without .patch
#
# Each patch begins with three lines, `Fault: what is broken`, `Rule: its number in docs/design.md, or none` and `Test: arguments
# of cargo test that name one test`. The sources are copied to a folder of their own; there every named test must pass, and then
# fail for its patch. A patch with `Adds: what` in place of a fault brings its test along, which must pass.
set -u
cd "$(dirname "$0")/.."

work=${CARGO_TARGET_DIR:-target}/mutants
mkdir -p "$work"
work=$(cd "$work" && pwd)
copy=$work/source
patches=$(pwd)/tests/mutants
export CARGO_TARGET_DIR="$work/target"
# Seconds. A fault may make a test endless, and so be noticed.
longest=300
bad=0

field() {
    sed -n "s/^$1: //p" "$patches/$2.patch" | head -n 1
}

# Makes the copy what is tracked or will be, as it is now. Unchanged files keep their times, so that cargo builds little.
refresh() {
    mkdir -p "$copy"
    git ls-files --cached --others --exclude-standard | sort > "$work/files"
    while read -r file; do
        if [ -f "$file" ] && ! cmp -s "$file" "$copy/$file"; then
            mkdir -p "$copy/$(dirname "$file")" && cp "$file" "$copy/$file" || exit 1
        fi
    done < "$work/files"
    (cd "$copy" && find . -type f | sed 's|^\./||' | sort | comm -13 "$work/files" - | xargs -r rm)
}

# run_test NAME: passes, fails, does not end, does not build, or is not there.
run_test() {
    log=$work/$1.log
    # The arguments are split into words on purpose.
    # shellcheck disable=SC2046
    set -- $(field Test "$1")
    if ! (cd "$copy" && cargo test --quiet --no-run "$@") > "$log" 2>&1; then
        echo "does not build"
        return
    fi
    (cd "$copy" && timeout "$longest" cargo test "$@" -- --exact) > "$log" 2>&1
    case $? in
        0) if grep -q '^test result: ok. 1 passed' "$log"; then echo passes; else echo "no such test"; fi ;;
        124) echo "does not end" ;;
        *) if grep -q '^test .* FAILED$' "$log"; then echo fails; else echo "ends without a verdict"; fi ;;
    esac
}

# Lines may have moved and their surroundings changed a little; more than that needs a new patch.
apply() {
    patch --directory="$copy" --strip=1 --forward --fuzz=2 --no-backup-if-mismatch --reject-file=- \
        < "$patches/$1.patch" > "$work/$1.log" 2>&1
}

# judge NAME: red if the test fails for the patch, or takes far longer than any test does.
judge() {
    if ! apply "$1"; then
        echo "BAD: the patch no longer applies"
        return
    fi
    with=$(run_test "$1")
    case "$with" in
        fails | "does not end") echo red ;;
        passes) if [ -n "$(field Adds "$1")" ]; then echo added; else echo GREEN; fi ;;
        *) echo "BAD: with the patch the test $with" ;;
    esac
}

command -v patch > /dev/null || { echo "mutants: patch is missing" >&2; exit 1; }
[ $# -gt 0 ] || set -- $(cd "$patches" && ls ./*.patch | sed 's|^\./||; s|\.patch$||')
for name; do
    [ -n "$(field Fault "$name")$(field Adds "$name")" ] && [ -n "$(field Rule "$name")" ] && [ -n "$(field Test "$name")" ] ||
        { echo "mutants: no Fault, Rule or Test line in tests/mutants/$name.patch" >&2; exit 1; }
done

refresh
for name; do
    run_test "$name" > "$work/$name.without"
done
echo "| mutant | rule | fault | test | verdict |"
echo "|---|---|---|---|---|"
for name; do
    without=$(cat "$work/$name.without")
    wanted=red before=passes
    [ -z "$(field Adds "$name")" ] || wanted=added before="no such test"
    if [ "$without" = "$before" ]; then
        refresh
        verdict=$(judge "$name")
    else
        verdict="BAD: without the patch the test $without"
    fi
    echo "| $name | $(field Rule "$name") | $(field Fault "$name")$(field Adds "$name") | $(field Test "$name") | $verdict |"
    [ "$verdict" = "$wanted" ] || { bad=$((bad + 1)); sed 's/^/      /' "$work/$name.log" >&2; }
done
refresh
echo
echo "$# mutants, $(($# - bad)) as wanted"
[ "$bad" = 0 ]
