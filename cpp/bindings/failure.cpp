// SPDX-License-Identifier: Apache-2.0
#include "palpate/failure/failure_maps.hpp"
#include "palpate/failure/guard_effects.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

py::dict failure_map_in_python(const std::string& name, int points) {
    const auto* const wanted = std::find_if(failure_maps.begin(), failure_maps.end(),
                                            [&](const NamedFailureMap& map) { return map.name == name; });
    detail::require(wanted != failure_maps.end(), "there is no failure map '" + name + "'");
    detail::require(points >= 2, "points is " + std::to_string(points) + ", must be at least 2");
    FailureMap map;
    {
        const py::gil_scoped_release unlocked;
        map = wanted->measure(points);
    }
    py::list lines;
    for (FailureLine& line : map.lines) {
        lines.append(py::dict("name"_a = line.name, "at"_a = moved(std::move(line.at)),
                              "measured"_a = moved(std::move(line.measured)),
                              "theory"_a = moved(std::move(line.theory))));
    }
    return py::dict("name"_a = map.name, "along"_a = map.along, "limit"_a = map.limit, "lines"_a = lines,
                    "searched"_a = map.searched, "linear"_a = map.linear);
}

py::list guard_effects_in_python() {
    std::vector<GuardEffect> effects;
    {
        const py::gil_scoped_release unlocked;
        effects = guard_effects();
    }
    py::list rows;
    for (const GuardEffect& effect : effects) {
        rows.append(py::dict("guard"_a = effect.guard, "cost"_a = effect.cost, "wrong"_a = effect.wrong,
                             "without"_a = effect.without, "with"_a = effect.with));
    }
    return rows;
}

}  // namespace

void bind_failure(py::module_& module) {
    py::tuple names(failure_maps.size());
    for (std::size_t k = 0; k < failure_maps.size(); ++k) {
        names[k] = py::str(std::string(failure_maps[k].name));
    }
    module.attr("failure_map_names") = names;
    module.def(
        "failure_map", &failure_map_in_python, "name"_a, "points"_a = 8,
        "Where a method fails: boundaries measured in simulation, and what theory says of them.\n\n"
        "By name: along and limit (what the axes hold, with units) and lines, each with its name and the\n"
        "arrays (points,) at, measured (NaN: none failed) and theory (NaN: nothing is known);\n"
        "searched (up to how many times the theory, where none failed) and linear (the limit spans no "
        "decades).");
    module.def(
        "guard_effects", &guard_effects_in_python,
        "Every guard by itself: its cost where nothing is wrong, and what it makes of what is.\n\n"
        "By row: guard, cost (RMS change of the force over its RMS), wrong (what is wrong, and what of\n"
        "it is measured), without and with the guard.");
}

}  // namespace palpate::bindings
