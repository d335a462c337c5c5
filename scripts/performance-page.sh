#!/bin/sh
# Writes docs/performance.md, docs/claims.md and what README.md says of gains and pictures, with the numbers of the measured pages,
# or says that they are stale: performance-page.sh [--check]
# A number that its page no longer has fails the script.
set -eu
cd "$(dirname "$0")/.."
written=$(mktemp)
trap 'rm -f "$written" "$written.log" "$written.gains" "$written.caption" "$written.claims" "$written.readme"' EXIT
: > "$written.log"
. scripts/claims.sh

# cell PAGE ROW COLUMN [MORE]: of the first table that has both. ROW: the first cells of the line. MORE: so many columns further right.
cell() {
    awk -v row="| $2 |" -v column="$3" -v more="${4:-0}" -F '|' '
        function trimmed(s) { gsub(/^ +| +$|\*\*/, "", s); return s }
        !/^\|/ { at = 0; header = 1; next }
        header { at = 0; for (i = 2; i < NF; i++) if (trimmed($i) == column && at == 0) at = i; header = 0 }
        at > 0 && index($0, row) == 1 { print trimmed($(at + more)); found = 1; exit }
        END { exit !found }' "docs/$1.md" || echo "docs/$1.md has no '$3' of '$2'" >> "$written.log"
}

# quoted FILE TEXT: the text, if the file has it, across lines of comments, too.
quoted() {
    tr '\n' ' ' < "$1" | sed 's| */// *| |g; s|  *| |g' | grep -qF -- "$2" && printf '%s' "$2" || echo "$1 does not say '$2'" >> "$written.log"
}

# commit PAGE: that of the run that wrote it, or what the page says of itself.
commit() {
    found=$(sed -n 's/.*Commit \([0-9a-f]\{7,\}\).*/\1/p' "docs/$1.md" | head -n 1)
    printf '%s' "${found:-not recorded}"
}

# gains ROW: absolute and relative, over MIS and over the best peer; expensive costs, cold caches.
gains() {
    for peer in "MIS balance" "best of 14 peers"; do
        for metric in absolute relative; do
            printf ' %s |' "$(cell report "$1 | expensive" "$peer, $metric")"
        done
    done
}

# cost ROW: nanoseconds with warm and with cold caches.
cost() {
    printf '%s | %s' "$(cell report "$1" warm)" "$(cell report "$1" cold)"
}

# light COLUMN: of the table of light.md for a bilinear client, warm and cold.
light() {
    printf '%s | %s' "$(cell light 'bilinear | wis' "$1, cold" 1)" "$(cell light 'bilinear | wis' "$1, cold")"
}

map() {
    printf '| %s | %s | %s | %s |\n' "$1" "$(cell light "$1" bytes)" "$(cell light "$1" 'scratch bytes')" "$(cell light "$1" 'build, f32 RGB')"
}

budget() {
    printf '| %s | %s | %s | %s | %s |\n' "$1" "$(cell light "sky | $1" bytes)" "$(cell light "sky | $1" measured)" \
        "$(cell light "room | $1" bytes)" "$(cell light "room | $1" measured)"
}

of_picture() {
    printf '| %s |' "$1"
    for metric in relative absolute; do
        for count in 2 4 8 16; do
            printf ' %s |' "$(cell gallery "$1 | $metric" "$count samples")"
        done
    done
    echo
}

# Rows that a report of before the target was measured does not have.
target='the same, handed over as a target | `wis_direct`, `target`'
has_target() { grep -qF "| $target |" docs/report.md; }
target_gains() { ! has_target || printf '\n| the same BRDFs as `target` | `wis_direct` |%s' "$(gains "$target")"; }
target_of_report() { ! has_target || printf '\n%s' "$(of_report "$target" 'the same, handed over as `target`')"; }
target_cheap() {
    ! has_target || printf ': then %s absolute, %s relative' "$(cell report "$target | cheap" 'MIS balance, absolute')" \
        "$(cell report "$target | cheap" 'MIS balance, relative')"
}

cat > "$written" <<END
# What it costs and what it gains

