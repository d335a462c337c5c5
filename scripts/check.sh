#!/bin/sh
# The loop of a developer: format, lints of the kernel, the repository's own rules, unit and law tests of the renderer's path.
# `make test` runs everything else: wavelets, the boundary, consumers, instruments.
set -eu
cd "$(dirname "$0")/.."
cargo fmt --all --check
cargo clippy --quiet --package wis --lib -- -D warnings

# More than half of the time for fifteen tests of 271: those run in `make test` only.
slow="learnt_visibility_is_unbiased_and_better weights_add_up_to_the_hemisphere no_weight_is_huge
everything_lit_has_a_density the_deviation_stays_within_the_budget a_lobe_that_is_too_narrow other_lights
any_number_of_candidates estimates_are_unbiased contributions_of_phong_are_bounded light_from_elsewhere_is_not_lost
black_beside_light_is_never_returned the_largest_maps_are_built_from_rows threads_write_the_bytes_of_one_call no_wrong_cause_is_named"
skip=""
for name in $slow; do
    grep -rqs "fn $name()" tests || { echo "check: no test is named $name" >&2; exit 1; }
    skip="$skip --skip $name"
done
# The names are split into words on purpose.
# shellcheck disable=SC2086
cargo test --quiet --package wis --test house --test renderer --no-fail-fast -- $skip
