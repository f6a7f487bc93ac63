// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "palpate/model/fingerprint.hpp"
#include "palpate/model/force_model.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

/// An optional array argument that has one value for all samples, or one value for each sample.
class Broadcast {
  public:
    Broadcast(const std::optional<Array>& array, py::ssize_t samples, const char* name) {
        if (!array) {
            return;
        }
        if (array->size() != 1 && array->size() != samples) {
            throw std::invalid_argument(std::string(name) + " has shape " + shape_of(*array) +
                                        ", must have 1 or " + std::to_string(samples) + " values");
        }
        values_ = array->data();
        stride_ = array->size() == 1 ? 0 : 1;
    }

    [[nodiscard]] std::optional<double> operator[](py::ssize_t k) const {
        return values_ == nullptr ? std::nullopt : std::optional{values_[k * stride_]};
    }

  private:
    const double* values_ = nullptr;
    py::ssize_t stride_ = 0;
};

using Member = double EnvironmentSample::*;

/// Returns force, slope or energy of a model at the position x. A hysteresis model needs the direction (+1 press, -1
/// release) or the state of the play operator.
template <Member member>
double sample(const ForceModel& model, double x, std::optional<double> direction,
              std::optional<double> play) {
    if (const WaveletNetwork* network = model.network()) {
        return network->at(x, {}).*member;
    }
    const HysteresisNetwork& both = *model.hysteresis();
    if constexpr (member == &EnvironmentSample::energy) {
        if (direction && model.play_radius()) {  // the direction gives the position of the play operator
            return both.at(x, {x - *direction * *model.play_radius()}).energy;
        }
    }
    return (direction ? both.sliding(x, *direction) : both.at(x, {*play})).*member;
}

/// Throws if the model has several inputs, or if a hysteresis model is called without a direction or play state.
void require_inputs(const ForceModel& model, bool direction, bool play) {
    detail::require(model.parameters().dimension == 1,
                    "the model has " + std::to_string(model.parameters().dimension) +
                        " inputs: call predict(X), where X has one column for each input");
    if (!model.hysteresis()) {
        return;
    }
    detail::require(direction || play,
                    "the model has hysteresis: give direction= (+1 pressing, -1 releasing) or play=");
    detail::require(
        direction || model.play_radius().has_value(),
        "play= is given, but the model has no play radius: give direction= (+1 pressing, -1 releasing)");
}

constexpr HatQuantity quantity_of(Member member) {
    return member == &EnvironmentSample::force   ? HatQuantity::Force
           : member == &EnvironmentSample::slope ? HatQuantity::Slope
                                                 : HatQuantity::Integral;
}

/// Returns the force, slope or energy of a model at one position.
template <Member member>
double scalar(const ForceModel& model, double position, const py::object& /*velocity*/,
              const py::object& /*acceleration*/, std::optional<double> direction,
              std::optional<double> play) {
    require_inputs(model, direction.has_value(), play.has_value());
    return sample<member>(model, position, direction, play);
}

/// Returns the force, slope or energy of a model at many positions.
template <Member member>
py::array_t<double> batch(const ForceModel& model, const ArrayLike& positions, const py::object& /*velocity*/,
                          const py::object& /*acceleration*/, const std::optional<ArrayLike>& given_direction,
                          const std::optional<ArrayLike>& given_play) {
    const Array position = numbers(positions, "position");
    const auto optional_numbers = [](const std::optional<ArrayLike>& given, const char* name) {
        return given ? std::optional(numbers(*given, name)) : std::nullopt;
    };
    const std::optional<Array> direction = optional_numbers(given_direction, "direction");
    const std::optional<Array> play = optional_numbers(given_play, "play");
    require_inputs(model, direction.has_value(), play.has_value());
    const Broadcast directions(direction, position.size(), "direction");
    const Broadcast plays(play, position.size(), "play");
    py::array_t<double> result(
        std::vector<py::ssize_t>(position.shape(), position.shape() + position.ndim()));
    const double* in = position.data();
    double* out = result.mutable_data();
    const py::gil_scoped_release unlocked;
    in_parts(static_cast<std::size_t>(position.size()), [&](std::size_t first, std::size_t count) {
        if (const WaveletNetwork* network = model.network()) {
            network->curve().at(quantity_of(member), {in + first, count}, {out + first, count});
            return;
        }
        for (std::size_t k = first; k < first + count; ++k) {
            const auto at = static_cast<py::ssize_t>(k);
            out[k] = sample<member>(model, in[k], directions[at], plays[at]);
        }
    });
    return result;
}

