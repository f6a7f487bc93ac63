// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "palpate/portable/exported_force.hpp"
#include "palpate/portable/exported_model.hpp"
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/solver/inverse_table.hpp"

namespace palpate {

/// Largest differences between an exported model and the core, each divided by its proved bound: at most 1.
struct ExportCheck {
    double force = 0.0;
    double slope = 0.0;
    double energy = 0.0;
    double step = 0.0;
    std::size_t places = 0;  ///< number of counts that were compared

    /// Returns true if every difference is within its bound. NaN is not.
    [[nodiscard]] bool passed() const noexcept {
        return force <= 1.0 && slope <= 1.0 && energy <= 1.0 && step <= 1.0;
    }
};

namespace detail {

template <class Real>
class ExportComparison {
  public:
    ExportComparison(const ExportedModel& model, std::uint64_t seed)
        : model_{model}, exported_{model}, random_{seed} {
        for (const auto& lines : model.lines()) {
            at_ends_ += std::max(std::abs(lines[0].value), std::abs(lines[1].value));
        }
    }

    /// Compares at the counts at both sides of every cell border, at both ends of the domain and of the integers, and at
    /// random counts.
    [[nodiscard]] ExportCheck run(std::size_t random_counts) {
        if (model_.model().memory() != nullptr) {
            return run_memory(random_counts);
        }
        for (const std::int32_t count : notable_counts()) {
            compare_at(count);
        }
        for (std::size_t k = 0; k < random_counts; ++k) {
            compare_at(any_count());
        }
        compare_steps(random_counts);
        return check_;
    }

  private:
    [[nodiscard]] std::vector<std::int32_t> notable_counts() const {
        const CellGrid& grid = model_.law().grid();
        std::vector<std::int32_t> counts{std::numeric_limits<std::int32_t>::min(),
                                         std::numeric_limits<std::int32_t>::max(),
                                         0,
                                         grid.first_count - 1,
                                         grid.first_count,
                                         grid.last_count,
                                         grid.last_count + 1};
        for (std::size_t k = 0; k < model_.law().splits().size(); ++k) {
            const std::uint32_t split = model_.law().splits()[k] & 15U;
            const double start = grid.start + static_cast<double>(k) * grid.coarse_width;
            for (std::size_t j = 0; j < (std::size_t{1} << split); ++j) {
                const double border = start + static_cast<double>(j) * grid.width(split);
                const auto count = static_cast<std::int32_t>(std::floor(border / grid.encoder_step));
                counts.push_back(count);
                counts.push_back(count + 1);
            }
        }
        return counts;
    }

    /// Returns a random count: most within twice the domain, some anywhere.
    [[nodiscard]] std::int32_t any_count() {
        const CellGrid& grid = model_.law().grid();
        const std::int32_t travel = grid.last_count - grid.first_count;
        if (random_() % 16 == 0) {
            return static_cast<std::int32_t>(static_cast<std::uint32_t>(random_()));
        }
        return std::uniform_int_distribution<std::int32_t>{grid.first_count - travel / 2,
                                                           grid.last_count + travel / 2}(random_);
    }

    static void add(double& worst, double difference, double bound) noexcept {
        const double share = std::abs(difference) / bound;
        worst = share > worst || std::isnan(share) ? share : worst;
    }

    /// Returns the additional error that rounding of a distant position causes in the core too.
    [[nodiscard]] double far_away(double x) const noexcept {
        return model_.periodic() ? 8.0 * 0x1p-53 * std::abs(x) : 0.0;
    }

    /// Compares single ticks of a memory from the same states: at the borders of the cells, at random counts and along
    /// a random motion.
    [[nodiscard]] ExportCheck run_memory(std::size_t random_counts) {
        const MemoryNetwork& memory = *model_.model().memory();
        const MemoryForce<NetworkCurve> law{model_.model().network()->curve(), memory.ratio(), memory,
                                            model_.target().period_s, model_.target().force_limit};
        const double step = model_.target().encoder_step;
        auto state = law.start(0.0);
        const auto tick = [&](std::int32_t count) {
            compare_tick(law, state, count);
            law.advance(count * step, state);
            ++check_.places;
        };
        for (const std::int32_t count : notable_counts()) {
            tick(any_count());
            tick(count);
        }
        const double travel = model_.law().grid().last_count - model_.law().grid().first_count;
        double place = 0.5 * travel + model_.law().grid().first_count;
        for (std::size_t k = 0; k < random_counts; ++k) {
            place += std::uniform_real_distribution<double>{-1.0, 1.0}(random_) * 0.02 * travel;
            place = std::clamp(place, model_.law().grid().first_count - 0.2 * travel,
                               model_.law().grid().last_count + 0.2 * travel);
            tick(k % 2 == 0 ? static_cast<std::int32_t>(place) : any_count());
        }
        return check_;
    }

