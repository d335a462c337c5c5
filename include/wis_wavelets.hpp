// wis_wavelets.h and wis_lights.h for C++11: classes that own the memory of octahedral lights, their products, trees, maps of
// visibility and lists of lights. Conventions are those of wis.hpp.
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

/// An environment and its memory. Const once built: threads may share it.
class environment {
public:
    /// WIS_MEMORY_TOO_SMALL if the heap is exhausted.
    status init(const wis_wavelet_light_config &config, wis_diagnostic *diagnostic = nullptr) {
        handle_ = nullptr;
        wis_memory_size need;
        const status measured = wis_wavelet_light_size(&config, &need, diagnostic);
        if (measured != WIS_OK) return pass(measured);
        memory scratch;
        if (!memory_.reserve(need.bytes, need.align) || !scratch.reserve(need.scratch_bytes, need.align))
            return pass(WIS_MEMORY_TOO_SMALL);
        return pass(wis_wavelet_light_init(&config, memory_.data(), need.bytes, scratch.data(), need.scratch_bytes,
                                         &handle_.value, &info_, diagnostic));
    }
    /// What was built.
    const wis_wavelet_light_info &info() const noexcept { return info_; }
    const wis_wavelet_light *get() const noexcept { return handle_; }

    status sample(const float (&u)[2], wis_drawn &out, const float *world_from_map = nullptr) const {
        return pass(wis_wavelet_sample(handle_, nullptr, world_from_map, 1, u, 0, &out, 0));
    }
    status pdf(const float (&wi)[3], float &out, const float *world_from_map = nullptr) const {
        return pass(wis_wavelet_pdf(handle_, nullptr, world_from_map, 1, wi, 0, &out, 0));
    }
    status invert(const float (&wi)[3], float (&u)[2], const float *world_from_map = nullptr) const {
        std::uint8_t found = WIS_OK;
        const status asked = wis_wavelet_invert(handle_, nullptr, world_from_map, 1, wi, 0, u, 0, &found);
        return pass(asked != WIS_OK ? asked : static_cast<status>(found));
    }

private:
    memory memory_;
    wis_wavelet_light_info info_ = sized<wis_wavelet_light_info>();
    moving<const wis_wavelet_light *> handle_;
};

/// The product at one shading point after another, in memory that is reserved once. One for each thread.
class product {
public:
    /// Reserves the memory, and copies the configuration with its matrix, which may go away afterwards; its table and callback
    /// stay where they are. WIS_MEMORY_TOO_SMALL if the heap is exhausted.
    status init(const wis_wavelet_product_config &config, wis_diagnostic *diagnostic = nullptr) {
        handle_ = nullptr;
        config_.size = 0;
        wis_memory_size need;
        const status measured = wis_wavelet_product_size(&config, &need, diagnostic);
        if (measured != WIS_OK) return pass(measured);
        if (!memory_.reserve(need.bytes, need.align)) return pass(WIS_MEMORY_TOO_SMALL);
        config_ = config;
        config_.world_from_map = nullptr;
        turned_ = config.world_from_map != nullptr;
        if (turned_) std::memcpy(matrix_, config.world_from_map, sizeof matrix_);
        return WIS_OK;
    }
    /// What tabulated lobes mean in the preparations to come, or null.
    void set_table(const wis_wavelet_table *table) noexcept { config_.table = table; }
    /// The BRDF in place of lobes in the preparations to come, or null.
    void set_callback(const wis_wavelet_callback *callback) noexcept { config_.callback = callback; }
    /// WIS_NOT_BUILT, here and below, if init was not called, or failed.
    status prepare(const environment &light, const wis_wavelet_query &query, wis_diagnostic *diagnostic = nullptr) {
        handle_ = nullptr;
        if (!is_ready(diagnostic)) return pass(WIS_NOT_BUILT);
        const wis_wavelet_product_config own = config();
        return pass(wis_wavelet_product_prepare(light.get(), &own, 1, &query, memory_.data(), memory_.bytes(),
                                                &handle_.value, diagnostic));
    }
    const wis_wavelet_product *get() const noexcept { return handle_; }

    /// What the product is made of, and the approximation of its integral; set `size` before, as sized does.
    status describe(const environment &light, wis_wavelet_product_info &info) const {
        return pass(wis_wavelet_product_describe(light.get(), handle_, &info));
    }
    status sample(const environment &light, const float (&u)[2], wis_drawn &out) const {
        return pass(wis_wavelet_sample(light.get(), handle_, nullptr, 1, u, 0, &out, 0));
    }
    status pdf(const environment &light, const float (&wi)[3], float &out) const {
        return pass(wis_wavelet_pdf(light.get(), handle_, nullptr, 1, wi, 0, &out, 0));
    }
    status invert(const environment &light, const float (&wi)[3], float (&u)[2]) const {
        std::uint8_t found = WIS_OK;
        const status asked = wis_wavelet_invert(light.get(), handle_, nullptr, 1, wi, 0, u, 0, &found);
        return pass(asked != WIS_OK ? asked : static_cast<status>(found));
    }

private:
    /// Whether init succeeded and the memory was not moved away.
    bool is_ready(wis_diagnostic *diagnostic) const noexcept {
        const bool ready = config_.size != 0 && memory_.data();
        if (!ready && diagnostic) *diagnostic = wis_diagnostic();
        return ready;
    }
    /// The configuration with pointers to what this object keeps, wherever it was moved to.
    wis_wavelet_product_config config() const noexcept {
        wis_wavelet_product_config own = config_;
        if (turned_) own.world_from_map = matrix_;
        return own;
    }
    memory memory_;
    /// Without its matrix.
    wis_wavelet_product_config config_ = wis_wavelet_product_config();
    bool turned_ = false;
    float matrix_[9] = {};
    moving<const wis_wavelet_product *> handle_;
};

/// A function on the unit cube as a tree, and its memory. Const once built: threads may share it.
class tree {
public:
    /// Of any source; no tree that it is made of is this one. WIS_MEMORY_TOO_SMALL if the heap is exhausted.
    status init(const wis_tree_config &config, wis_tree_info *info = nullptr, wis_diagnostic *diagnostic = nullptr) {
        handle_ = nullptr;
        wis_memory_size need;
        const status measured = wis_tree_size(&config, &need, diagnostic);
        if (measured != WIS_OK) return pass(measured);
        memory scratch;
        if (!memory_.reserve(need.bytes, need.align) || !scratch.reserve(need.scratch_bytes, need.align))
            return pass(WIS_MEMORY_TOO_SMALL);
        return pass(wis_tree_init(&config, memory_.data(), memory_.bytes(), scratch.data(), scratch.bytes(),
                                  &handle_.value, info, diagnostic));
    }
    const wis_tree *get() const noexcept { return handle_; }

    status average(double &out) const { return pass(wis_tree_average(handle_, &out)); }
    /// As many numbers in `u` and `point` as the tree has axes.
    status sample(const float *u, float *point, float &pdf) const {
        return pass(wis_tree_sample(handle_, u, point, &pdf));
    }
    status pdf(const float *point, float &out) const { return pass(wis_tree_pdf(handle_, point, &out)); }

private:
    memory memory_;
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