/// Adds a method for the force, slope or energy of a model. It returns a number for one position, an array for an
/// array.
template <Member member>
void bind_quantity(py::class_<ForceModel>& type, const char* name, const char* doc) {
    type.def(name, &scalar<member>, doc, py::arg("position").noconvert(), py::kw_only(),
             "velocity"_a = py::none(), "acceleration"_a = py::none(), "direction"_a = py::none(),
             "play"_a = py::none());
    type.def(name, &batch<member>,
             "The same method for an array of positions of any shape; returns an array of this shape.",
             "position"_a, py::kw_only(), "velocity"_a = py::none(), "acceleration"_a = py::none(),
             "direction"_a = py::none(), "play"_a = py::none());
}

/// Makes a ForceModel from the arguments of its Python constructor.
ForceModel make_model(const Array& alpha, const Array& beta, const Array& weight, const Array& linear,
                      double bias, const std::optional<Array>& weight_hysteresis,
                      const std::optional<Array>& linear_hysteresis, std::optional<double> bias_hysteresis,
                      const Array& lower, const Array& upper, const std::string& below,
                      const std::string& above, std::optional<double> period,
                      std::optional<double> play_radius, bool of_velocity,
                      const std::optional<MemoryParameters>& memory, const std::string& position_unit,
                      const std::string& force_unit, std::size_t harmonics) {
    const ModelUnits units{position_unit, force_unit};
    NetworkParameters network{static_cast<std::size_t>(lower.size()),
                              copied(alpha),
                              copied(beta),
                              copied(weight),
                              copied(linear),
                              bias,
                              harmonics};
    Domain domain{copied(lower), copied(upper), named<Continuation>(below, "below"),
                  named<Continuation>(above, "above"), period};
    const int given = int{weight_hysteresis.has_value()} + int{linear_hysteresis.has_value()} +
                      int{bias_hysteresis.has_value()};
    detail::require(
        given == 0 || given == 3,
        "weight_hysteresis, linear_hysteresis and bias_hysteresis must be given together or not at all");
    if (given == 0) {
        detail::require(!play_radius, "play_radius is given, but the model has no hysteresis: leave it out");
        if (memory) {
            detail::require(!of_velocity && network.dimension == 1,
                            "memory is given, but the model has several inputs: leave it out");
            return ForceModel{std::move(network), std::move(domain)}.with_memory(*memory).with_units(units);
        }
        return (of_velocity ? ForceModel::of_velocity(std::move(network), std::move(domain))
                            : ForceModel{std::move(network), std::move(domain)})
            .with_units(units);
    }
    detail::require(!memory, "memory is given, but the model has hysteresis: leave one of them out");
    detail::require_size(copied(*linear_hysteresis), 1, "linear_hysteresis");
    return ForceModel{network,
                      {copied(*weight_hysteresis), linear_hysteresis->data()[0], *bias_hysteresis},
                      domain,
                      play_radius}
        .with_units(units);
}

/// Makes the memory of a model from the arguments of its Python constructor.
MemoryParameters make_memory(const Array& alpha, const Array& beta, const Array& weight, double linear,
                             double bias, const Array& stiffness, const Array& time_constant_s,
                             const std::optional<Array>& yield_stretch) {
    return {{1, copied(alpha), copied(beta), copied(weight), {linear}, bias},
            copied(stiffness),
            copied(time_constant_s),
            yield_stretch ? copied(*yield_stretch) : std::vector<double>{}};
}

