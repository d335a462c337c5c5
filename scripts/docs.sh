#!/bin/sh
# Writes the reference of the headers as HTML: docs.sh <build folder>
set -eu
cd "$(dirname "$0")/.."
rm -rf "$1/docs/html"
mkdir -p "$1/docs"
build=$(cd "$1" && pwd)
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
doxygen - <<SETTINGS
PROJECT_NAME = wis
PROJECT_NUMBER = $version
PROJECT_BRIEF = "Direct light from environment maps"
INPUT = include README.md docs docs/measurements
USE_MDFILE_AS_MAINPAGE = README.md
IMAGE_PATH = docs docs/gallery $(find docs/measurements -type d | tr '\n' ' ')
EXCLUDE = docs/crate.md
OUTPUT_DIRECTORY = $build/docs
OPTIMIZE_OUTPUT_FOR_C = YES
TYPEDEF_HIDES_STRUCT = YES
JAVADOC_AUTOBRIEF = YES
EXTRACT_ALL = YES
GENERATE_LATEX = NO
QUIET = YES
WARN_IF_DOC_ERROR = NO
WARNINGS = NO
SORT_MEMBER_DOCS = NO
MACRO_EXPANSION = YES
EXPAND_ONLY_PREDEF = YES
HAVE_DOT = NO
HTML_EXTRA_STYLESHEET = scripts/docs.css
HTML_COLORSTYLE_HUE = 28
HTML_COLORSTYLE_SAT = 60
GENERATE_TREEVIEW = YES
SORT_GROUP_NAMES = NO
SETTINGS
pages=$(find "$build/docs/html" -name '*.html' | wc -l)
[ -e "$build/docs/html/group__direct.html" ] || { echo "docs: the group of direct light is not in the reference" >&2; exit 1; }
grep -rqs wis_direct_wave "$build/docs/html" || { echo "docs: wis_direct_wave is not in the reference" >&2; exit 1; }
echo "$build/docs/html/index.html: $pages pages"
