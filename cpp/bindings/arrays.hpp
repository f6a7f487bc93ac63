// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

namespace palpate::bindings {

/// Any array-like of numbers, as contiguous float64.
using Array = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

[[nodiscard]] inline std::string shape_of(const pybind11::array& array) {
    std::string text = "(";
    for (pybind11::ssize_t k = 0; k < array.ndim(); ++k) {
        text += (k > 0 ? ", " : "") + std::to_string(array.shape(k));
    }
    return text + (array.ndim() == 1 ? ",)" : ")");
}

[[nodiscard]] inline std::span<const double> view(const Array& array) {
    return {array.data(), static_cast<std::size_t>(array.size())};
}

[[nodiscard]] inline std::vector<double> copied(const Array& array) {
    const auto values = view(array);
    return {values.begin(), values.end()};
}

/// A one-dimensional array, or std::invalid_argument with the shape received.
inline void require_vector(const Array& array, const char* name) {
    if (array.ndim() != 1) {
        throw std::invalid_argument(std::string(name) + " has shape " + shape_of(array) + ", must be (n,)");
    }
}

/// Calls work(first, count) for parts that make up 0..size, on as many processors as that pays for: starting a
/// thread takes as long as some thousand samples. To be called without the interpreter's lock.
template <class Work>
void in_parts(std::size_t size, const Work& work) {
    constexpr std::size_t least = 16'384;
    const std::size_t processors = std::max(1U, std::thread::hardware_concurrency());
    const std::size_t parts = std::clamp<std::size_t>(size / least, 1, processors);
    const auto part = [&](std::size_t k) {
        const std::size_t first = size * k / parts;
        work(first, size * (k + 1) / parts - first);
    };
    std::vector<std::jthread> others;
    others.reserve(parts - 1);
    for (std::size_t k = 1; k < parts; ++k) {
        try {
            others.emplace_back([&part, k] { part(k); });
        } catch (const std::system_error&) {
            part(k);  // no thread to be had
        }
    }
    part(0);
}

/// Hands a vector to numpy without a copy.
template <class T>
[[nodiscard]] pybind11::array_t<T> moved(std::vector<T>&& values) {
    auto owner = std::make_unique<std::vector<T>>(std::move(values));
    const auto size = static_cast<pybind11::ssize_t>(owner->size());
    T* data = owner->data();
    pybind11::capsule free(owner.release(),
                           [](void* pointer) { delete static_cast<std::vector<T>*>(pointer); });
    return pybind11::array_t<T>(size, data, free);
}

}  // namespace palpate::bindings