/// Throws unless time and position of a motion have the same size, and the time increases.
void require_motion(const Array& time, py::ssize_t rows, const char* name) {
    require_vector(time, "time");
    detail::require(time.size() == rows, "time has " + std::to_string(time.size()) + " values, must have " +
                                             std::to_string(rows) + " as " + name);
    for (py::ssize_t k = 1; k < rows; ++k) {
        detail::require(time.data()[k] > time.data()[k - 1],
                        "time[" + std::to_string(k) + "] is not above time[" + std::to_string(k - 1) + "]");
    }
}

/// Returns the force of a model with memory along a recorded motion, and the factors of its stretches.
std::pair<py::array_t<double>, py::array_t<double>> force_over_time(const ForceModel& model,
                                                                    const ArrayLike& given_time,
                                                                    const ArrayLike& given_position) {
    detail::require(model.memory() != nullptr, "the model has no memory: call force(position)");
    const Array time = numbers(given_time, "time");
    const Array position = numbers(given_position, "position");
    require_vector(position, "position");
    require_motion(time, position.size(), "position");
    py::array_t<double> force(position.size());
    py::array_t<double> factor(position.size());
    const MemoryForce<NetworkCurve> object{model.network()->curve(), model.memory()->ratio(), *model.memory(),
                                           0.0};
    auto state = object.start(position.size() > 0 ? position.data()[0] : 0.0);
    for (py::ssize_t k = 0; k < position.size(); ++k) {
        const double seconds = k > 0 ? time.data()[k] - time.data()[k - 1] : 0.0;
        const auto recorded = object.move_for(position.data()[k], seconds, state);
        force.mutable_data()[k] = recorded.sample.force;
        factor.mutable_data()[k] = recorded.factor;
    }
    return {force, factor};
}

/// Returns the stretches of branches along recorded coordinates, shape (n, m, J).
py::array_t<double> stretches(const ArrayLike& given_time, const ArrayLike& given_coordinate,
                              const ArrayLike& given_time_constant,
                              const std::optional<ArrayLike>& given_factor) {
    const Array time = numbers(given_time, "time");
    const Array coordinate = numbers(given_coordinate, "coordinate");
    const Array tau = numbers(given_time_constant, "time_constant_s");
    detail::require(coordinate.ndim() == 2,
                    "coordinate has shape " + shape_of(coordinate) + ", must be (n, m)");
    require_vector(tau, "time_constant_s");
    const py::ssize_t rows = coordinate.shape(0);
    const py::ssize_t columns = coordinate.shape(1);
    require_motion(time, rows, "rows of coordinate");
    const std::optional<Array> factor =
        given_factor ? std::optional(numbers(*given_factor, "factor")) : std::nullopt;
    const Broadcast factors(factor, rows, "factor");
    py::array_t<double> result({rows, columns, tau.size()});
    double* out = result.mutable_data();
    const double* u = coordinate.data();
    const py::ssize_t step = columns * tau.size();
    const py::gil_scoped_release unlocked;
    std::fill(out, out + (rows > 0 ? step : 0), 0.0);
    for (py::ssize_t k = 1; k < rows; ++k) {
        const double kept = factors[k].value_or(1.0);
        for (py::ssize_t j = 0; j < tau.size(); ++j) {
            const BranchStep share{time.data()[k] - time.data()[k - 1], tau.data()[j]};
            for (py::ssize_t i = 0; i < columns; ++i) {
                double* at = out + k * step + i * tau.size() + j;
                const double moved = u[k * columns + i] - u[(k - 1) * columns + i];
                *at = kept * (share.kept * at[-step] + share.moved * moved);
            }
        }
    }
    return result;
}

Array table(const std::vector<double>& values, std::size_t dimension) {
    Array result({static_cast<py::ssize_t>(values.size() / dimension), static_cast<py::ssize_t>(dimension)});
    std::copy(values.begin(), values.end(), result.mutable_data());
    return result;
}

Array row(const std::vector<double>& values) {
    return Array(static_cast<py::ssize_t>(values.size()), values.data());
}

/// Returns the force of a model with several inputs or with hysteresis for one row of inputs.
double row_force(const ForceModel& model, const double* row) {
    const std::size_t columns = model.parameters().dimension + (model.hysteresis() != nullptr ? 1 : 0);
    if (!std::all_of(row, row + columns, [](double value) { return std::isfinite(value); })) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    const RadialNetwork* radial = model.radial();
    return radial != nullptr ? radial->value({row, radial->dimension()})
                             : model.hysteresis()->sliding(row[0], row[1]).force;
}