    template <class Law>
    void compare_tick(const Law& law, const typename Law::State& state, std::int32_t count) {
        ExportedState<Real> exported;
        exported.coordinate = state.coordinate;
        exported.stretch = state.stretch;
        const EnvironmentSample right = law.at(count * model_.target().encoder_step, state);
        const auto found = exported_.force_slope(exported, count);
        const double energy = exported_.energy(exported, count);
        double outside = 0.0;
        if (right.extrapolated) {
            outside = 2.0 * at_ends_;
            for (const ResponseCurve& curve : model_.law().curves()) {
                outside += std::abs(curve.curve().at(count * model_.target().encoder_step).value);
            }
            outside *= 16.0 * unit_roundoff(model_.target().precision);
        }
        add(check_.force, found.force - right.force, model_.force_error() + outside);
        const double step = exported_.step(exported, count);
        add(check_.step, step - right.force, model_.step_error() + outside);
        add(check_.step, step - right.force, model_.rendering_error());
        bool slips = false;
        const ExportedMemory& memory = *model_.memory();
        for (std::size_t j = 0; j < memory.stiffness.size(); ++j) {
            slips = slips || std::abs(exported.stretch[j]) > (1.0 - 1e-6) * memory.largest_stretch[j];
        }
        if (right.extrapolated || slips || right.slope == 0.0 || found.slope == Real{0}) {
            return;  // at a limit rounding decides which branches slip, and by which factor stretches are reduced
        }
        add(check_.slope, found.slope - right.slope, model_.slope_error());
        add(check_.energy, energy - right.energy,
            model_.energy_error() + 8.0 * unit_roundoff(model_.target().precision) * std::abs(right.energy));
    }

    void compare_at(std::int32_t count) {
        std::visit(
            [&](const auto& law) {
                if constexpr (requires { law.curve(); } || requires { law.hysteresis_force(); }) {
                    compare(law, count);
                }
            },
            model_.model().kind());
        ++check_.places;
    }

    template <class Law>
    void compare(const Law& law, std::int32_t count) {
        const double step = model_.target().encoder_step;
        const double x = count * step;
        const std::int32_t before = any_count();
        const std::int32_t then = random_() % 2 == 0 ? any_count() : near(count);
        auto exported = exported_.start(before);
        exported_.advance(exported, then);
        auto state = law.start(before * step);
        law.advance(then * step, state);
        const EnvironmentSample right = law.at(x, state);
        const auto found = exported_.force_slope(exported, count);
        const double slope = steepest();
        const double outside =
            right.extrapolated ? model_.outside_share() * (std::abs(right.force) + 2.0 * at_ends_) : 0.0;
        add(check_.force, found.force - right.force,
            model_.force_error() + outside + slope * (far_away(x) + far_away(then * step)));
        const double energy_scale = std::abs(right.energy) + std::abs(right.force * x);
        add(check_.energy, exported_.energy(exported, count) - right.energy,
            model_.energy_error() + 8.0 * unit_roundoff(model_.target().precision) * energy_scale +
                (right.extrapolated || model_.periodic() ? 1e-9 * energy_scale : 0.0));
        if (!right.extrapolated && !at_the_end_of_play(law, state, x)) {
            const double curvature = slope / law_width();
            add(check_.slope, found.slope - right.slope,
                model_.slope_error() + curvature * (far_away(x) + far_away(then * step)));
        }
    }

