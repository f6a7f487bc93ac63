// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "palpate/fields/readable.hpp"
#include "palpate/model/fingerprint.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/portable/cell_table.hpp"
#include "palpate/rendering/scheme.hpp"

namespace palpate {

/// Numbers of the device on which an exported model runs.
struct ExportTarget {
    double encoder_step = 0.0;  ///< Delta, position for each count [m or rad]
    double period_s = 0.0;      ///< T, time between two ticks [s]; used by the massless structure only
    double force_limit = std::numeric_limits<double>::infinity();  ///< largest force of the device [N or N*m]
    Precision precision = Precision::Single;
};

/// Straight line of an exported curve outside one end of the domain. In single precision its distances are counts, in
/// double precision positions. `gain` is the change of the force for each unit of distance from the domain.
struct ExportedLine {
    double value = 0.0;  ///< force at the end of the domain [N]
    double gain = 0.0;
    double slope = 0.0;                                      ///< df/dx [N/m]
    double reach = std::numeric_limits<double>::infinity();  ///< distance from which the force is zero
    double offset = 0.0;  ///< distance of the outermost count of the domain from the end of the domain
};

/// Numbers of the massless structure. With the lag e = x - y of the object behind the device and the force F(z) on the
/// load line, z = x - `memory` e, a step is
///
///     F = F(x_k - memory e_{k-1}),   e_k = memory e_{k-1} + F `compliance`.
///
/// It follows from p z = q and p (z - y) = F. No large numbers are subtracted, so no digits are lost.
struct ExportedLag {
    double memory = 0.0;      ///< (B_c / T) / p [-]
    double compliance = 0.0;  ///< 1 / p [m/N]; in single precision [counts/N]
};

/// Numbers of the branches of a model with memory, in the units in which the largest force of the branches along their
/// coordinate is 1. The second curve of the table is the ratio, which is then a force too.
struct ExportedMemory {
    std::vector<double> stiffness;        ///< k_j of each branch
    std::vector<double> kept;             ///< share of a stretch that is left after a period at rest [-]
    std::vector<double> largest_stretch;  ///< bound of |e_j|
    double sudden = 0.0;                  ///< sum of the stiffnesses for a motion within one period
    int contact = 0;  ///< sign of the force against which the branches do not pull; 0: none
};

/// A model as tables and numbers for a program in C without a library: the force law, and the structure of a plan.
///
/// Exported are forces of position, with or without hysteresis or memory, with the direct structure (and its
/// prediction) or, without hysteresis and memory, with the massless structure. Everything else is refused.
class ExportedModel {
  public:
    ExportedModel(const ForceModel& given, const Scheme& scheme, const ExportTarget& target)
        : model_{in_units_of_force(scheme.play_radius > 0.0 ? given.with_play_radius(scheme.play_radius)
                                                            : given)},
          scheme_{used_part(scheme)},
          target_{target},
          law_{(require_exportable(given, scheme, target), make_law())},
          memory_{make_memory()},
          response_{make_response()} {
        for (const ResponseCurve& curve : law_.curves()) {
            lines_.push_back({line(curve.below(), law_.grid(), -1.0), line(curve.above(), law_.grid(), 1.0)});
        }
        if (response_) {
            const ResponseCurve& curve = response_->curves()[0];
            response_lines_ = {line(curve.below(), response_->grid(), -1.0),
                               line(curve.above(), response_->grid(), 1.0)};
        }
        compute_errors();
    }

