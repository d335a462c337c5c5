// wis for C++11: wis.h with classes that own the memory of environments, samplers, products and
// caches of visibility.
// SPDX-License-Identifier: MIT OR Apache-2.0
//
// Calls that make something answer a result, which holds a value or a status; all others answer the status of the C call, which
// wis.h documents. Nothing throws, unless WIS_HPP_THROW is defined before this file is included: then a status other than WIS_OK
// is thrown as wis::error. Materials, points, waves and rays are the plain structs of wis.h; sized<wis_point>() begins
// one. The wrapper of wis_lights.h and wis_wavelets.h is wis_wavelets.hpp.
#ifndef WIS_HPP
#define WIS_HPP

#include "wis.h"

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <utility>
#ifdef WIS_HPP_THROW
#include <stdexcept>
#endif

namespace wis {

using status = wis_status;

#ifdef WIS_HPP_THROW
class error : public std::runtime_error {
public:
    explicit error(wis_status answer) : std::runtime_error(wis_status_string(answer)), code(answer) {}
    const wis_status code;
};
inline status pass(status answer) {
    if (answer != WIS_OK) throw error(answer);
    return answer;
}
#else
inline status pass(status answer) noexcept { return answer; }
#endif

/// A value, or the status that tells why there is none: `if (!made) log(wis::message(made.code()));`.
template <class T> class result {
public:
    result(T &&value) : value_(std::move(value)), code_(WIS_OK) {}
    result(const T &value) : value_(value), code_(WIS_OK) {}
    result(status code) : value_(), code_(pass(code)) {}
    explicit operator bool() const noexcept { return code_ == WIS_OK; }
    status code() const noexcept { return code_; }
    /// Of a result without a value: an empty T.
    T &operator*() noexcept { return value_; }
    const T &operator*() const noexcept { return value_; }
    T *operator->() noexcept { return &value_; }
    const T *operator->() const noexcept { return &value_; }

private:
    T value_;
    status code_;
};

/// A sentence for a log.
inline const char *message(status code) noexcept { return wis_status_string(static_cast<std::uint32_t>(code)); }
/// WIS_VERSION of the library that is linked.
inline std::uint32_t version() noexcept { return wis_version(); }

/// A struct that begins with its size, with every other field 0.
template <class T> T sized() noexcept {
    T value = T();
    value.size = static_cast<std::uint32_t>(sizeof(T));
    return value;
}

/// A plain value that goes along when its object is moved: what stays behind is null or 0.
template <class T> class moving {
public:
    moving() noexcept : value() {}
    moving(moving &&other) noexcept : value(other.take()) {}
    moving &operator=(moving &&other) noexcept {
        value = other.take();
        return *this;
    }
    moving &operator=(T other) noexcept {
        value = other;
        return *this;
    }
    operator T() const noexcept { return value; }
    T value;

private:
    T take() noexcept {
        const T taken = value;
        value = T();
        return taken;
    }
};

/// Aligned bytes from the heap; none once moved from.
class memory {
public:
    /// False if the heap is exhausted. What was held before is freed.
    bool reserve(std::size_t bytes, std::size_t align) noexcept {
        block_.reset(bytes > SIZE_MAX - align ? nullptr : std::malloc(bytes + align));
        bytes_ = block_ ? bytes : 0;
        data_ = block_.get();
        std::size_t space = bytes_ + align;
        return data_ && std::align(align, bytes_, data_.value, space);
    }
    void *data() const noexcept { return data_; }
    std::size_t bytes() const noexcept { return bytes_; }

private:
    struct release {
        void operator()(void *block) const noexcept { std::free(block); }
    };
    std::unique_ptr<void, release> block_;
    moving<void *> data_;
    moving<std::size_t> bytes_;
};

/// An environment map as a distribution of directions, and its memory. Const once built, but for turn: threads may share it.
class environment {
public:
    /// WIS_MEMORY_TOO_SMALL if the heap is exhausted.
    static result<environment> build(const wis_environment_config &config, wis_diagnostic *diagnostic = nullptr) {
        wis_memory_size need;
        environment built;
        memory scratch;
        const status measured = wis_environment_size(&config, &need, diagnostic);
        if (measured != WIS_OK) return measured;
        if (!built.memory_.reserve(need.bytes, need.align) || !scratch.reserve(need.scratch_bytes, need.align))
            return WIS_MEMORY_TOO_SMALL;
        const status done = wis_environment_init(&config, built.memory_.data(), need.bytes, scratch.data(),
                                                 need.scratch_bytes, &built.handle_.value, diagnostic);
        if (done != WIS_OK) return done;
        return result<environment>(std::move(built));
    }
    /// A copy of bytes that an earlier build wrote. For bytes that stay where they are, see opened.
    static result<environment> copy(const void *bytes, std::size_t count, wis_diagnostic *diagnostic = nullptr) {
        environment copied;
        if (!copied.memory_.reserve(count, WIS_ALIGNMENT)) return WIS_MEMORY_TOO_SMALL;
        if (count != 0) std::memcpy(copied.memory_.data(), bytes, count);
        const status done = wis_environment_open(copied.memory_.data(), count, &copied.handle_.value, diagnostic);
        if (done != WIS_OK) return done;
        return result<environment>(std::move(copied));
    }
    /// The handle of bytes that stay yours, such as a mapped file.
    static result<const wis_environment *> opened(const void *bytes, std::size_t count,
                                                  wis_diagnostic *diagnostic = nullptr) {
        const wis_environment *handle = nullptr;
        const status done = wis_environment_open(bytes, count, &handle, diagnostic);
        if (done != WIS_OK) return done;
        return handle;
    }
    const wis_environment *get() const noexcept { return handle_; }
    operator const wis_environment *() const noexcept { return handle_; }
    /// What was built; its `bytes` behind get() are all that needs to be saved.
    result<wis_environment_info> describe() const {
        wis_environment_info info = sized<wis_environment_info>();
        const status done = wis_environment_describe(handle_, &info);
        if (done != WIS_OK) return done;
        return info;
    }
    /// The part of a radiance that BSDF rays bring where points have WIS_POINT_COMPENSATED.
    float base(const float *radiance) const noexcept {
        float base = 1;
        wis_base(handle_, radiance, &base);
        return base;
    }
    /// Another rotation, in place; null is the identity.
    status turn(const float *world_from_map, wis_diagnostic *diagnostic = nullptr) {
        return pass(wis_environment_turn(memory_.data(), memory_.bytes(), world_from_map, &handle_.value, diagnostic));
    }

private:
    friend class environment_build;
    memory memory_;
    moving<const wis_environment *> handle_;
};

/// A build that threads share: begin, then the items of all WIS_ENVIRONMENT_PASSES passes in turn, then finish.
class environment_build {
public:
    /// What `config` points to must stay until finish.
    status begin(const wis_environment_config &config, wis_diagnostic *diagnostic = nullptr) {
        wis_memory_size need;
        config_ = config;
        const status measured = wis_environment_size(&config_, &need, diagnostic);
        if (measured != WIS_OK) return pass(measured);
        if (!built_.memory_.reserve(need.bytes, need.align) || !scratch_.reserve(need.scratch_bytes, need.align))
            return pass(WIS_MEMORY_TOO_SMALL);
        return pass(wis_environment_begin(&config_, scratch_.data(), scratch_.bytes(), items_, diagnostic));
    }
    /// How many items a pass has.
    std::uint32_t items(std::uint32_t pass) const noexcept { return pass < WIS_ENVIRONMENT_PASSES ? items_[pass] : 0; }
    /// Works on some items of a pass. Threads may call this at once for different items.
    status run(std::uint32_t number, std::uint32_t first, std::uint32_t count, wis_diagnostic *diagnostic = nullptr) {
        const bool writes = number >= 2;
        return pass(wis_environment_run(&config_, writes ? built_.memory_.data() : nullptr,
                                        writes ? built_.memory_.bytes() : 0, scratch_.data(), scratch_.bytes(), number,
                                        first, count, diagnostic));
    }
    result<environment> finish(wis_diagnostic *diagnostic = nullptr) {
        const status done = wis_environment_finish(&config_, built_.memory_.data(), built_.memory_.bytes(), scratch_.data(),
                                                   scratch_.bytes(), &built_.handle_.value, diagnostic);
        if (done != WIS_OK) return done;
        return result<environment>(std::move(built_));
    }

private:
    wis_environment_config config_ = wis_environment_config();
    std::uint32_t items_[WIS_ENVIRONMENT_PASSES] = {};
    memory scratch_;
    environment built_;
};

/// The shapes of up to four lobes.
inline result<wis_material> make_material(const wis_lobe *lobes, std::uint32_t count, wis_diagnostic *diagnostic = nullptr) {
    wis_material made = sized<wis_material>();
    made.lobe_count = count;
    for (std::uint32_t i = 0; i < count && i < WIS_MAX_LOBES; i++) made.lobe[i] = lobes[i];
    const status done = wis_material_init(&made, diagnostic);
    if (done != WIS_OK) return done;
    return made;
}

/// One thread's working memory.
class sampler {
public:
    static result<sampler> make(const wis_sampler_config &config = sized<wis_sampler_config>(),
                                wis_diagnostic *diagnostic = nullptr) {
        wis_memory_size need;
        sampler made;
        const status measured = wis_sampler_size(&config, &need, diagnostic);
        if (measured != WIS_OK) return measured;
        if (!made.memory_.reserve(need.bytes, need.align)) return WIS_MEMORY_TOO_SMALL;
        const status done = wis_sampler_init(&config, made.memory_.data(), need.bytes, &made.handle_.value, diagnostic);
        if (done != WIS_OK) return done;
        return result<sampler>(std::move(made));
    }
    wis_sampler *get() const noexcept { return handle_; }
    operator wis_sampler *() const noexcept { return handle_; }
    /// Where the last call that failed was at fault.
    result<wis_diagnostic> fault() const {
        wis_diagnostic where = wis_diagnostic();
        const status done = wis_sampler_fault(handle_, &where);
        if (done != WIS_OK) return done;
        return where;
    }
    status begin_pixel() { return pass(wis_sampler_begin_pixel(handle_)); }

