#!/bin/sh
# Opens the report in a browser without a window, at the width of a desktop and of a phone: test-report.sh PAGE FOLDER
# Every picture and plot must have loaded and nothing may be wider than the window. Screenshots go to the folder.
set -eu
page=$(realpath "$1")
folder=$2
mkdir -p "$folder"
failed=0
for size in 1280,2400 400,2400; do
    profile=$(mktemp -d)
    browser="chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --user-data-dir=$profile --window-size=$size"
    $browser --virtual-time-budget=20000 --dump-dom "file://$page" > "$folder/dom-$size.html" 2> "$folder/log-$size.txt"
    $browser --virtual-time-budget=20000 --screenshot="$folder/screen-$size.png" "file://$page" 2>> "$folder/log-$size.txt"
    rm -rf "$profile"
    loaded=$(grep -o '<html[^>]*>' "$folder/dom-$size.html" | head -n 1)
    echo "$size: ${loaded:-nothing was loaded}"
    value() { echo "$loaded" | sed -n "s/.*data-$1=\"\([^\"]*\)\".*/\1/p"; }
    for kind in images plots; do
        count=$(value $kind)
        # A quick report has no pictures.
        if [ -z "$count" ] || [ "${count%/*}" != "${count#*/}" ] || [ "$kind $count" = "plots 0/0" ]; then
            echo "FAIL $size: $kind loaded: ${count:-none}" >&2
            failed=1
        fi
    done
    [ "$(value fits)" = true ] || { echo "FAIL $size: the page is wider than the window" >&2; failed=1; }
    [ -s "$folder/screen-$size.png" ] || { echo "FAIL $size: no screenshot" >&2; failed=1; }
done
exit $failed