    [[nodiscard]] const ForceModel& model() const noexcept { return model_; }
    [[nodiscard]] const Scheme& scheme() const noexcept { return scheme_; }
    [[nodiscard]] const ExportTarget& target() const noexcept { return target_; }
    [[nodiscard]] bool single() const noexcept { return target_.precision == Precision::Single; }
    [[nodiscard]] bool hysteretic() const noexcept { return model_.hysteresis() != nullptr; }
    [[nodiscard]] bool massless() const noexcept { return response_.has_value(); }
    [[nodiscard]] bool periodic() const noexcept { return law_.grid().periodic; }
    /// Returns the table of the force law; with hysteresis of mean force and hysteresis.
    [[nodiscard]] const CellTable& law() const noexcept { return law_; }
    /// Returns the table of the force on the load line, of the massless structure only.
    [[nodiscard]] const std::optional<CellTable>& response() const noexcept { return response_; }
    /// Return the lines below and above the domain: of each curve of the law, and of the load line.
    [[nodiscard]] const std::vector<std::array<ExportedLine, 2>>& lines() const noexcept { return lines_; }
    [[nodiscard]] const std::array<ExportedLine, 2>& response_lines() const noexcept {
        return response_lines_;
    }
    [[nodiscard]] const ExportedLag& lag() const noexcept { return lag_; }
    /// Returns the branches of a model with memory.
    [[nodiscard]] const std::optional<ExportedMemory>& memory() const noexcept { return memory_; }
    /// Returns the play radius [m]; 0 without hysteresis.
    [[nodiscard]] double play_radius() const noexcept {
        return hysteretic() ? model_.hysteresis()->play_radius() : 0.0;
    }

    /// Return proved bounds of the difference to the core inside the domain: of the force law [N], its slope [N/m] and
    /// its energy [J], and of the force of a step of the structure [N].
    [[nodiscard]] double force_error() const noexcept { return force_error_; }
    [[nodiscard]] double slope_error() const noexcept { return slope_error_; }
    [[nodiscard]] double energy_error() const noexcept { return energy_error_; }
    [[nodiscard]] double step_error() const noexcept { return step_error_; }
    /// Returns true if `step_error` holds for a motion of any length; otherwise for one step from the same state.
    [[nodiscard]] bool step_error_lasts() const noexcept { return step_error_lasts_; }
    /// Returns the factor of the additional error outside the domain: times |f - force at the end of the domain|.
    [[nodiscard]] double outside_share() const noexcept { return 6.0 * unit_roundoff(target_.precision); }
    /// Returns the friction that the certificate of the exported program needs in addition [N]. It is a proved bound of
    /// the error of the sent torque, at every position and for a motion of any length. Infinity: no bound is known.
    [[nodiscard]] double rendering_error() const noexcept { return rendering_error_; }
    /// Returns lower bounds of max|f| [N] and max|f'| [N/m] over the domain. With hysteresis the slope includes that of
    /// the play, h / r.
    [[nodiscard]] double largest_force() const { return CellTable::largest_force(law_.curves())[0]; }
    [[nodiscard]] double largest_slope() const {
        double slope = CellTable::largest_force(law_.curves())[1];
        if (hysteretic()) {
            slope = std::max(slope, law_.curves()[1].largest_samples()[0] / play_radius());
        }
        if (memory_) {
            const double ratio = law_.curves()[1].largest_samples()[0];
            slope += ratio * ratio * memory_->sudden;
        }
        return slope;
    }