/// Returns the force of a model for each row of inputs in the array X.
py::array_t<double> predict(const ForceModel& model, const ArrayLike& rows) {
    const Array x = numbers(rows, "X");
    const std::size_t columns = model.parameters().dimension + (model.hysteresis() ? 1 : 0);
    if (x.ndim() != 2 || static_cast<std::size_t>(x.shape(1)) != columns) {
        throw std::invalid_argument("X has shape " + shape_of(x) + ", must be (n, " +
                                    std::to_string(columns) + ")" +
                                    (model.hysteresis() ? ": position and direction" : ""));
    }
    py::array_t<double> result(x.shape(0));
    const double* in = x.data();
    double* out = result.mutable_data();
    const py::gil_scoped_release unlocked;
    in_parts(static_cast<std::size_t>(x.shape(0)), [&](std::size_t first, std::size_t count) {
        if (const WaveletNetwork* network = model.network()) {
            network->curve().at(HatQuantity::Force, {in + first, count}, {out + first, count});
            return;
        }
        for (std::size_t k = first; k < first + count; ++k) {
            out[k] = row_force(model, in + k * columns);
        }
    });
    return result;
}

/// Returns the states of a play operator that follows a sequence of positions.
py::array_t<double> play_states(const Array& position, double radius, std::optional<double> start) {
    require_vector(position, "position");
    detail::require(radius > 0.0, "radius is " + std::to_string(radius) + ", must be > 0");
    py::array_t<double> result(position.size());
    double state = start.value_or(position.size() > 0 ? position.data()[0] : 0.0);
    for (py::ssize_t k = 0; k < position.size(); ++k) {
        state = play(position.data()[k], state, radius);
        result.mutable_data()[k] = state;
    }
    return result;
}

py::array_t<double> model_play_states(const ForceModel& model, const ArrayLike& position,
                                      std::optional<double> start) {
    detail::require(model.play_radius().has_value(),
                    "the model has no play radius, so the state of the play operator is not defined");
    return play_states(numbers(position, "position"), *model.play_radius(), start);
}

std::pair<double, double> pair_of(Interval interval) {
    return {interval.lower, interval.upper};
}

/// Returns true for each position outside the domain of a model.
py::object extrapolated(const ForceModel& model, const ArrayLike& positions) {
    const Array position = numbers(positions, "position");
    require_inputs(model, true, true);
    const auto outside = [&](double x) {
        return model.network() ? model.network()->curve().extrapolated(x)
                               : model.hysteresis()->force().extrapolated(x);
    };
    if (position.ndim() == 0) {
        return py::bool_(outside(*position.data()));
    }
    py::array_t<bool> result(std::vector<py::ssize_t>(position.shape(), position.shape() + position.ndim()));
    std::transform(position.data(), position.data() + position.size(), result.mutable_data(), outside);
    return result;
}

NetworkParameters network_of(const Array& alpha, const Array& beta, const Array& weight, double linear,
                             double bias, std::size_t harmonics = 0) {
    return {1, copied(alpha), copied(beta), copied(weight), {linear}, bias, harmonics};
}

std::pair<double, double> network_slope_bounds(const Array& alpha, const Array& beta, const Array& weight,
                                               double linear, double bias, double lower, double upper,
                                               double relative) {
    const NetworkParameters network = network_of(alpha, beta, weight, linear, bias);
    validate(network, {{lower}, {upper}, {}, {}, std::nullopt});
    detail::require(relative > 0.0, "relative is " + std::to_string(relative) + ", must be > 0");
    return pair_of(slope_bounds(network, lower, upper, relative));
}

