// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
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
