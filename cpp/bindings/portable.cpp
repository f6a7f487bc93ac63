// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "palpate/portable/export_check.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

using Counts = py::array_t<std::int32_t, py::array::c_style>;

void bind_grid(py::module_& module) {
    py::class_<CellGrid>(module, "CellGrid", "Positions of the cells of an exported table.")
        .def_readonly("periodic", &CellGrid::periodic)
        .def_readonly("lower", &CellGrid::lower)
        .def_readonly("upper", &CellGrid::upper)
        .def_readonly("bits", &CellGrid::bits, "Number of the coarse cells as a power of two.")
        .def_readonly("start", &CellGrid::start, "Position of the start of the first coarse cell.")
        .def_readonly("coarse_width", &CellGrid::coarse_width)
        .def_readonly("first_count", &CellGrid::first_count)
        .def_readonly("last_count", &CellGrid::last_count)
        .def_readonly("origin", &CellGrid::origin, "Count with the phase 0.")
        .def_readonly("shift", &CellGrid::shift)
        .def_readonly("phase_lower", &CellGrid::phase_lower)
        .def_readonly("phase_upper", &CellGrid::phase_upper)
        .def_readonly("phase_step", &CellGrid::phase_step)
        .def_readonly("phase_start", &CellGrid::phase_start)
        .def_property_readonly("phase_per_count", &CellGrid::phase_per_count)
        .def("width", &CellGrid::width, "k"_a,
             "Returns the width of a cell of a coarse cell split into 2^k.");
}

void bind_table(py::module_& module) {
    bind_grid(module);
    py::class_<CellTable>(module, "CellTable", "Exported curves as polynomials of degree 5 in cells.")
        .def_property_readonly("grid", &CellTable::grid)
        .def_property_readonly("cells", &CellTable::cells)
        .def_property_readonly("bytes", &CellTable::bytes, "Size of coefficients and splits [bytes].")
        .def_property_readonly("split_bytes", &CellTable::split_bytes)
        .def_property_readonly(
            "splits",
            [](const CellTable& table) { return moved(std::vector<std::uint32_t>(table.splits())); },
            "First cell and, in the lowest four bits, k of each coarse cell, which has 2^k cells.")
        .def_property_readonly(
            "coefficients",
            [](const CellTable& table) {
                return moved(std::vector<double>(table.coefficients()))
                    .reshape({static_cast<py::ssize_t>(table.cells()), py::ssize_t{-1}});
            },
            "Coefficients (cells, 6 for each curve), the lowest power first.")
        .def_property_readonly(
            "integrals",
            [](const CellTable& table) {
                return moved(std::vector<double>(table.integrals()))
                    .reshape({static_cast<py::ssize_t>(table.cells()), py::ssize_t{-1}});
            },
            "First and second antiderivative (cells, 2 for each curve) at the centres of the cells.");
}

void bind_lines(py::module_& module) {
    py::class_<ExportedLine>(module, "ExportedLine", "Straight line of an exported curve outside the domain.")
        .def_readonly("value", &ExportedLine::value)
        .def_readonly("gain", &ExportedLine::gain)
        .def_readonly("slope", &ExportedLine::slope)
        .def_readonly("reach", &ExportedLine::reach)
        .def_readonly("offset", &ExportedLine::offset);
    py::class_<ExportedLag>(module, "ExportedLag", "Numbers of the massless structure.")
        .def_readonly("memory", &ExportedLag::memory)
        .def_readonly("compliance", &ExportedLag::compliance);
    py::class_<ExportedMemory>(module, "ExportedMemory",
                               "Branches of a model with memory. The ratio is in units of force.")
        .def_readonly("stiffness", &ExportedMemory::stiffness)
        .def_readonly("kept", &ExportedMemory::kept,
                      "Share of a stretch that is left after a period at rest.")
        .def_readonly("largest_stretch", &ExportedMemory::largest_stretch)
        .def_readonly("sudden", &ExportedMemory::sudden, "Stiffness for a motion within one period.")
        .def_readonly("contact", &ExportedMemory::contact,
                      "Sign of the force against which the branches do not pull; 0: none.");
    py::class_<EdgeLine>(module, "EdgeLine",
                         "End of the domain, with force, slope and antiderivatives of the line beyond it.")
        .def_readonly("edge", &EdgeLine::edge)
        .def_readonly("reach", &EdgeLine::reach)
        .def_property_readonly("value", [](const EdgeLine& line) { return line.at_edge.value; })
        .def_property_readonly("slope", [](const EdgeLine& line) { return line.at_edge.slope; })
        .def_property_readonly("integral", [](const EdgeLine& line) { return line.at_edge.integral; })
        .def_property_readonly("double_integral",
                               [](const EdgeLine& line) { return line.at_edge.double_integral; });
}

/// Calls `visit` with the evaluator of a model in its precision.
template <class Visit>
auto with_evaluator(const ExportedModel& model, const Visit& visit) {
    return model.single() ? visit(ExportedForce<float>{model}) : visit(ExportedForce<double>{model});
}

/// Returns the forces of a structure that starts at the first count and makes one step for each count.
py::array_t<double> steps(const ExportedModel& model, const Counts& counts) {
    py::array_t<double> forces(counts.size());
    double* out = forces.mutable_data();
    with_evaluator(model, [&](const auto& exported) {
        auto state = exported.start(counts.size() > 0 ? counts.data()[0] : 0);
        for (py::ssize_t k = 0; k < counts.size(); ++k) {
            out[k] = exported.step(state, counts.data()[k]);
        }
    });
    return forces;
}