py::array_t<double> cell_derivative_bounds(const Array& alpha, const Array& beta, const Array& weight,
                                           double linear, double bias, const Array& lower, const Array& upper,
                                           std::size_t order, std::size_t harmonics) {
    const NetworkParameters network = network_of(alpha, beta, weight, linear, bias, harmonics);
    validate(network, {{0.0}, {1.0}, {}, {}, 1.0});
    require_vector(lower, "lower");
    detail::require_size(copied(upper), view(lower).size(), "upper");
    detail::require(order <= highest_derivative, "order is " + std::to_string(order) + ", must be at most " +
                                                     std::to_string(highest_derivative));
    py::array_t<double> result(lower.size());
    double* out = result.mutable_data();
    const py::gil_scoped_release unlocked;
    for (std::size_t k = 0; k < view(lower).size(); ++k) {
        out[k] = derivative_bounds(network, view(lower)[k], view(upper)[k])[order];
    }
    return result;
}

}  // namespace

void bind_model(py::module_& module) {
    py::class_<MemoryParameters> memory(
        module, "Memory",
        "Memory of an object that relaxes or slips: J springs of stiffness k_j in series with a dashpot and\n"
        "a slider (branches).\n\n"
        "f = g(x) + p(x) sum_j k_j e_j, de_j/dt = p(x) dx/dt - e_j / tau_j, |e_j| <= Y_j. The ratio p is a\n"
        "network of one input with the wavelets alpha, beta, weight, the slope `linear` and the constant\n"
        "`bias`.");
    memory.def(
        py::init(&make_memory), py::kw_only(), "alpha"_a, "beta"_a, "weight"_a, "linear"_a, "bias"_a,
        "stiffness"_a, "time_constant_s"_a, "yield_stretch"_a = py::none(),
        "Makes the memory; without `yield_stretch` no branch slips. The model that gets it checks the\n"
        "values.");
    memory.def_property_readonly("alpha", [](const MemoryParameters& m) { return row(m.ratio.alpha); });
    memory.def_property_readonly("beta", [](const MemoryParameters& m) { return row(m.ratio.beta); });
    memory.def_property_readonly("weight", [](const MemoryParameters& m) { return row(m.ratio.weight); });
    memory.def_property_readonly("linear", [](const MemoryParameters& m) { return m.ratio.linear[0]; });
    memory.def_property_readonly("bias", [](const MemoryParameters& m) { return m.ratio.bias; });
    memory.def_property_readonly(
        "stiffness", [](const MemoryParameters& m) { return row(m.stiffness); },
        "Stiffness k_j of each branch [N/m or N*m/rad].");
    memory.def_property_readonly(
        "time_constant_s", [](const MemoryParameters& m) { return row(m.time_constant_s); },
        "Time constant tau_j of each branch, infinite if it does not relax [s].");
    memory.def_property_readonly(
        "yield_stretch",
        [](const MemoryParameters& m) {
            return m.yield_stretch.empty()
                       ? row(std::vector(m.stiffness.size(), std::numeric_limits<double>::infinity()))
                       : row(m.yield_stretch);
        },
        "Stretch Y_j at which each branch slips, infinite if it does not [m or rad].");

    py::class_<ForceModel> type(
        module, "ForceModel",
        "A force law of d inputs x, with its domain and the continuation of the force outside the\n"
        "domain.\n\n"
        "f(x) = sum_i w_i psi(alpha_i o (x - beta_i)) + c'x + b (paper eq. 4). With hysteresis the force\n"
        "is f(x, s) = g(x) + s h(x), with the mean force g of press and release, the direction state s\n"
        "from -1 to 1, and the hysteresis h, which has separate weights for the same wavelets.");
    type.def(
        py::init(&make_model), py::kw_only(), "alpha"_a, "beta"_a, "weight"_a, "linear"_a, "bias"_a,
        "weight_hysteresis"_a = py::none(), "linear_hysteresis"_a = py::none(),
        "bias_hysteresis"_a = py::none(), "lower"_a, "upper"_a, "below"_a = "linear", "above"_a = "linear",
        "period"_a = py::none(), "play_radius"_a = py::none(), "of_velocity"_a = false,
        "memory"_a = py::none(), "position_unit"_a = "", "force_unit"_a = "", "harmonics"_a = 0,
        "Makes the model of N wavelets and d inputs: alpha, beta (N, d); weight (N,); linear, lower,\n"
        "upper (d,). of_velocity is true if the second of two inputs is the velocity. With a memory, the\n"
        "network is the force at rest. The units do not change the numbers; empty: not stated. The last\n"
        "`harmonics` wavelets of a periodic force are w cos(alpha (x - beta)). Raises ValueError with the\n"
        "wrong field.");

    bind_quantity<&EnvironmentSample::force>(
        type, "force",
        "Returns the force of the object against the tool [N or N*m]: a number for one position, an\n"
        "array for an array of positions.\n\n"
        "A hysteresis model needs `direction` (+1 pressing, -1 releasing) or, if it has a play radius,\n"
        "`play`, the state of the play operator. Arguments that the model does not use do not change the\n"
        "force, but direction and play must have one value for each position or one for all. Raises\n"
        "ValueError with the name of a missing argument. A position that is not finite gives NaN.");
    bind_quantity<&EnvironmentSample::slope>(
        type, "slope",
        "Returns the slope df/dx of the force [N/m or N*m/rad]; the arguments are "
        "those of force().");
    bind_quantity<&EnvironmentSample::energy>(
        type, "energy",
        "Returns the stored energy, up to a constant [J]; the arguments are those of force(). With\n"
        "`direction` the play operator is at position - direction * play_radius. If the model has no play\n"
        "radius, the result is the energy of the mean force of press and release.");
    type.def("predict", &predict, "X"_a,
             "Returns the force (n,) for the n rows of inputs X (n, d). A hysteresis model takes the\n"
             "direction as one more column. A row with a value that is not finite gives NaN.");
    type.def("extrapolated", &extrapolated, "position"_a,
             "Returns True for a position outside the domain of the model.");
    type.def(
        "play", &model_play_states, "position"_a, "start"_a = py::none(),
        "Returns the states (n,) of the model's play operator along the positions of a motion (n,). Without\n"
        "`start` the first state is the first position.");
    type.def(
        "slope_range",
        [](const ForceModel& model, std::optional<double> radius) {
            require_one_input(model.parameters());
            detail::require(!radius || *radius > 0.0, "play_radius must be > 0");
            return pair_of(model.slope_bounds(radius));
        },
        "play_radius"_a = py::none(),
        "Returns proved bounds (smallest, largest) of the slope of the force inside the domain, in press\n"
        "and in release. Without hysteresis they are wider than the true range by at most 1 % of the\n"
        "steepest slope. With a play radius r they include the slope h / r (hysteresis h), with which\n"
        "the force of a hysteresis model changes after a reversal.");

    type.def("force_over_time", &force_over_time, "time"_a, "position"_a,
             "Returns the force (n,) of a model with memory along a recorded motion that starts at rest:\n"
             "positions (n,) at increasing times (n,) [s]. The second result (n,) is below 1 where the\n"
             "stretches were reduced, because the tool left the object.");
    type.def_property_readonly(
        "memory",
        [](const ForceModel& m) -> std::optional<MemoryParameters> {
            return m.memory() ? std::optional(m.memory()->parameters()) : std::nullopt;
        },
        "Memory of the model; None for a force without memory.");

    type.def_property_readonly("dimension", [](const ForceModel& m) { return m.parameters().dimension; });
    type.def_property_readonly("n_wavelets",
                               [](const ForceModel& m) { return m.parameters().weight.size(); });
    type.def_property_readonly(
        "harmonics", [](const ForceModel& m) { return m.parameters().harmonics; },
        "Number of last wavelets that are harmonics of the period, w cos(alpha (x - beta)).");
    type.def_property_readonly(
        "alpha", [](const ForceModel& m) { return table(m.parameters().alpha, m.parameters().dimension); });
    type.def_property_readonly(
        "beta", [](const ForceModel& m) { return table(m.parameters().beta, m.parameters().dimension); });
    type.def_property_readonly("weight", [](const ForceModel& m) { return row(m.parameters().weight); });
    type.def_property_readonly("linear", [](const ForceModel& m) { return row(m.parameters().linear); });
    type.def_property_readonly("bias", [](const ForceModel& m) { return m.parameters().bias; });
    type.def_property_readonly("hysteretic", [](const ForceModel& m) { return m.hysteresis() != nullptr; });
    type.def_property_readonly(
        "of_velocity", [](const ForceModel& m) { return m.velocity() != nullptr; },
        "True if the model has two inputs, of which the second is the velocity.");
    type.def_property_readonly(
        "of_position", [](const ForceModel& m) { return m.velocity() == nullptr && m.memory() == nullptr; },
        "True if velocity and time do not change the force. Couplings, prediction, admittance displays\n"
        "and most exports need such a model; all others are rendered directly.");
    type.def_property_readonly("weight_hysteresis", [](const ForceModel& m) -> std::optional<Array> {
        return m.hysteresis() ? std::optional(row(m.hysteresis()->hysteresis_force().parameters().weight))
                              : std::nullopt;
    });
    type.def_property_readonly("linear_hysteresis", [](const ForceModel& m) -> std::optional<Array> {
        return m.hysteresis() ? std::optional(row(m.hysteresis()->hysteresis_force().parameters().linear))
                              : std::nullopt;
    });
    type.def_property_readonly("bias_hysteresis", [](const ForceModel& m) -> std::optional<double> {
        return m.hysteresis() ? std::optional(m.hysteresis()->hysteresis_force().parameters().bias)
                              : std::nullopt;
    });
    type.def_property_readonly("lower", [](const ForceModel& m) { return row(m.domain().lower); });
    type.def_property_readonly("upper", [](const ForceModel& m) { return row(m.domain().upper); });
    type.def_property_readonly("below",
                               [](const ForceModel& m) { return std::string(name_of(m.domain().below)); });
    type.def_property_readonly("above",
                               [](const ForceModel& m) { return std::string(name_of(m.domain().above)); });
    type.def_property_readonly("period", [](const ForceModel& m) { return m.domain().period; });
    type.def_property_readonly("play_radius", &ForceModel::play_radius);
    type.def_property_readonly(
        "position_unit", [](const ForceModel& m) { return m.units().position; },
        "Unit of the position, rad, m or count; empty: not stated.");
    type.def_property_readonly(
        "force_unit", [](const ForceModel& m) { return m.units().force; },
        "Unit of the force, N*m, N or A; empty: not stated.");

    module.def(
        "play", &play_states, "position"_a, "radius"_a, "start"_a = py::none(),
        "Returns the states (n,) of a play operator of radius r along the positions x of a motion (n,):\n"
        "play_k = min(x_k + r, max(x_k - r, play_{k-1})). Without `start` the first state is the first\n"
        "position.");

    module.def("stretches", &stretches, "time"_a, "coordinate"_a, "time_constant_s"_a,
               "factor"_a = py::none(),
               "Returns the stretches (n, m, J) of branches with the J time constants along m recorded\n"
               "coordinates (n, m) at increasing times (n,), from rest: e <- factor (kept e + share du).\n"
               "`factor` (n,) reduces the stretches at each row; by default 1.");
    module.def(
        "slope_bounds", &network_slope_bounds, py::kw_only(), "alpha"_a, "beta"_a, "weight"_a, "linear"_a,
        "bias"_a, "lower"_a, "upper"_a, "relative"_a = 0.01,
        "Returns proved bounds (smallest, largest) of the slope f' of a network of one input from lower\n"
        "to upper. They are wider than the true range by at most `relative` times the largest |f'|.");
    module.def("derivative_bounds", &cell_derivative_bounds, py::kw_only(), "alpha"_a, "beta"_a, "weight"_a,
               "linear"_a, "bias"_a, "lower"_a, "upper"_a, "order"_a, "harmonics"_a = 0,
               "Returns proved upper bounds (k,) of the absolute derivative of a network of one input,\n"
               "for orders up to 9, in k intervals of positions from lower (k,) to upper (k,). The last\n"
               "`harmonics` wavelets are harmonics of the period 1.");
    module.attr("most_wavelets") = most_wavelets;
    module.def("fingerprint", &fingerprint, "model"_a,
               "Returns a fingerprint of a model: 16 hexadecimal digits, computed from its units and all "
               "numbers that determine the force.");
}

}  // namespace palpate::bindings
