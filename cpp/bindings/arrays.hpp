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

#include "palpate/fields/field_table.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate::bindings {

/// A numpy array of float64 in contiguous memory, converted from any Python sequence or array of numbers.
using Array = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// Type check for the argument type `ArrayLike`: returns 1, because every Python object is accepted.
inline int any_object(PyObject* /*object*/) {
    return 1;
}

/// A Python argument of any type. numbers() converts it to an Array, so that an error message can name the argument.
class ArrayLike : public pybind11::object {
    PYBIND11_OBJECT_DEFAULT(ArrayLike, pybind11::object, any_object)
};

/// Returns the shape of a numpy array as text for error messages, for example "(3, 2)".
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

/// Throws std::invalid_argument with the name and shape of the array unless the array is one-dimensional.
inline void require_vector(const Array& array, const char* name) {
    if (array.ndim() != 1) {
        throw std::invalid_argument(std::string(name) + " has shape " + shape_of(array) + ", must be (n,)");
    }
}

/// Converts a Python number, sequence or array to an array of float64 in contiguous memory. Throws
/// std::invalid_argument with the name of the argument if it contains other values than real numbers: text, None,
/// complex or masked values.
[[nodiscard]] inline Array numbers(const pybind11::handle& value, const char* name) {
    namespace py = pybind11;
    const auto refuse = [name](const std::string& found) {
        throw std::invalid_argument(std::string(name) + " " + found +
                                    ", must be a number or an array of numbers");
    };
    if (py::isinstance<Array>(value) && !py::hasattr(value, "mask")) {
        return py::reinterpret_borrow<Array>(value);
    }
    if (value.is_none() || py::isinstance<py::str>(value) || py::isinstance<py::dict>(value)) {
        refuse("is " + py::repr(value).cast<std::string>().substr(0, 60));
    }
    if (py::hasattr(value, "mask") &&
        py::module_::import("numpy").attr("ma").attr("is_masked")(value).cast<bool>()) {
        refuse("contains masked values");
    }
    const py::array given = py::array::ensure(value);
    if (!given) {
        PyErr_Clear();
        refuse("is not an array");
    }
    const char kind = given.dtype().kind();
    if (kind == 'O') {
        for (const py::handle each : given.attr("ravel")()) {
            // NumPy would convert a text such as "0.5"
            if (each.is_none() || py::isinstance<py::str>(each) || py::isinstance<py::bytes>(each) ||
                py::isinstance<py::bytearray>(each)) {
                refuse("contains " + py::repr(each).cast<std::string>().substr(0, 60));
            }
        }
    } else if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b') {
        refuse("contains " + py::str(given.dtype()).cast<std::string>());
    }
    const Array array = Array::ensure(given);
    if (!array) {
        PyErr_Clear();
        refuse("contains " + py::str(given.dtype()).cast<std::string>());
    }
    return array;
}

/// Divides the indices from 0 to size - 1 into parts and calls work(first, count) for each part. Many indices are
/// divided among several threads; few indices are not, because starting a thread takes the time of some thousand
/// samples. Call this function without the lock of the Python interpreter.
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
            part(k);  // no new thread could start: this thread does part k of the work
        }
    }
    part(0);
}

/// Returns a numpy array that takes the memory of a vector, without copying the values.
template <class T>
[[nodiscard]] pybind11::array_t<T> moved(std::vector<T>&& values) {
    auto owner = std::make_unique<std::vector<T>>(std::move(values));
    const auto size = static_cast<pybind11::ssize_t>(owner->size());
    T* data = owner->data();
    pybind11::capsule free(owner.release(),
                           [](void* pointer) { delete static_cast<std::vector<T>*>(pointer); });
    return pybind11::array_t<T>(size, data, free);
}

inline void require_period(double period_s) {
    require_field(satisfies(period_s, Rule::Positive), "period_s", period_s, text(Rule::Positive));
}

}  // namespace palpate::bindings

namespace pybind11::detail {

template <>
struct handle_type_name<palpate::bindings::ArrayLike> {
    static constexpr auto name = const_name("typing.Annotated[numpy.typing.ArrayLike, numpy.float64]");
};

}  // namespace pybind11::detail