/// Returns force, slope and energy (3, n) at counts; before each the play operator moves to this count, from its start
/// at the first one.
py::array_t<double> samples(const ExportedModel& model, const Counts& counts) {
    py::array_t<double> values({py::ssize_t{3}, counts.size()});
    const py::ssize_t n = counts.size();
    double* out = values.mutable_data();
    with_evaluator(model, [&](const auto& exported) {
        auto state = exported.start(n > 0 ? counts.data()[0] : 0);
        for (py::ssize_t k = 0; k < n; ++k) {
            const auto sample = exported.force_slope(state, counts.data()[k]);
            out[k] = sample.force;
            out[n + k] = sample.slope;
            out[2 * n + k] = exported.energy(state, counts.data()[k]);
            exported.advance(state, counts.data()[k]);
        }
    });
    return values;
}

void bind_exported_model(py::module_& module) {
    constexpr double none = std::numeric_limits<double>::infinity();
    py::class_<ExportedModel> type(module, "ExportedModel",
                                   "A model and its structure as tables and numbers for a program in C.");
    type.def(
        py::init([](const ForceModel& model, const Scheme& scheme, double encoder_step, double period_s,
                    double force_limit, const std::string& precision) {
            const ExportTarget target{encoder_step, period_s, force_limit,
                                      named<Precision>(precision, "precision")};
            const py::gil_scoped_release unlocked;
            return ExportedModel{model, scheme, target};
        }),
        "model"_a, "scheme"_a, py::kw_only(), "encoder_step"_a, "period_s"_a = 0.0, "force_limit"_a = none,
        "precision"_a = "single",
        "Makes the tables, with proved errors. Raises ValueError with the reason for a model or structure\n"
        "that cannot be exported. `period_s` is needed for the structure massless only.");
    type.def_property_readonly("scheme", &ExportedModel::scheme)
        .def_property_readonly("encoder_step",
                               [](const ExportedModel& model) { return model.target().encoder_step; })
        .def_property_readonly("force_limit",
                               [](const ExportedModel& model) { return model.target().force_limit; })
        .def_property_readonly("single", &ExportedModel::single)
        .def_property_readonly("hysteretic", &ExportedModel::hysteretic)
        .def_property_readonly("massless", &ExportedModel::massless)
        .def_property_readonly("periodic", &ExportedModel::periodic)
        .def_property_readonly("law", &ExportedModel::law, "Table of the force law.")
        .def_property_readonly("response", &ExportedModel::response,
                               "Table of the force on the load line; None without a load line.")
        .def_property_readonly("lines", &ExportedModel::lines,
                               "Lines (below, above) of each curve of the force law.")
        .def_property_readonly("response_lines", &ExportedModel::response_lines)
        .def_property_readonly("lag", &ExportedModel::lag)
        .def_property_readonly("memory", &ExportedModel::memory, "Branches; None without memory.")
        .def_property_readonly(
            "edges",
            [](const ExportedModel& model) {
                std::vector<std::tuple<EdgeLine, EdgeLine>> edges;
                for (const ResponseCurve& curve : model.law().curves()) {
                    edges.emplace_back(curve.curve().below(), curve.curve().above());
                }
                return edges;
            },
            "Ends (below, above) of the domain for each curve of the force law.")
        .def_property_readonly("play_radius", &ExportedModel::play_radius)
        .def_property_readonly("force_error", &ExportedModel::force_error)
        .def_property_readonly("slope_error", &ExportedModel::slope_error)
        .def_property_readonly("energy_error", &ExportedModel::energy_error)
        .def_property_readonly("step_error", &ExportedModel::step_error)
        .def_property_readonly("step_error_lasts", &ExportedModel::step_error_lasts,
                               "True if the error of a step does not grow with the number of steps.")
        .def_property_readonly("outside_share", &ExportedModel::outside_share)
        .def_property_readonly("rendering_error", &ExportedModel::rendering_error,
                               "Friction that the certificate of an exported model needs in addition [N or "
                               "N*m]; infinity if no bound of the errors is known.")
        .def_property_readonly("largest_force", &ExportedModel::largest_force)
        .def_property_readonly("largest_slope", &ExportedModel::largest_slope);
    type.def("samples", &samples, "counts"_a,
             "Returns force, slope and energy (3, n) at the counts (n,) with the arithmetic of the header.\n"
             "After each count the play operator is moved to it.");
    type.def(
        "steps", &steps, "counts"_a,
        "Returns the forces (n,) of the structure over a motion (n,), with the arithmetic of the header.");
    type.def(
        "check",
        [](const ExportedModel& model, std::size_t random_counts, std::uint64_t seed) {
            const py::gil_scoped_release unlocked;
            return checked_export(model, random_counts, seed);
        },
        "random_counts"_a = 2000, "seed"_a = 1,
        "Compares the tables with the core at all cell borders, at random counts and over a random motion.");
}

}  // namespace

void bind_portable(py::module_& module) {
    bind_table(module);
    bind_lines(module);
    py::class_<ExportCheck>(
        module, "ExportCheck",
        "Largest differences between an exported model and the core, divided by their bounds.")
        .def_readonly("force", &ExportCheck::force)
        .def_readonly("slope", &ExportCheck::slope)
        .def_readonly("energy", &ExportCheck::energy)
        .def_readonly("step", &ExportCheck::step)
        .def_readonly("places", &ExportCheck::places, "Number of counts that were compared.")
        .def_property_readonly("passed", &ExportCheck::passed,
                               "True if every difference is within its bound.");
    bind_exported_model(module);
    module.def("profile_checksum", &checksum, "device"_a,
               "Returns 32 bits that change with every number and name of a device profile.");
}

}  // namespace palpate::bindings