    /// The rays to trace at a point: how many there are of at most `rays`.
    result<std::uint32_t> direct(const wis_environment *light, const wis_point &point, std::uint32_t rays, wis_ray *ray) {
        std::uint32_t count = 0;
        const status done = wis_direct(handle_, light, &point, rays, ray, &count);
        if (done != WIS_OK) return done;
        return count;
    }
    /// The rays of `count` points.
    status direct_wave(const wis_environment *light, std::size_t count, const wis_wave &wave) {
        return pass(wis_direct_wave(handle_, light, count, &wave));
    }

    /// Many elements of the density of a product, or with null, of the light; strides in bytes, 0: packed.
    status sample(const wis_environment *light, const wis_product *product, std::size_t count, const float *u,
                  wis_drawn *drawn, std::size_t u_stride = 0, std::size_t drawn_stride = 0) {
        return pass(wis_sample(handle_, light, product, count, u, u_stride, drawn, drawn_stride));
    }
    status pdf(const wis_environment *light, const wis_product *product, std::size_t count, const float *wi, float *pdf,
               std::size_t wi_stride = 0, std::size_t pdf_stride = 0) {
        return pass(wis_pdf(handle_, light, product, count, wi, wi_stride, pdf, pdf_stride));
    }
    status invert(const wis_environment *light, const wis_product *product, std::size_t count, const float *wi, float *u,
                  std::uint8_t *statuses, std::size_t wi_stride = 0, std::size_t u_stride = 0) {
        return pass(wis_invert(handle_, light, product, count, wi, wi_stride, u, u_stride, statuses));
    }
    /// One element.
    result<wis_drawn> sample(const wis_environment *light, const wis_product *product, const float (&u)[2]) {
        wis_drawn drawn = wis_drawn();
        const status done = wis_sample(handle_, light, product, 1, u, 0, &drawn, 0);
        if (done != WIS_OK) return done;
        return drawn;
    }
    result<float> pdf(const wis_environment *light, const wis_product *product, const float (&wi)[3]) {
        float density = 0.0f;
        const status done = wis_pdf(handle_, light, product, 1, wi, 0, &density, 0);
        if (done != WIS_OK) return done;
        return density;
    }
    /// WIS_ZERO_DENSITY or WIS_UNREACHABLE where no u leads to `wi`.
    status invert(const wis_environment *light, const wis_product *product, const float (&wi)[3], float (&u)[2]) {
        std::uint8_t element = WIS_OK;
        const status done = wis_invert(handle_, light, product, 1, wi, 0, u, 0, &element);
        return pass(done != WIS_OK ? done : static_cast<status>(element));
    }

