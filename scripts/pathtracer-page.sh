#!/bin/sh
# Runs the path tracer under each lat-long map of a folder and writes its page: pathtracer-page.sh PROGRAM MAPS PAGE
# Results stay in PAGE.runs, and a file of them in place of MAPS writes the page alone.
set -eu
program=$1
maps=$2
page=$3
runs=$page.runs
measured=
if [ -f "$maps" ]; then
    runs=$maps
    # What the page says of the run it was measured in stays.
    measured=$(sed -n '/^Commit /,$p' "$page")
else
    : > "$runs"
fi

# Every so many pixels of an image of 960 x 560: hits of a pixel are then as near to one another as those of a real image.
stride=40

# run KIND MAP STRATIFIED ARGUMENTS...: each line of the program's table, with what it belongs to.
run() {
    kind=$1
    map=$2
    stratified=$3
    shift 3
    "$program" --map "$map" --stratified "$stratified" --width 24 --height 14 "$@" |
        awk -v kind="$kind" -v map="$(basename "$map" .hdr)" -v s="$stratified" \
            '$1 ~ /^[0-9]+$/ && NF == 8 { print kind, map, s, $0 }' >> "$runs"
}

for map in "$maps"/*.hdr; do
    case $map in *cross* | *probe*) continue ;; esac
    [ -f "$map" ] || continue
    for stratified in 0 1; do
        run equal "$map" $stratified --stride $stride --most 64 --repeats 2 --reference 250 \
            --methods mis,compensated,direct,alone,product,reuse-base
        both=candidates,direct,alone-candidates,alone
        run narrow "$map" $stratified --stride $stride --least 16 --most 256 --repeats 2 --reference 500 --methods $both
        run first "$map" $stratified --stride $stride --depth 1 --least 16 --most 256 --repeats 16 --reference 1000 \
            --methods alone
        case $map in *venice* | *studio_small* | *rooitou* | *st_fagans*)
            run wide "$map" $stratified --least 16 --most 256 --repeats 6 --reference 500 --methods $both ;;
        esac
    done
done

awk -v lines="$(cat c-examples/pathtracer/scene.h c-examples/pathtracer/path.h | wc -l)" '
function better(a, b) { return a < b ? a : b }
# Gain of shared products over candidates, by the split ("") or for all light ("alone-").
function gain_of_sharing(k, m, prefix) {
    return cost(k, m, prefix "candidates") / cost(k, m, prefix == "" ? "direct" : "alone")
}
function many(    i, k, m, part, rows, p) {
    prefixes[1] = ""; prefixes[2] = "alone-"
    for (i = 1; i <= count; i++) {
        k = keys[i]; split(k, part, SUBSEP)
        if (part[1] != "narrow" && part[1] != "wide") continue
        rows = rows sprintf("| %s | %s | %s | %d |", part[2], part[1], name[part[3]], part[4])
        for (p = 1; p <= 2; p++) {
            for (m = 1; m <= 2; m++) {
                rows = rows sprintf(" %.2fx |", gain_of_sharing(k, m, prefixes[p]))
                cells++
                ahead += gain_of_sharing(k, m, prefixes[p]) > 1
            }
        }
        rows = rows "\n"
    }
    print "## Candidates or shared products\n"
    print "Efficiency of shared products over candidates at equal time. Above 1, sharing is better. Products serve first hits of wide lobes alone:"
    print "narrow lobes and later bounces have candidates in both columns. The sampler shares from 16 hits of a pixel on. "
    printf "**Sharing is ahead in %d of %d cells.**\n\n", ahead, cells
    print "Narrow pixels are those of the rest of this page. Wide ones are those of an image of 24 x 14, which span several surfaces.\n"
    print "| map | pixels | numbers | samples | compensated: absolute | relative | plain: absolute | relative |\n| --- | --- | --- | --- | --- | --- | --- | --- |"
    printf "%s", rows
}
function slope(kind, map, numbers, method,    least, most) {
    least = kind SUBSEP map SUBSEP numbers SUBSEP 16
    most = kind SUBSEP map SUBSEP numbers SUBSEP 256
    return log(error[most, 2, method] / error[least, 2, method]) / log(16)
}
function convergence(    i, part, x, numbers, sum, n, steep) {
    print "\n## Convergence\n"
    print "Slope of log relative error over log samples, from 16 to 256 samples per pixel. Independent samples have -1. The light is plain, and"
    print "`wis_direct` brings all of it. First hit: direct light there and nothing else. Paths: of four hits, whose BSDF rays are the"
    print "client\047s. Random numbers are for places in the pixel and BSDF rays alone: what they add falls as -1.\n"
    print "| map | random: first hit | random: paths | (0,2)-sequence: first hit | (0,2)-sequence: paths |\n| --- | --- | --- | --- | --- |"
    for (i = 1; i <= count; i++) {
        split(keys[i], part, SUBSEP)
        if (part[1] != "first" || part[3] != 0 || part[4] != 16) continue
        printf "| %s |", part[2]
        n++
        for (numbers = 0; numbers <= 1; numbers++) {
            x = slope("first", part[2], numbers, "alone")
            sum[2 * numbers] += x
            steep += numbers == 0 && x <= -1.095
            printf " %.2f |", x
            x = slope("narrow", part[2], numbers, "alone")
            sum[2 * numbers + 1] += x
            printf " %.2f |", x
        }
        print ""
    }
    if (n == 0) return
    printf "| mean | %.2f | %.2f | %.2f | %.2f |\n", sum[0] / n, sum[1] / n, sum[2] / n, sum[3] / n
    printf "\nDirect light at the first hit with random numbers has a slope of -1.1 or steeper under %d of %d maps.\n", steep, n
}
function cost(k, metric, method) { return seconds[k, method] * error[k, metric, method] }
{
    k = $1 SUBSEP $2 SUBSEP $3 SUBSEP $4
    seconds[k, $5] = $6
    error[k, 1, $5] = $8
    error[k, 2, $5] = $9
    if (!(k in seen)) { seen[k] = 1; keys[++count] = k }
    if (!($2 in known)) { known[$2] = 1; names = names (names == "" ? "" : ", ") $2 }
    kinds[$1]++
}
END {
    name[0] = "random"; name[1] = "(0,2)-sequence"; metric[1] = "absolute"; metric[2] = "relative"
    split("1 4 16 64 256", samples, " ")
    for (i = 1; i <= count; i++) {
        k = keys[i]; split(k, part, SUBSEP)
        if (part[1] != "equal") continue
        for (m = 1; m <= 2; m++) {
            gain = better(cost(k, m, "mis"), cost(k, m, "compensated")) / cost(k, m, "direct")
            total[part[3]]++
            won[part[3]] += gain > 1
            if (gain <= 1) {
                mis = cost(k, m, "mis") < cost(k, m, "compensated") ? "mis" : "compensated"
                less = error[k, m, mis] / error[k, m, "direct"]
                lost++
                lost_by_time += less > 1
                losses = losses sprintf("| %s | %s | %d | %s | %.2fx | %.2fx | %.2fx |\n", part[2], name[part[3]], part[4],
                    metric[m], gain, less, seconds[k, "direct"] / seconds[k, mis])
            }
            g = part[3] SUBSEP part[4] SUBSEP m
            n[g]++
            split("direct alone product reuse-base", methods, " ")
            for (j = 1; j <= 4; j++) {
                x = better(cost(k, m, "mis"), cost(k, m, "compensated")) / cost(k, m, methods[j])
                logs[g, methods[j]] += log(x)
                if (!((g, methods[j]) in least) || x < least[g, methods[j]]) least[g, methods[j]] = x
            }
        }
    }
    print "# Light in a path tracer, at equal time\n"
    print "**Build the light compensated, let BSDF rays bring the map up to its mean, and let `wis_direct` bring the rest.**\n"
    printf "Against the better of MIS and compensated MIS, this wins %d of %d cells with random numbers, and %d of %d with a\n", won[0], total[0], won[1], total[1]
    print "(0,2)-sequence. A cell is a map, a number of samples per pixel and a metric. Efficiency is 1 / (error x time)."
    print "Maps of this run: " names ".\n"
    print "## Where it loses\n"
    if (losses == "") print "In no cell.\n"
    else {
        printf "In %d of these %d cells it has less error with as many samples, and takes more time than that gains.\n\n", lost_by_time, lost
        print "| map | numbers | samples per pixel | metric | efficiency over the better MIS | error of that MIS over that of direct | time of direct over that of the MIS |"
        print "| --- | --- | --- | --- | --- | --- | --- |\n" losses
    }
    print "## Efficiency over the better of MIS and compensated MIS\n"
    print "Geometric mean over maps, and in brackets the worst map. Above 1 is better.\n"
    print "| numbers | samples | metric | direct | direct alone | product with MIS | product kept by the client |\n| --- | --- | --- | --- | --- | --- | --- |"
    for (s = 0; s <= 1; s++) for (q = 1; q <= 4; q++) for (m = 1; m <= 2; m++) {
        g = s SUBSEP samples[q] SUBSEP m
        printf "| %s | %d | %s |", name[s], samples[q], metric[m]
        for (j = 1; j <= 4; j++) printf " %.2fx (%.2fx) |", exp(logs[g, methods[j]] / n[g]), least[g, methods[j]]
        print ""
    }
    print "\n- **direct**: `wis_direct` on a compensated light brings what exceeds the mean of the map; BSDF rays that leave the scene bring"
    print "  the map up to its mean."
    print "- **direct alone**: `wis_direct` brings all light; BSDF rays that leave the scene bring none."
    print "- **product with MIS**: a product at each hit, `wis_sample`, and deferred MIS: one float in the path state."
    print "- **product kept by the client**: one product for each pixel and material (`wis_product_covers`), in the split of direct.\n"
    if (kinds["narrow"] == 0) print "Shared products and convergence were not measured in this run."
    else { many(); convergence() }
    print "\n## Each map\n"
    print "Error times seconds, relative to MIS (below 1 is better): absolute / relative.\n"
    print "| map | numbers | samples | compensated MIS | direct | direct alone | product with MIS |\n| --- | --- | --- | --- | --- | --- | --- |"
    split("compensated direct alone product", columns, " ")
    for (i = 1; i <= count; i++) {
        k = keys[i]; split(k, part, SUBSEP)
        if (part[1] != "equal") continue
        printf "| %s | %s | %d |", part[2], name[part[3]], part[4]
        for (j = 1; j <= 4; j++) printf " %.2f / %.2f |", cost(k, 1, columns[j]) / cost(k, 1, "mis"), cost(k, 2, columns[j]) / cost(k, 2, "mis")
        print ""
    }
    print "\n## How it was measured\n"
    printf "`make pathtracer-page MAPS=folder` wrote this page. The tracer has %d lines (`scene.h`, `path.h` in\n", lines
    print "`c-examples/pathtracer`): spheres, a mesh of 115,200 triangles, Lambert, GGX of 0.15 and 0.3, patterned albedo, four bounces. One"
    print "ray for light at each hit. 24 x 14 pixels, every 40th of an image of 960 x 560; processor time of one thread; methods take turns."
    print "Errors are the mean of (image - one reference) x (image - the other), so that the noise of references does not bias them. Each reference"
    print "has 250 to 1000 samples of four rays at each hit, and seeds of its own. Relative error: squared error / (reference^2 + 1e-4 mean^2)."
    print ""
}' "$runs" > "$page"
if [ -n "$measured" ]; then
    printf '%s\n' "$measured" >> "$page"
else
    scripts/provenance.sh pathtracer-page >> "$page"
fi