**Start with \`wis_direct\`, one to four rays at a hit.** Gains are those of variance at equal time: above 1x, wis has the lower variance.
They hold for cold caches and for expensive rays and BRDFs. An evaluation of BRDF and radiance then costs 150 ns more, and a ray 500 ns more.

| your renderer | call | over MIS, absolute | over MIS, relative | over the best of 14 peers, absolute | over the best of 14 peers, relative |
| --- | --- | --- | --- | --- | --- |
| one shadow ray at a hit | \`wis_direct\` |$(gains 'one shadow ray per hit | `wis_direct`')
| 4 rays at a hit | \`wis_direct\` |$(gains '4 rays per hit | `wis_direct`')
| 16 rays at a hit | \`wis_direct\` |$(gains '16 rays per hit | `wis_direct`')
| 64 hits in a pixel | \`wis_direct\`, \`hits_per_pixel\` |$(gains '64 hits per pixel | `wis_direct`, `hits_per_pixel`')
| the same with textures | \`wis_direct\`, \`hits_per_pixel\` |$(gains 'the same, textured | `wis_direct`, `hits_per_pixel`')
| needs densities for MIS of its own, 16 samples | \`wis_product_prepare\`, \`wis_sample\`, \`wis_pdf\` |$(gains 'needs densities for its own MIS, 16 samples | `wis_product_prepare`, `wis_sample`, `wis_pdf`')
| an unclipped sun, 4 rays | \`wis_direct\` |$(gains 'an unclipped sun, 4 rays | `wis_direct`')
| a room with one window, 4 rays | \`wis_direct\` |$(gains 'a room with one window, 4 rays | `wis_direct`')
| measured BRDFs that no lobe describes, 4 rays | \`wis_direct\` |$(gains 'measured BRDFs that no lobe describes, 4 rays | `wis_direct`')$(target_gains)

From [report.md](report.md), which also has cheap costs and warm caches. Six whole pictures at equal time, with their losses: [gallery.md](gallery.md).
A path tracer has a page of its own: [pathtracer.md](pathtracer.md). In Mitsuba 3, against its own MIS: [renderers.md](renderers.md).

## What a call costs

| call | ns, warm caches | ns, cold caches | page |
| --- | --- | --- | --- |
| \`wis_direct\`, one ray of 16 candidates | $(cost 'direct: one ray, 16 candidates') | [report](report.md) |
| \`wis_direct\`, a candidate of 64 rays x 4 | $(cost 'direct: a candidate of 64 rays x 4') | [report](report.md) |
| \`wis_product_prepare\`, Lambert | $(cost 'prepare a product, Lambert') | [report](report.md) |
| \`wis_product_prepare\`, GGX 0.2 | $(cost 'prepare a product, GGX 0.2') | [report](report.md) |
| \`wis_sample\` of a product, one of 64 in a call | $(cost 'product of GGX 0.2: sample in 64') | [report](report.md) |
| \`wis_sample\` of a product, alone | $(cost 'product of GGX 0.2: sample alone') | [report](report.md) |
| \`wis_pdf\` of a product, one of 64 in a call | $(cost 'product of GGX 0.2: pdf in 64') | [report](report.md) |
| \`wis_pdf\` of a product, alone | $(cost 'product of GGX 0.2: pdf alone') | [report](report.md) |
| \`wis_sample\` of the light, one of 64 in a call | $(light 'sample in 64') | [light](light.md) |
| \`wis_sample\` of the light, alone | $(light 'sample alone') | [light](light.md) |
| \`wis_pdf\` of the light, one of 64 in a call | $(light 'pdf in 64') | [light](light.md) |
| \`wis_pdf\` of the light, alone | $(light 'pdf alone') | [light](light.md) |

- Four rays and more of wide lobes come from a product: the cost of a product, and of a sample for each ray.
- A batch of 64 costs a fraction of 64 calls. Hand over all numbers of a hit at once.
- Other lobes, batches of 8 and version 0.1 beside them: [sampler.md](sampler.md).

## Memory

An environment for a bilinear client with noise in every texel, the worst case. Scratch memory is needed during the build only.

| map | bytes | scratch bytes | build on one core, ms |
| --- | --- | --- | --- |
$(map '512 x 256')
$(map '1024 x 512')
$(map '2048 x 1024')
$(map '4096 x 2048')
$(map '8192 x 4096')

From [light.md](light.md). \`WIS_ENVIRONMENT_LIGHT_ONLY\` takes $(quoted include/wis.h '21 kB less'), and then has no products.

| object | bytes | page |
| --- | --- | --- |
| a sampler, one for each thread | $(quoted include/wis.h '11 kB for 16 rays, 3 kB for three, 2 kB for one or two') | [wis.h](../include/wis.h) |
| the same with shared products (\`hits_per_pixel\` of 16 and more) | $(quoted include/wis.h '15 kB more') | [wis.h](../include/wis.h) |
| a product | $(cell report 'bytes that a product asks for' measured) | [report](report.md) |
| a visibility cache | $(quoted include/wis.h '1152 each'), for each place | [wis.h](../include/wis.h) |

## Error budgets

\`error_budget\` lets the build merge texels. The number is the relative standard deviation of radiance / pdf that this may add. Estimates stay
unbiased; only their variance grows, by about the square of the number.

| budget | sky: bytes | sky: measured | room: bytes | room: measured |
| --- | --- | --- | --- | --- |
$(budget 0)
$(budget 0.003)
$(budget 0.01)
$(budget 0.03)
$(budget 0.1)

From [light.md](light.md), for maps of 1024 x 512 without what products read. Smooth skies gain most; 0.01 is a good start for them.

## Threads

- An environment does not change once it is built. Any number of threads may read it, with a sampler each.
- \`wis_environment_begin\`, \`wis_environment_run\` and \`wis_environment_finish\` spread the build over your threads. The bytes do not depend on their number.
- \`seed\` and \`sample\` decide the random numbers, so an image does not depend on the order of pixels. Tests of both: [trust.md](trust.md).

## Cold caches

A renderer touches much memory between two hits, so expect the cold column.

- A sample of the light $(quoted docs/light.md 'reads 8 cache lines for a bilinear client').
- The very first sample after everything was touched takes $(cell light 'bilinear | wis' 'first sample') ns, and the first pdf $(cell light 'bilinear | wis' 'first pdf') ns ([light.md](light.md)).
- Work on many hits one after another: \`wis_direct_wave\`, or a loop over a queue of hits. The tables and the code then stay warm.
- A smaller environment has fewer cold lines. An error budget is the way to it.

## How many rays and candidates

1. **One to four rays at a hit, and more hits.** More rays from one hit save its preparation, but they meet the same shadow. See the table below.
2. **Candidates: leave \`candidates_per_ray\` at 0** where a ray costs half a microsecond and more; set 4 where rays are cheaper and pixels
   have many, as [gallery.md](gallery.md) does. At 0 the library takes $(quoted include/wis.h '4 to 32 for each at about 50 ns'). More of them pay where a ray costs
   several microseconds.
3. **Wide lobes** (0.25 and more) and four rays or more: $(quoted include/wis.h 'samples of a product instead'), which needs no setting.
4. **Rendering in passes, where most light is blocked:** give the point a visibility cache. In the penumbra of a room with one window the
   variance is then $(cell passes 'room | penumbra | all points' expensive) lower at equal time. Outdoors it is $(cell passes 'spot | penumbra | all points' expensive) there, and $(cell passes 'spot | lit | all points' expensive) where all light is visible
   ([passes.md](passes.md), [gallery.md](gallery.md)).
5. **16 hits or more of a pixel, one after the other:** \`hits_per_pixel\` and \`wis_sampler_begin_pixel\`. First hits then share products.

Error of MIS over that of \`wis_direct\` at equal time, by samples at a hit ([gallery.md](gallery.md)):

| picture | relative, 2 | relative, 4 | relative, 8 | relative, 16 | absolute, 2 | absolute, 4 | absolute, 8 | absolute, 16 |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
$(of_picture spot)
$(of_picture teapot)
$(of_picture bunny)
$(of_picture dragon)
$(of_picture buddha)
$(of_picture room)

## When wis does not help

- **Most of the map is blocked.** wis does not know visibility. In a room with one window its gain over MIS is $(cell report 'a room with one window, 4 rays | `wis_direct` | cheap' 'MIS balance, absolute') absolute and
  $(cell report 'a room with one window, 4 rays | `wis_direct` | cheap' 'MIS balance, relative') relative with cheap rays. A visibility cache helps; portals of the renderer help more.
- **Rays and BRDFs are nearly free.** A sample of \`wis_direct\` costs more than one of MIS. Where a shadow ray takes less than a microsecond,
  diffuse surfaces under a smooth sky gain nothing.
- **Dark shadows of one bright lamp, judged by relative error.** Rays go to the lamp, and few are left for the rest of the sky.
- **BRDFs that no lobe resembles.** Gain over MIS: $(cell report 'measured BRDFs that no lobe describes, 4 rays | `wis_direct` | cheap' 'MIS balance, absolute') absolute, $(cell report 'measured BRDFs that no lobe describes, 4 rays | `wis_direct` | cheap' 'MIS balance, relative') relative. Hand your BRDF in as \`target\`$(target_cheap).
- **You already resample, or know the best technique for each material.** Against the best of 14 peers of each cell, wis is mostly level or behind.
  [report.md](report.md) begins with that table, and lists the largest losses.

## Where the numbers come from

| page | written by | commit of the library |
| --- | --- | --- |
| [report.md](report.md) | \`make report\` | $(commit report) |
| [light.md](light.md) | \`make light\` | $(commit light) |
| [gallery.md](gallery.md) | \`make gallery PAGE=1\` | $(commit gallery) |
| [passes.md](passes.md) | \`make passes\` | $(commit passes) |

\`make performance\` writes this page from those, and \`make check-pages\` says whether it is older than they are. Claims of version 0.1 beside
today's: [claims.md](claims.md).
END

# of_report ROW WORDS: a line of the README's table.
of_report() {
    printf '| %s | %s | %s |\n' "$2" "$(cell report "$1 | expensive" 'MIS balance, absolute')" "$(cell report "$1 | expensive" 'MIS balance, relative')"
}

cat > "$written.gains" <<END
| your renderer | absolute error: bright pixels count most | relative error: all pixels count alike |
| --- | --- | --- |
$(of_report 'one shadow ray per hit | `wis_direct`' 'traces one shadow ray at a hit')
$(of_report '4 rays per hit | `wis_direct`' 'traces 4 rays at a hit')
$(of_report '64 hits per pixel | `wis_direct`, `hits_per_pixel`' 'has 64 hits in a pixel')
$(of_report 'a room with one window, 4 rays | `wis_direct`' 'shows a room with one window, 4 rays')
$(of_report 'measured BRDFs that no lobe describes, 4 rays | `wis_direct`' 'has measured BRDFs that no lobe describes, 4 rays')$(target_of_report)

With cheap rays, set \`candidates_per_ray\` to 4: the default takes too long for them. In [six pictures](docs/gallery.md) wis then has the lower
absolute error in $(cell gallery 'MIS | absolute MSE' 'pictures that wis_direct wins'), and the lower relative error in $(cell gallery 'MIS | relative MSE' 'pictures that wis_direct wins').
END

# of_crop PICTURE: errors of MIS over those of wis_direct.
of_crop() {
    printf '%s: %s relative, %s absolute' "$(echo "$1" | sed 's/^./\U&/')" "$(cell gallery "$1" 'relative MSE, MIS / direct')" "$(cell gallery "$1" 'absolute MSE, MIS / direct')"
}
cat > "$written.caption" <<END
*Equal time, cheap rays: MIS to the left, wis to the right. Error of MIS over that of wis in the whole picture: above 1x wis is better.
$(of_crop teapot). $(of_crop spot).*
END
claims > "$written.claims"

# filled NAME: README.md from standard input, with a text between its marks.
filled() {
    awk -v name="$1" -v text="$written.$1" '
        $0 == "<!-- end of " name " -->" { inside = 0 }
        !inside { print }
        index($0, "<!-- " name ": ") == 1 { inside = 1; while ((getline line < text) > 0) print line }'
}
filled gains < README.md | filled caption > "$written.readme"

if [ -s "$written.log" ]; then
    sed 's/^/performance-page: /' "$written.log" >&2
    exit 1
fi
if [ "${1:-}" != --check ]; then
    cat "$written" > docs/performance.md
    cat "$written.claims" > docs/claims.md
    cat "$written.readme" > README.md
elif cmp -s "$written" docs/performance.md && cmp -s "$written.claims" docs/claims.md && cmp -s "$written.readme" README.md; then
    echo "ok    docs/performance.md, docs/claims.md and what README.md takes from pages"
else
    echo "stale docs/performance.md, docs/claims.md or what README.md takes from pages: make performance"
    exit 1
fi