  private:
    static void require_exportable(const ForceModel& model, const Scheme& scheme,
                                   const ExportTarget& target) {
        const auto refuse = [](const std::string& sentence) { throw std::invalid_argument(sentence); };
        if (model.velocity() != nullptr) {
            refuse(
                "the force depends on velocity, which is not exported: identify the model with --inputs "
                "position");
        }
        if (model.memory() != nullptr && !(target.period_s > 0.0)) {
            refuse("the memory of the force needs the period of a device: plan the model for a device");
        }
        if (model.radial() != nullptr) {
            refuse("the model has " + std::to_string(model.parameters().dimension) +
                   " inputs: only a force of position is exported");
        }
        validate(scheme, model);
        const std::string structure{name_of(scheme.structure)};
        if (scheme.structure != StructureKind::Direct && scheme.structure != StructureKind::Massless) {
            refuse("the structure " + structure +
                   " is not exported: plan the model without mass and damping, with --mass 0 "
                   "--object-damping 0");
        }
        if (scheme.structure == StructureKind::Massless) {
            if (model.hysteresis() != nullptr) {
                refuse(
                    "the structure massless is not exported for a model with hysteresis: plan the model "
                    "without --coupling");
            }
            if (!(target.period_s > 0.0)) {
                refuse("the structure massless needs the period of a device: plan the model for a device");
            }
            const double farthest = target.force_limit / (scheme.coupling.stiffness * target.encoder_step);
            if (!(farthest <= 0x1p22)) {
                refuse("the coupling stiffness is " + readable(scheme.coupling.stiffness) +
                       ": at the force limit the object lags by " + readable(farthest) +
                       " counts, more than 2^22; plan a stiffer coupling");
            }
        }
        if (!(target.encoder_step > 0.0 && std::isfinite(target.encoder_step))) {
            refuse("the encoder step is " + readable(target.encoder_step) +
                   ": must be > 0; give the position of one count with --encoder-step");
        }
    }

    /// Returns the same model with a ratio in units of force, so that both curves of the table are forces.
    [[nodiscard]] static ForceModel in_units_of_force(const ForceModel& given) {
        if (given.memory() == nullptr) {
            return given;
        }
        const double unit = given.memory()->largest_tension();
        if (!(unit > 0.0 && std::isfinite(unit))) {
            return given;
        }
        MemoryParameters scaled = given.memory()->parameters();
        for (double& weight : scaled.ratio.weight) {
            weight *= unit;
        }
        scaled.ratio.linear[0] *= unit;
        scaled.ratio.bias *= unit;
        for (double& stiffness : scaled.stiffness) {
            stiffness /= unit * unit;
        }
        for (double& stretch : scaled.yield_stretch) {
            stretch *= unit;
        }
        return given.with_memory(std::move(scaled));
    }

    [[nodiscard]] std::optional<ExportedMemory> make_memory() const {
        const MemoryNetwork* memory = model_.memory();
        if (memory == nullptr) {
            return std::nullopt;
        }
        ExportedMemory made{memory->parameters().stiffness, {}, {}, 0.0, memory->contact()};
        for (std::size_t j = 0; j < made.stiffness.size(); ++j) {
            made.largest_stretch.push_back(memory->largest_stretch(j));
            made.kept.push_back(1.0 / (1.0 + target_.period_s / memory->parameters().time_constant_s[j]));
            made.sudden += made.stiffness[j] * made.kept[j];
        }
        return made;
    }

    [[nodiscard]] CellTable make_law() const {
        std::vector<ResponseCurve> curves;
        if (const HysteresisNetwork* both = model_.hysteresis()) {
            curves.emplace_back(both->force(), 0.0);
            curves.emplace_back(both->hysteresis_force(), 0.0);
        } else {
            curves.emplace_back(model_.network()->curve(), 0.0);
        }
        if (model_.memory() != nullptr) {
            curves.emplace_back(model_.memory()->ratio(), 0.0);
        }
        return smallest_table(curves, target_.encoder_step, scheme_.predict > 0, target_.precision);
    }

    [[nodiscard]] std::optional<CellTable> make_response() {
        if (scheme_.structure != StructureKind::Massless) {
            return std::nullopt;
        }
        const double p = scheme_.coupling.load_line_slope(target_.period_s);
        lag_.memory = scheme_.coupling.damping / target_.period_s / p;
        lag_.compliance = 1.0 / (single() ? p * target_.encoder_step : p);
        const double compliance = 1.0 / p - (scheme_.compensated ? 1.0 / scheme_.coupling.stiffness : 0.0);
        const ResponseCurve curve{model_.network()->curve(), compliance};
        if (!curve.lines_rise()) {
            throw std::invalid_argument(
                "the load line has several solutions outside the domain: plan a stiffer coupling");
        }
        return smallest_table({curve}, target_.encoder_step, true, target_.precision);
    }

