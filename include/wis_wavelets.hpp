// wis_wavelets.h and wis_lights.h for C++11: classes that own the memory of trees, maps of visibility and lists of lights. Conventions are those of wis.hpp.
// SPDX-License-Identifier: MIT OR Apache-2.0
#ifndef WIS_WAVELETS_HPP
#define WIS_WAVELETS_HPP

#include "wis.hpp"
#include "wis_lights.h"
#include "wis_wavelets.h"

namespace wis {

/// A lat-long map as directional lights (structured importance sampling).
class lights {
public:
    /// WIS_MEMORY_TOO_SMALL if the heap is exhausted.
    status init(const wis_environment_config &map, const wis_strata_config &config,
                wis_diagnostic *diagnostic = nullptr) {
        count_ = 0;
        wis_memory_size need;
        const status measured = wis_strata_size(&map, &config, &need, diagnostic);
        if (measured != WIS_OK) return pass(measured);
        memory scratch;
        if (!memory_.reserve(need.bytes, need.align) || !scratch.reserve(need.scratch_bytes, need.align))
            return pass(WIS_MEMORY_TOO_SMALL);
        return pass(wis_strata_lights(&map, &config, scratch.data(), need.scratch_bytes,
                                      static_cast<wis_light *>(memory_.data()), &count_.value, nullptr, diagnostic));
    }
    std::uint32_t size() const noexcept { return count_; }
    const wis_light *begin() const noexcept { return static_cast<const wis_light *>(memory_.data()); }
    const wis_light *end() const noexcept { return begin() + count_; }

private:
    memory memory_;
    moving<std::uint32_t> count_;
};

namespace wavelets {

/// A function on the unit cube as a tree, and its memory. Const once built: threads may share it.
class tree {
public:
    /// Of any source; no tree that it is made of is this one. WIS_MEMORY_TOO_SMALL if the heap is exhausted.
    status init(const wis_tree_config &config, wis_diagnostic *diagnostic = nullptr) {
        handle_ = nullptr;
        wis_memory_size need;
        const status measured = wis_tree_size(&config, &need, diagnostic);
        if (measured != WIS_OK) return pass(measured);
        memory scratch;
        if (!memory_.reserve(need.bytes, need.align) || !scratch.reserve(need.scratch_bytes, need.align))
            return pass(WIS_MEMORY_TOO_SMALL);
        return pass(wis_tree_init(&config, memory_.data(), memory_.bytes(), scratch.data(), scratch.bytes(),
                                  &handle_.value, &info_, diagnostic));
    }
    /// What was built, with its average.
    const wis_tree_info &info() const noexcept { return info_; }
    const wis_tree *get() const noexcept { return handle_; }

    /// As many numbers in `u` and `point` as the tree has axes.
    status sample(const float *u, float *point, float &pdf) const {
        return pass(wis_tree_sample(handle_, u, point, &pdf));
    }
    status pdf(const float *point, float &out) const { return pass(wis_tree_pdf(handle_, point, &out)); }
    status invert(const float *point, float *u) const { return pass(wis_tree_invert(handle_, point, u)); }
    /// Samples in place: `count` points and their numbers, permuted alike.
    status warp(float *points, std::uint32_t *index, std::size_t count) const {
        return pass(wis_warp_in_place(handle_, points, index, count, nullptr));
    }
    /// The integral of the product with another tree.
    status product_integral(const tree &other, double &out) const {
        return pass(wis_tree_product_integral(handle_, other.get(), &out));
    }

private:
    memory memory_;
    wis_tree_info info_ = sized<wis_tree_info>();
    moving<const wis_tree *> handle_;
};

/// Visibility in 8 bits, and its memory. Const once built: threads may share it.
class visibility {
public:
    /// WIS_MEMORY_TOO_SMALL if the heap is exhausted.
    status init(const tree &seen, wis_diagnostic *diagnostic = nullptr) {
        handle_ = nullptr;
        wis_memory_size need;
        const status measured = wis_visibility_size(seen.get(), &need, diagnostic);
        if (measured != WIS_OK) return pass(measured);
        if (!memory_.reserve(need.bytes, need.align)) return pass(WIS_MEMORY_TOO_SMALL);
        return pass(wis_visibility_init(seen.get(), memory_.data(), memory_.bytes(), &handle_.value, diagnostic));
    }
    const wis_visibility *get() const noexcept { return handle_; }

    /// The integral of what is seen of a function.
    status product_integral(const tree &function, double &out) const {
        return pass(wis_visibility_product_integral(function.get(), handle_, &out));
    }

private:
    memory memory_;
    moving<const wis_visibility *> handle_;
};

} // namespace wavelets
} // namespace wis

#endif
