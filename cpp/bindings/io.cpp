// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bindings.hpp"
#include "palpate/io/parse_model.hpp"
#include "palpate/io/plan_file.hpp"

#ifdef __linux__
#include "palpate/io/growing_file.hpp"
#endif

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

/// Converts a JSON value to a Python value.
py::object to_python(const Json& value) {
    switch (value.type()) {
        case Json::value_t::object: {
            py::dict items;
            for (const auto& item : value.items()) {
                items[py::str(item.key())] = to_python(item.value());
            }
            return items;
        }
        case Json::value_t::array: {
            py::list items(value.size());
            for (std::size_t k = 0; k < value.size(); ++k) {
                items[k] = to_python(value[k]);
            }
            return items;
        }
        case Json::value_t::string:
            return py::str(value.get_ref<const std::string&>());
        case Json::value_t::boolean:
            return py::bool_(value.get<bool>());
        case Json::value_t::number_integer:
            return py::int_(value.get<std::int64_t>());
        case Json::value_t::number_unsigned:
            return py::int_(value.get<std::uint64_t>());
        case Json::value_t::number_float:
            return py::float_(value.get<double>());
        default:
            return py::none();
    }
}

/// Converts a Python value to a JSON value. An integer of more than 64 bits becomes a double, as when a JSON file is
/// read, or infinity if the integer is too large for a double.
Json to_json(const py::handle& value, int depth = 0) {
    const bool is_object = py::isinstance<py::dict>(value);
    const bool is_list = py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value);
    if ((is_object || is_list) && depth >= deepest_json) {
        throw std::invalid_argument(too_deep());
    }
    if (value.is_none()) {
        return nullptr;
    }
    if (py::isinstance<py::bool_>(value)) {
        return value.cast<bool>();
    }
    if (py::isinstance<py::float_>(value)) {
        return value.cast<double>();
    }
    if (py::isinstance<py::int_>(value)) {
        try {
            return value < py::int_(0) ? Json(value.cast<std::int64_t>()) : Json(value.cast<std::uint64_t>());
        } catch (const py::cast_error&) {
            const double number = PyLong_AsDouble(value.ptr());
            if (PyErr_Occurred() == nullptr) {
                return number;
            }
            PyErr_Clear();
            return std::numeric_limits<double>::infinity();
        }
    }
    if (py::isinstance<py::str>(value)) {
        return value.cast<std::string>();
    }
    if (is_object) {
        if (py::len(value) > most_json_keys) {
            throw std::invalid_argument(too_many_keys());
        }
        Json items = Json::object();
        for (const auto& [key, item] : py::reinterpret_borrow<py::dict>(value)) {
            items[py::str(key).cast<std::string>()] = to_json(item, depth + 1);
        }
        return items;
    }
    if (is_list) {
        Json items = Json::array();
        for (const py::handle& item : py::reinterpret_borrow<py::sequence>(value)) {
            items.push_back(to_json(item, depth + 1));
        }
        return items;
    }
    throw std::invalid_argument("the content has a value of type " +
                                py::str(py::type::of(value).attr("__name__")).cast<std::string>() +
                                ": must be a number, text, list, dict, true, false or null");
}

/// Returns a part of a model file; throws std::invalid_argument if the part is null.
detail::JsonField given(const detail::JsonField& part) {
    part.require_object();
    return part;
}

}  // namespace

void bind_io(py::module_& module) {
    module.attr("largest_json_bytes") = largest_json_bytes;
    module.def(
        "follow_links",
        [](const std::filesystem::path& path) {
#ifdef __linux__
            std::string target;
            if (const std::string reason = palpate::detail::follow_links(path.string(), target);
                !reason.empty()) {
                throw std::invalid_argument{reason};
            }
            return std::filesystem::path{target};
#else
            return std::filesystem::weakly_canonical(path);
#endif
        },
        "path"_a,
        "Returns the file to which a chain of symbolic links leads; the file may be missing. Raises\n"
        "InputError if a link in a folder that all users share belongs to another user.");
    module.def(
        "read_json", [](const std::filesystem::path& path) { return to_python(read_json(path.string())); },
        "path"_a,
        "Returns the content of a JSON file. Raises ValueError with one sentence that begins with the\n"
        "name of the file.");
    module.def(
        "check_model", [](const py::object& content) { (void)parse_model(to_json(content)); }, "content"_a,
        "Checks the content of a model file and computes its certificate again. Raises ValueError with\n"
        "the path of the first wrong field, its value and the correct values.");
    module.def(
        "profile_of",
        [](const py::object& content) {
            const Json stored = to_json(content);
            const auto read = detail::JsonField{stored, ""}.as<DeviceProfile>();
            validate(read);
            return read;
        },
        "content"_a,
        "Returns the device profile in the content of a file. Raises ValueError with the first wrong\n"
        "field, its value and the correct values.");
    module.def(
        "scheme_of",
        [](const py::object& plan) {
            const Json stored = to_json(plan);
            return *detail::read_plan(given({stored, "plan"}));
        },
        "plan"_a,
        "Returns the scheme (structure and its numbers) in the plan of a model file. Raises ValueError\n"
        "with the first wrong field, its value and the correct values.");
    module.def(
        "checked_certificate",
        [](const ForceModel& model, const py::object& plan, const py::object& certificate) {
            const Json scheme = to_json(plan);
            const Json stored = to_json(certificate);
            return *detail::read_certificate(given({stored, "certificate"}),
                                             detail::read_plan(given({scheme, "plan"})), model, "");
        },
        "model"_a, "plan"_a, "certificate"_a,
        "Computes the certificate of a model file again from the rendered model and returns it. Raises\n"
        "ValueError with the field that differs, its value and the correct value.");
}

}  // namespace palpate::bindings