    [[nodiscard]] ExportedLine line(const EdgeLine& edge, const CellGrid& grid,
                                    double outward) const noexcept {
        const double unit = single() ? target_.encoder_step : 1.0;
        const double last = outward < 0.0 ? grid.first_count : grid.last_count;
        return {edge.at_edge.value, outward * edge.at_edge.slope * unit, edge.at_edge.slope,
                edge.reach / unit, single() ? outward * (edge.edge / unit - last) : 0.0};
    }

    void compute_errors() {
        const double u = unit_roundoff(target_.precision);
        const std::vector<CurveErrors>& curves = law_.errors();
        // Outside the domain: rounding of value and distance at the end of the domain
        double at_ends = 0.0;
        if (!periodic()) {
            for (const std::array<ExportedLine, 2>& pair : lines_) {
                for (const ExportedLine& line : pair) {
                    at_ends += 4.0 * u * (std::abs(line.value) + std::abs(line.gain));
                }
            }
        }
        force_error_ = curves[0].value;
        slope_error_ = curves[0].slope * (1.0 + 4.0 * u) + 2.0 * u * curves[0].steepest;
        energy_error_ = curves[0].integral;
        double energy = largest_integral(0);
        if (hysteretic()) {
            const double r = play_radius();
            const CurveErrors& h = curves[1];
            // The direction state has 7 roundings: 3 of a product of at most 2, and 1 of the sum; a prediction adds 4.
            // Then follow the product with h and the sum with g. The factors include the terms of second order.
            const double of_direction = scheme_.predict > 0 ? 12.0 : 8.0;
            force_error_ +=
                h.value + of_direction * u * h.largest + 1.01 * u * (curves[0].largest + 2.0 * h.largest);
            slope_error_ +=
                h.slope + h.value / r + 24.0 * u * (h.steepest + h.largest / r + curves[0].steepest);
            energy_error_ += h.integral * (1.0 + 0.5 * law_.widest() / r) + 16.0 * u * r * h.largest;
            energy += largest_integral(1) + largest_integral(2) / r;
        }
        if (memory_) {
            energy += add_memory_errors(u);
        }
        energy_error_ += (64.0 * 0x1p-53) * energy + 2.0 * u * energy;
        force_error_ = std::max(force_error_, at_ends);
        step_error_ = force_error_;
        step_error_lasts_ = !memory_;
        rendering_error_ += force_error_ + outside_error();
        if (response_) {
            bound_lag(u);
        }
        // Rounding of the force limit and of the torque in micronewtonmetres
        rendering_error_ += 3.0 * u * target_.force_limit;
    }

    /// Returns the largest absolute value of the integrals in column `column` of the table.
    [[nodiscard]] double largest_integral(std::size_t which) const noexcept {
        const std::size_t columns = 2 * law_.curves().size();
        const std::size_t column = which == 0 ? 0 : which + 1;
        double largest = 0.0;
        for (std::size_t k = column; k < law_.integrals().size(); k += columns) {
            largest = std::max(largest, std::abs(law_.integrals()[k]));
        }
        return largest + law_.errors()[which == 0 ? 0 : 1].largest * law_.widest();
    }

    /// Adds the errors of the branches in one tick from the same state, and returns a bound of their energy. The
    /// coordinate has the errors of two antiderivatives of the ratio. Branches and limits are computed with doubles.
    [[nodiscard]] double add_memory_errors(double u) {
        const CurveErrors& g = law_.errors()[0];
        const CurveErrors& p = law_.errors()[1];
        const ExportedMemory& memory = *memory_;
        double stiffness = 0.0;
        double sum = 0.0;
        double farthest = 0.0;
        for (std::size_t j = 0; j < memory.stiffness.size(); ++j) {
            stiffness += memory.stiffness[j];
            sum += memory.stiffness[j] * memory.largest_stretch[j];
            farthest = std::max(farthest, memory.largest_stretch[j]);
        }
        const double size = largest_integral(1) + farthest;
        const double of_stretch = 2.0 * (p.integral + 64.0 * 0x1p-53 * size);
        force_error_ +=
            p.value * sum + p.largest * stiffness * of_stretch + 4.0 * u * (g.largest + p.largest);
        slope_error_ += p.slope * sum + p.steepest * stiffness * of_stretch +
                        (2.0 * p.largest + p.value) * p.value * memory.sudden +
                        8.0 * u * (g.steepest + p.steepest + p.largest * p.largest * memory.sudden);
        // The coordinate grows with the distance from the domain
        rendering_error_ =
            128.0 * 0x1p-53 * p.largest * p.largest * stiffness * 0x1p31 * target_.encoder_step;
        const double energy = 0.5 * sum * farthest;
        energy_error_ += (sum + 0.5 * stiffness * of_stretch) * of_stretch;
        return energy;
    }