    /// Compares your radiance with the light and names the likely mistake. `radiance(wi, rgb)` writes three floats for a world
    /// direction of three.
    template <class Radiance> result<wis_check_info> check(const wis_environment *light, Radiance radiance) {
        wis_check_config config = sized<wis_check_config>();
        config.radiance = [](void *user, std::size_t count, const float *wi, float *rgb) {
            for (std::size_t i = 0; i < count; i++) (*static_cast<Radiance *>(user))(wi + 3 * i, rgb + 3 * i);
            return 0;
        };
        config.radiance_user = &radiance;
        wis_check_info info = sized<wis_check_info>();
        const status done = wis_check(handle_, light, &config, &info);
        if (done != WIS_OK) return done;
        return info;
    }

    /// Compares your BSDF with the lobes of a point and names the likely mistake. `f_cos(wi)` answers the luminance of BSDF x |cosine|
    /// for a world direction of three; `target` of the point is not read.
    template <class FCos> result<wis_point_verdict> check_point(const wis_environment *light, wis_point point, FCos f_cos) {
        point.target = [](void *user, std::size_t count, const float *wi, float *values) {
            for (std::size_t i = 0; i < count; i++) values[i] = (*static_cast<FCos *>(user))(wi + 3 * i);
            return 0;
        };
        point.target_user = &f_cos;
        wis_point_verdict verdict = sized<wis_point_verdict>();
        const status done = wis_check_point(handle_, light, &point, &verdict);
        if (done != WIS_OK) return done;
        return verdict;
    }

private:
    memory memory_;
    moving<wis_sampler *> handle_;
};

/// Products at some points, one behind the other, in memory that is reserved once. One for each thread.
class products {
public:
    /// Room for `most` products.
    static result<products> make(std::size_t most, const wis_product_config &config = sized<wis_product_config>(),
                                 wis_diagnostic *diagnostic = nullptr) {
        wis_memory_size need;
        products made;
        const status measured = wis_product_size(&config, &need, diagnostic);
        if (measured != WIS_OK) return measured;
        if (most > SIZE_MAX / (need.bytes + sizeof(std::size_t))) return WIS_OVERFLOW;
        if (!made.memory_.reserve(most * need.bytes, need.align) ||
            !made.offsets_.reserve(most * sizeof(std::size_t), alignof(std::size_t)))
            return WIS_MEMORY_TOO_SMALL;
        made.config_ = config;
        return result<products>(std::move(made));
    }
    /// Prepares products at `count` points, in place of the former ones.
    status prepare(sampler &with, const wis_environment *light, std::size_t count, const wis_point *points) {
        size_ = 0;
        if (count > offsets_.bytes() / sizeof(std::size_t)) return pass(WIS_MEMORY_TOO_SMALL);
        const status done = wis_product_prepare(with, light, &config_, count, points, memory_.data(), memory_.bytes(),
                                                static_cast<std::size_t *>(offsets_.data()), &bytes_.value);
        if (done == WIS_OK) size_ = count;
        return pass(done);
    }
    std::size_t size() const noexcept { return size_; }
    /// Bytes that are in use, from product 0 on.
    std::size_t bytes() const noexcept { return size_ ? bytes_.value : 0; }
    /// Null if there is none.
    const wis_product *operator[](std::size_t i) const noexcept {
        if (i >= size_) return nullptr;
        const std::size_t offset = static_cast<const std::size_t *>(offsets_.data())[i];
        return reinterpret_cast<const wis_product *>(static_cast<const char *>(memory_.data()) + offset);
    }

private:
    wis_product_config config_ = wis_product_config();
    memory memory_, offsets_;
    moving<std::size_t> size_, bytes_;
};

/// One product in bytes that were stored, valid as long as they are: prepared with WIS_PRODUCT_CHECKSUM in this light.
inline result<const wis_product *> open_product(const wis_environment *light, const void *bytes, std::size_t count,
                                                wis_diagnostic *diagnostic = nullptr) {
    const wis_product *product = nullptr;
    const status done = wis_product_open(light, bytes, count, &product, diagnostic);
    if (done != WIS_OK) return done;
    return product;
}
/// What was prepared.
inline result<wis_product_info> describe(const wis_environment *light, const wis_product *product) {
    wis_product_info info = sized<wis_product_info>();
    const status done = wis_product_describe(light, product, &info);
    if (done != WIS_OK) return done;
    return info;
}
/// Whether a product serves another hit well.
inline result<bool> covers(const wis_product *product, const wis_point &point) {
    std::uint32_t answer = 0;
    const status done = wis_product_covers(product, &point, &answer);
    if (done != WIS_OK) return done;
    return answer == 1;
}

/// What rays saw from places of the scene in earlier passes, and its memory: `point.visibility = cache`.
class visibility_cache {
public:
    static result<visibility_cache> make(std::uint32_t places, wis_diagnostic *diagnostic = nullptr) {
        wis_memory_size need;
        visibility_cache made;
        const status measured = wis_visibility_cache_size(places, &need, diagnostic);
        if (measured != WIS_OK) return measured;
        if (!made.memory_.reserve(need.bytes, need.align)) return WIS_MEMORY_TOO_SMALL;
        const status done =
            wis_visibility_cache_init(places, made.memory_.data(), need.bytes, &made.handle_.value, diagnostic);
        if (done != WIS_OK) return done;
        return result<visibility_cache>(std::move(made));
    }
    wis_visibility_cache *get() const noexcept { return handle_; }
    operator wis_visibility_cache *() const noexcept { return handle_; }
    /// Between passes; no other call may use the cache meanwhile.
    status end_pass() { return pass(wis_visibility_cache_end_pass(handle_)); }

private:
    memory memory_;
    moving<wis_visibility_cache *> handle_;
};

/// Records what rays from a point saw in the cache that the point names; stride in bytes, 0: packed.
inline status record_visibility(const wis_point &point, std::size_t count, const float *wi, const std::uint8_t *reached,
                                std::size_t wi_stride = 0) {
    return pass(wis_visibility_cache_record(&point, count, wi, wi_stride, reached));
}
/// A key for the piece of surface about a position.
inline result<std::uint32_t> visibility_key(const float (&position)[3], const float (&normal)[3], float cell = 0.0f) {
    std::uint32_t key = 0;
    const status done = wis_visibility_key(position, normal, cell, &key);
    if (done != WIS_OK) return done;
    return key;
}

/// Points of an Owen-scrambled Sobol sequence, two numbers each; stride in bytes, 0: packed.
inline status sobol(std::uint32_t seed, std::uint32_t first, std::size_t count, float *out, std::size_t stride = 0) {
    return pass(wis_points_sobol(seed, first, count, out, stride));
}

} // namespace wis

#endif