    [[nodiscard]] std::int32_t near(std::int32_t count) {
        const double radius = 4.0 * model_.play_radius() / model_.target().encoder_step + 2.0;
        const double moved =
            count + std::uniform_real_distribution<double>{-1.0, 1.0}(random_)*std::min(radius, 1e6);
        return static_cast<std::int32_t>(std::clamp(moved, -0x1p31, 0x1p31 - 1.0));
    }

    /// Returns true if rounding decides whether the play operator moves, which changes the slope by h / r.
    template <class Law>
    [[nodiscard]] bool at_the_end_of_play(const Law& law, const typename Law::State& state, double x) const {
        if constexpr (requires { state.play; }) {
            const double s = (x - state.play) / law.play_radius();
            return std::abs(std::abs(s) - 1.0) < 1e-4;
        } else {
            return false;
        }
    }

    [[nodiscard]] double steepest() const noexcept {
        double slope = 0.0;
        for (const CurveErrors& errors : model_.law().errors()) {
            slope += errors.steepest + errors.largest / std::max(model_.play_radius(), 1e-300) *
                                           (model_.hysteretic() ? 1.0 : 0.0);
        }
        return slope;
    }
    [[nodiscard]] double law_width() const noexcept {
        return std::ldexp(model_.law().grid().coarse_width, -static_cast<int>(CellTable::deepest_split));
    }

    /// Compares the force of the structure with that of the core over a random motion.
    void compare_steps(std::size_t ticks) {
        const double limit = model_.target().force_limit;
        const double period = model_.target().period_s > 0.0 ? model_.target().period_s : 1e-3;
        AnyStructure structure = make_structure(model_.model(), model_.scheme(), period, limit);
        const double step = model_.target().encoder_step;
        const CellGrid& grid = model_.law().grid();
        const double travel = grid.last_count - grid.first_count;
        double count = 0.5 * (grid.first_count + grid.last_count);
        auto state = exported_.start(static_cast<std::int32_t>(count));
        structure.reset(static_cast<std::int32_t>(count) * step);
        double speed = 0.0;
        const double of_core = error_of_core(period);
        bool was_outside = false;
        for (std::size_t k = 0; k < ticks; ++k) {
            speed =
                0.98 * speed + std::uniform_real_distribution<double>{-1.0, 1.0}(random_) * 0.003 * travel;
            count =
                std::clamp(count + speed, grid.first_count - 0.2 * travel, grid.last_count + 0.2 * travel);
            const auto now = static_cast<std::int32_t>(count);
            const Rendered rendered = structure.step(now * step);
            const double right = std::clamp(rendered.force, -limit, limit);
            const double found = exported_.step(state, now);
            // A massless object keeps a part of the errors that it made outside the domain
            was_outside = rendered.extrapolated || (was_outside && model_.massless());
            const double outside = was_outside ? 16.0 * unit_roundoff(model_.target().precision) *
                                                     (std::abs(right) + 2.0 * at_ends_)
                                               : 0.0;
            add(check_.step, found - right, model_.step_error() + of_core + outside);
            add(check_.step, found - right, model_.rendering_error() + of_core);
        }
    }

    /// Returns a bound of the core's own error of a massless force F = q - p y, from the error of its tables of y. The
    /// errors of past steps add up to at most p / K_c times that of one step.
    [[nodiscard]] double error_of_core(double period) const noexcept {
        if (!model_.massless()) {
            return 0.0;
        }
        const VirtualCoupling& coupling = model_.scheme().coupling;
        const double p = coupling.load_line_slope(period);
        const CellGrid& grid = model_.law().grid();
        return 2.0 * p * (p / coupling.stiffness) * ResolventOptions{}.relative_error *
               (grid.upper - grid.lower);
    }

    const ExportedModel& model_;
    ExportedForce<Real> exported_;
    std::mt19937_64 random_;
    double at_ends_ = 0.0;
    ExportCheck check_;
};

}  // namespace detail

/// Compares an exported model with the core, at all borders of its cells, at `random_counts` random counts and over a
/// random motion of as many ticks.
[[nodiscard]] inline ExportCheck checked_export(const ExportedModel& model, std::size_t random_counts,
                                                std::uint64_t seed = 1) {
    return model.single() ? detail::ExportComparison<float>{model, seed}.run(random_counts)
                          : detail::ExportComparison<double>{model, seed}.run(random_counts);
}

}  // namespace palpate