    /// Computes the error of a massless step. The lag e_k = memory e + F(x - memory e) / p changes by at most the factor
    /// rho = memory max|1 - F'/p| with the lag before it. If rho < 1, the errors of all steps before add up to the
    /// error of one step divided by 1 - rho.
    void bound_lag(double u) {
        const double p = scheme_.coupling.load_line_slope(target_.period_s);
        const double compliance = 1.0 / p - (scheme_.compensated ? 1.0 / scheme_.coupling.stiffness : 0.0);
        const NetworkCurve& curve = model_.network()->curve();
        Interval slopes = curve.slope_bounds().with({0.0, 0.0});
        for (const EdgeLine& line : {curve.below(), curve.above()}) {
            slopes = slopes.with({line.at_edge.slope, line.at_edge.slope});
        }
        const auto on_load_line = [&](double slope) { return slope / (1.0 + compliance * slope); };
        const Interval response{on_load_line(slopes.lower), on_load_line(slopes.upper)};
        const double rho =
            lag_.memory * std::max(std::abs(1.0 - response.lower / p), std::abs(1.0 - response.upper / p));
        double one_step = response_->errors()[0].value;
        for (const ExportedLine& line : response_lines_) {
            one_step = std::max(one_step, 4.0 * u * (std::abs(line.value) + std::abs(line.gain)));
        }
        step_error_lasts_ = rho < 1.0;
        const auto lasting = [&](double error, double largest) {
            const double farthest = largest / scheme_.coupling.stiffness;
            // In single precision the constants are rounded too
            const double of_lag = error / p + 8.0 * u * farthest;
            return error +
                   response.largest() *
                       (lag_.memory * (step_error_lasts_ ? of_lag / (1.0 - rho) : 0.0) + 4.0 * u * farthest);
        };
        step_error_ = lasting(one_step, std::min(target_.force_limit, response_->errors()[0].largest));
        rendering_error_ = step_error_lasts_ ? lasting(one_step + outside_error(), target_.force_limit)
                                             : std::numeric_limits<double>::infinity();
    }

    /// Returns a bound of the additional error of a force outside the domain, where at most the force limit is sent.
    [[nodiscard]] double outside_error() const noexcept {
        double largest = target_.force_limit;
        for (const std::array<ExportedLine, 2>& pair : lines_) {
            largest += 2.0 * std::max(std::abs(pair[0].value), std::abs(pair[1].value));
        }
        return periodic() ? 0.0 : 10.0 * unit_roundoff(target_.precision) * largest;
    }

    ForceModel model_;
    Scheme scheme_;
    ExportTarget target_;
    ExportedLag lag_;
    CellTable law_;
    std::optional<ExportedMemory> memory_;
    std::optional<CellTable> response_;
    std::vector<std::array<ExportedLine, 2>> lines_;
    std::array<ExportedLine, 2> response_lines_{};
    double force_error_ = 0.0;
    double slope_error_ = 0.0;
    double energy_error_ = 0.0;
    double step_error_ = 0.0;
    bool step_error_lasts_ = true;
    double rendering_error_ = 0.0;
};

}  // namespace palpate
