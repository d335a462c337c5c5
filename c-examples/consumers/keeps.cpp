// What a class of wis_wavelets.hpp was given at init may change or go away afterwards, and objects may be moved.
#include <wis_wavelets.hpp>

#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

#include "scene.hpp"

namespace {

int failures = 0;

void expect(bool holds, const char *what) {
    if (holds) return;
    std::printf("FAILED: %s\n", what);
    failures++;
}

// A tree needs nothing that it was made of, and may be moved.
void trees_stand_alone() {
    wis::wavelets::tree tree;
    float pdf = 0.0f;
    const float point[2] = {0.5f, 0.5f};
    {
        const auto environment = wis::environment::build(map_config(paint()));
        expect(environment && tree.init(tree_config(environment->get())) == WIS_OK, "a tree");
        auto wrong = tree_config(environment->get());
        wrong.depth = 13;
        wis_diagnostic diagnostic = wis_diagnostic();
        wis::wavelets::tree none;
        expect(none.init(wrong, &diagnostic) == WIS_INVALID_ARGUMENT, "an init that fails");
        expect(diagnostic.field && std::strcmp(diagnostic.field, "depth") == 0, "the field at fault");
        expect(none.pdf(point, pdf) != WIS_OK, "nothing is built");
    }
    expect(tree.pdf(point, pdf) == WIS_OK && pdf > 0.0f, "a tree after its light is gone");
    const wis::wavelets::tree moved(std::move(tree));
    float same = 0.0f;
    expect(moved.pdf(point, same) == WIS_OK && same == pdf && tree.get() == nullptr, "a tree that was moved");
}

} // namespace

int main() {
    trees_stand_alone();
    std::puts(failures ? "FAILED" : "what was given is kept");
    return failures ? 1 : 0;
}
