# Sourced by performance-page.sh, whose `cell` and `quoted` it takes: the page of claims of version 0.1 that changed.

# today PAGE CLAIM: what the page measured, and its verdict.
today() {
    printf '%s: %s | [%s](%s.md) |' "$(cell "$1" "$2" verdict)" "$(cell "$1" "$2" measured)" "$1" "$1"
}

# report ROW PEER: the gain in both metrics, with cheap costs and cold caches.
over() {
    printf '%s absolute, %s relative' "$(cell report "$1 | cheap" "$2, absolute")" "$(cell report "$1 | cheap" "$2, relative")"
}

# over_limit LOBE METHOD: variance over that of the limit.
over_limit() {
    cell report "$1" "$2 / limit"
}

# ratio LOBE: the variance of compensated MIS over that of the product.
ratio() {
    echo "$(over_limit "$1" 'MIS compensated') $(over_limit "$1" product)" | awk '{ printf "%.1f", $1 / $2 }'
}

claims() {
    one='one shadow ray per hit | `wis_direct`'
    many='64 rays per hit | `wis_direct`'
    hits='64 hits per pixel | `wis_direct`, `hits_per_pixel`'
    measured='measured BRDFs that no lobe describes, 4 rays | `wis_direct`'
    cat << END
# Claims of version 0.1, and today's

What README.md and the pages said at 4bfe238, the last commit of version 0.1 that changed them, beside what the same pages measure today.
\`make performance\` writes the column "today" from those pages.

Gains are of variance at equal time: above 1x wis is ahead. Version 0.1 measured a client that looks up the nearest texel, with warm caches and
at most ten peers. Today the client is bilinear, caches are cold, and there are 14 peers. Rays and BRDFs are cheap in both.

## The library

| claim | version 0.1 | today | page |
| --- | --- | --- | --- |
| gain over MIS, one ray at a hit | 3.8x to 15x absolute for 1 to 64 rays; relative not claimed | $(over "$one" 'MIS balance') | [report](report.md) |
| gain over MIS, 64 rays at a hit | as above | $(over "$many" 'MIS balance') | [report](report.md) |
| gain over the best peer of each cell, one ray | 0.65x to 1.02x absolute, 0.65x to 0.93x relative, for 1 to 64 rays | $(over "$one" 'best of 14 peers') | [report](report.md) |
| gain over the best peer of each cell, 64 rays | as above | $(over "$many" 'best of 14 peers') | [report](report.md) |
| gain over compensated MIS, 64 hits of a pixel that share products | 12x absolute, 3.7x relative | $(over "$hits" 'MIS compensated') | [report](report.md) |
| measured BRDFs against the best peer | as tables, 16 rays: 2.6x absolute, 1.6x relative | by lobes, 4 rays: $(over "$measured" 'best of 14 peers') | [report](report.md) |
| preparing a product, warm: Lambert | 0.6 us | $(cell report 'prepare a product, Lambert' warm) ns; cold $(cell report 'prepare a product, Lambert' cold) ns | [report](report.md) |
| preparing a product, warm: GGX 0.5 | 1.5 us | $(cell report 'prepare a product, GGX 0.5' warm) ns; cold $(cell report 'prepare a product, GGX 0.5' cold) ns | [report](report.md) |
| preparing a product, warm: narrow lobes | up to 5.2 us | $(cell report 'prepare a product, GGX 0.05' warm) ns; cold $(cell report 'prepare a product, GGX 0.05' cold) ns | [report](report.md) |
| a sample of a product in a batch, warm | 50 to 90 ns | $(cell report 'product of GGX 0.2: sample in 64' warm) ns; cold $(cell report 'product of GGX 0.2: sample in 64' cold) ns | [report](report.md) |
| a sample of a product alone, warm | 400 ns | $(cell report 'product of GGX 0.2: sample alone' warm) ns; cold $(cell report 'product of GGX 0.2: sample alone' cold) ns | [report](report.md) |
| bytes of a product | 3 to 8 kB | $(cell report 'bytes that a product asks for' measured) | [report](report.md) |
| environment of a 1024 x 512 map | 5.6 MB, compensated 3.1 MB more | $(cell light '1024 x 512' bytes) B | [light](light.md) |
| building it on one core | 500 ms | $(cell light '1024 x 512' 'build, f32 RGB') ms | [light](light.md) |
| a smooth sky with an error budget of 1 %, light alone | 6 kB | $(cell light 'sky | 0.01' bytes) B, error $(cell light 'sky | 0.01' measured) | [light](light.md) |
| a bright room with an error budget of 1 % | 121 kB, another room | $(cell light 'room | 0.01' bytes) B, error $(cell light 'room | 0.01' measured) | [light](light.md) |
| gain over resampling with 8 candidates | 1.2x to 2.1x absolute | no longer stated alone: it is one of the 14 peers | [report](report.md) |
| gain over compensated MIS at equal numbers of samples, Lambert | 3x | $(ratio Lambert)x, 16 samples | [report](report.md) |
| the same, GGX 0.2 | 18x | $(ratio 'GGX 0.2')x, 16 samples | [report](report.md) |
| candidates of the product in a pool more than halve the variance of narrow lobes | yes | pools of products are gone; \`wis_direct\` has $(over_limit 'GGX 0.05' 'direct') of the limit, a product $(over_limit 'GGX 0.05' 'product') (GGX 0.05) | [report](report.md) |
| waves of hits, a sample | 80 ns in place of 400 | $(cell report 'product of GGX 0.2: sample in 64' warm) ns in place of $(cell report 'product of GGX 0.2: sample alone' warm) | [report](report.md) |
| a sample and a pdf of the light alone, nearest client, in a batch, warm | 15 and 10 ns | $(cell light 'nearest | wis' 'sample in 64, cold' 1) and $(cell light 'nearest | wis' 'pdf in 64, cold' 1) ns | [light](light.md) |
| error budgets of 1 %: a clear sky with its sun, a forest | 27 kB, 1.4 MB | not measured: the page has a sky and a room | [light](light.md) |
| largest weight of the product, every lobe | not bounded: thousands | $(cell report 'largest f L cos / (p I) of the product, every cell' measured) | [report](report.md) |
| most stack of a call | not claimed; 21 kB | $(cell trust '`wis_wavelet_product_prepare`' 'most bytes') B | [trust](trust.md) |
| .text of a static program that builds a light, calls direct and products | not claimed; 260 kB | $(sed -n 's/^static-minimal *[0-9]* [0-9]* \([0-9]*\)$/\1/p' scripts/check-size.sh) B, with two instruction sets | \`scripts/check-size.sh\` |
| documented answers to hard cases | 229 | $(sed -n 's/^\([0-9]*\) cases, 0 failures\.$/\1/p' docs/hard-cases.md) | [hard-cases](hard-cases.md) |

## The papers

| claim of the paper | verdict of version 0.1 | today | page |
| --- | --- | --- | --- |
| 2003: correlation of visibility falls exponentially | yes: R^2 0.90 to 0.99 | $(today sis-2003 'correlation of visibility falls exponentially with the angle (Fig. 2)')
| 2003: variance in a cone is angle / 3T | no: 0.12 to 0.20 | $(today sis-2003 'the variance in a cone is angle / 3T (Eq. 6)')
| 2003: a glossy buddha takes ten times fewer samples | three times; with GGX | $(today sis-2003 'a glossy buddha takes ten times fewer samples (Figs. 1 and 6)')
| 2003: sampling its BRDF is worse than the map | no: 0.053 against 0.21 | $(today sis-2003 'sampling the BRDF is worse than sampling the map')
| 2003: MIS is not better than structured sampling | not tested | $(today sis-2003 'MIS of map and BRDF cannot be better than structured sampling')
| 2003: sorting needs 4.7 rays in place of 300 | one in three | $(today sis-2003 'sorting needs 4.7 rays a point in place of 300 at the same quality')
| 2003: with indirect light, sorting is three times as fast | no: 44 and 52 us | $(today sis-2003 'with indirect light, sorting is three times as fast (Fig. 8)')
| 2003: fewer lights for small bright regions, on real maps | not tested | $(today sis-2003 'the same on real maps: the metric lies between area and light alone')
| 2004: wavelets are 10 to 30 times faster than pixels | no: pixels win, at 1 % of error | $(today triple-2004 'for reasonable error (5 %) wavelets are 10 to 30 times faster than a simple sum over pixels (Fig. 3)')
| 2004: time is linear in the terms | 0.8th to 0.94th power | $(today triple-2004 'time is linear in the terms (Fig. 3, slope 1)')
| 2004: 0.1 to 1 % of BRDF and light suffice, Phong 64 | 1 % does | $(today triple-2004 '0.1 to 1 % of BRDF and light are very close to a reference, Phong 64 (8.1)')
| 2004: material field of Lambert | not tested | $(today triple-2004 'material field of Lambert, 6 x 8 x 8 directions: share of the wavelets for 99 % accuracy (8.2)')
| 2005: 100 samples of a product in 0.1 ms | yes: 14 us, GGX 0.2 | $(today wis-2005 '100 samples of the product at a point in 0.1 ms (Fig. 1)')
| 2005: 64 Hammersley points are better than 512 random ones | nearly: 128 are | $(today wis-2005 '64 Hammersley points have less variance than 512 random ones (Fig. 6)')
| 2005: measured BRDFs are noise-free with 30 samples | but for the glossiest | $(today wis-2005 'measured BRDFs from diffuse to glossy are practically noise-free with 30 samples (Fig. 8)')
| 2005: a table of 16 x 16 slices in colour fits 300 kB | yes: 53 to 210 kB, with 16 slices | $(today wis-2005 'a table of 16 x 16 slices of 64 x 64 in colour fits 300 kB')
| 2005: a table of 32 x 32 slices in colour fits 5 MB | yes: 0.5 to 2 MB, with 32 slices | $(today wis-2005 'a table of 32 x 32 slices of 128 x 128 in colour fits 5000 kB')
| 2005: reparameterisation makes tables compact | not tested | $(today wis-2005 'reparameterisation about the mirror direction makes tables compact')
| 2005: glossy and diffuse alike with 10 samples | mostly | $(today wis-2005 'glossy materials are handled equally well as diffuse ones with 10 samples (Fig. 12)')
| 2005: 4D products render 2.1 times as fast | 3.5 to 3.9 times | $(today wis-2005 '4D products as a pre-process render 2.1 times as fast (Fig. 11)')
| 2005: and look the same | no: error 0.52 in place of 0.09 | $(today wis-2005 'and look the same (Fig. 11)')
| 2005: rotated maps take hours at most | no: 1.3 and 16.5 s, read as "take hours" | $(today wis-2005 'rotated maps of 64^4 and 128^4 take a couple of hours at most (7)')
END
}
