// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "palpate/portable/exported_model.hpp"

namespace palpate {

/// State of an exported model, as in the struct NAME_state of the exported header.
template <class Real>
struct ExportedState {
    std::int32_t anchor = 0;  ///< single precision: count at which the play operator moved last
    Real side = 0;            ///< single precision: direction state s at that count, -1, 0 or 1
    double play = 0.0;        ///< double precision: position of the play operator [m]
    std::array<std::int32_t, most_prediction_taps> past_counts{};
    std::array<double, most_prediction_taps> past{};
    std::uint32_t sum = 0;     ///< sum of the past counts, modulo 2^32
    std::uint32_t oldest = 0;  ///< index of the oldest past position
    Real lag = 0;              ///< lag of the object behind the device, x - y [counts or m]
    double coordinate = 0.0;   ///< coordinate u of the branches at the last tick
    std::array<double, most_branches> stretch{};  ///< stretch e_j of each branch
};

/// Evaluates an exported model with the arithmetic of the exported header: the same operations on the same numbers, in
/// the same order. `Real` is float or double. The header's functions have the same names.
template <class Real>
class ExportedForce {
  public:
    using State = ExportedState<Real>;
    static constexpr bool single = std::is_same_v<Real, float>;

    /// Force and its slope df/dx.
    struct Sample {
        Real force;
        Real slope;
    };

    explicit ExportedForce(const ExportedModel& model) : model_{model} {}

    [[nodiscard]] State start(std::int32_t count) const noexcept {
        State state;
        state.anchor = count;
        state.play = position(count);
        state.past_counts.fill(count);
        state.past.fill(position(count));
        state.sum = static_cast<std::uint32_t>(taps()) * static_cast<std::uint32_t>(count);
        if (model_.memory()) {
            double unused = 0.0;
            integrals(1, position(count), state.coordinate, unused);
        }
        return state;
    }

    void advance(State& state, std::int32_t count) const noexcept {
        if (model_.memory()) {
            (void)relaxed(state, count);
        } else if (model_.hysteretic()) {
            if constexpr (single) {
                (void)moved(state, count);
            } else {
                state.play = palpate::play(position(count), state.play, model_.play_radius());
            }
        }
    }

    [[nodiscard]] Sample force_slope(const State& state, std::int32_t count) const noexcept {
        if (model_.memory()) {
            State moved = state;
            return relaxed(moved, count);
        }
        if constexpr (single) {
            Real s = model_.hysteretic() ? direction(state, count) : Real{0};
            const bool sticks = s <= Real{1} && s >= Real{-1};
            s = limited(s, Real{1});
            return with_direction(place(model_.law(), count), s, sticks);
        } else {
            return at_position(state.play, position(count));
        }
    }
    [[nodiscard]] Real force(const State& state, std::int32_t count) const noexcept {
        return force_slope(state, count).force;
    }

    /// Returns the energy, computed in double precision [J].
    [[nodiscard]] Real energy(const State& state, std::int32_t count) const noexcept {
        const double x = position(count);
        double first = 0.0;
        double second = 0.0;
        integrals(0, x, first, second);
        if (model_.memory()) {
            State moved = state;
            (void)relaxed(moved, count);
            for (std::size_t j = 0; j < model_.memory()->stiffness.size(); ++j) {
                first += 0.5 * model_.memory()->stiffness[j] * moved.stretch[j] * moved.stretch[j];
            }
        }
        if (!model_.hysteretic()) {
            return static_cast<Real>(first);
        }
        const double r = model_.play_radius();
        const double before =
            single ? position(state.anchor) - static_cast<double>(state.side) * r : state.play;
        const double play = palpate::play(x, before, r);
        const double mean = first;
        double at_play = 0.0;
        double unused = 0.0;
        integrals(1, play, unused, at_play);
        integrals(1, x, first, second);
        return static_cast<Real>(mean + ((x - play) * first - (second - at_play)) / r);
    }

    /// Moves the structure by one tick and returns its force.
    [[nodiscard]] Real step(State& state, std::int32_t count) const noexcept {
        if constexpr (single) {
            if (!model_.periodic() && (model_.massless() || taps() > 0)) {
                count = std::clamp(count, -farthest_count, farthest_count);
            }
        }
        const Real limit = static_cast<Real>(model_.target().force_limit);
        if (model_.memory()) {
            return limited(relaxed(state, count).force, limit);
        }
        if (model_.massless()) {
            return limited_step(state, count, limit);
        }
        if (taps() > 0) {
            return limited(predicted_force(state, count), limit);
        }
        if constexpr (single) {
            const Real s = model_.hysteretic() ? moved(state, count) : Real{0};
            return limited(with_direction(place(model_.law(), count), s, false).force, limit);
        } else {
            advance(state, count);
            return limited(force(state, count), limit);
        }
    }

    /// Counts beyond this distance from zero are held there by steps that use positions between two counts.
    static constexpr std::int32_t farthest_count = 33'554'432;

  private:
    [[nodiscard]] double position(std::int32_t count) const noexcept {
        return static_cast<double>(count) * model_.target().encoder_step;
    }
    [[nodiscard]] int taps() const noexcept { return model_.scheme().predict; }

    [[nodiscard]] static Real limited(Real value, Real limit) noexcept {
        return value > limit ? limit : value < -limit ? -limit : value;
    }

    /// Moves the branches by one tick to a count and returns force and slope, as `MemoryForce` does. The tables have the
    /// number type of the export, the branches are doubles.
    [[nodiscard]] Sample relaxed(State& state, std::int32_t count) const noexcept {
        const ExportedMemory& memory = *model_.memory();
        const double limit = model_.target().force_limit;
        Place at;
        if constexpr (single) {
            at = place(model_.law(), count);
        } else {
            at = place(model_.law(), position(count));
        }
        const Sample g = value(model_.law(), model_.lines()[0], at, 0);
        const Sample p = value(model_.law(), model_.lines()[1], at, 1);
        double coordinate = 0.0;
        double sum = 0.0;
        integrals(1, position(count), coordinate, sum);
        const double moved = coordinate - state.coordinate;
        state.coordinate = coordinate;
        sum = 0.0;
        double stiffness = 0.0;
        for (std::size_t j = 0; j < memory.stiffness.size(); ++j) {
            const double stretch = memory.kept[j] * (state.stretch[j] + moved);
            state.stretch[j] = std::clamp(stretch, -memory.largest_stretch[j], memory.largest_stretch[j]);
            sum += memory.stiffness[j] * state.stretch[j];
            stiffness +=
                std::abs(stretch) > memory.largest_stretch[j] ? 0.0 : memory.stiffness[j] * memory.kept[j];
        }
        const double ratio = static_cast<double>(p.force);
        const double rest = std::clamp(static_cast<double>(g.force), -limit, limit);
        const double least = memory.contact > 0 ? std::min(rest, 0.0) : -limit;
        const double most = memory.contact < 0 ? std::max(rest, 0.0) : limit;
        const double unlimited = rest + ratio * sum;
        const double force = std::clamp(unlimited, least, most);
        double slope = 0.0;
        double factor = 1.0;
        if (force == unlimited) {
            slope =
                static_cast<double>(g.slope) + static_cast<double>(p.slope) * sum + ratio * ratio * stiffness;
        } else {
            factor = std::clamp((force - rest) / (unlimited - rest), 0.0, 1.0);
        }
        if (memory.contact != 0 && ratio == 0.0) {
            factor = 0.0;
        }
        for (std::size_t j = 0; j < memory.stiffness.size(); ++j) {
            state.stretch[j] *= factor;
        }
        return {static_cast<Real>(force), static_cast<Real>(slope)};
    }

    /// Returns the direction state s after a motion to a count, without its limits -1 and 1.
    [[nodiscard]] Real direction(const State& state, std::int32_t count) const noexcept {
        const auto now = static_cast<std::uint32_t>(count);
        const auto then = static_cast<std::uint32_t>(state.anchor);
        return count >= state.anchor ? state.side + static_cast<Real>(now - then) * per_play()
                                     : state.side - static_cast<Real>(then - now) * per_play();
    }
    /// Returns the change of the direction state for each count.
    [[nodiscard]] Real per_play() const noexcept {
        return static_cast<Real>(model_.target().encoder_step / model_.play_radius());
    }

    /// Moves the play operator to a count and returns the direction state s.
    [[nodiscard]] Real moved(State& state, std::int32_t count) const noexcept {
        Real s = direction(state, count);
        if (s > Real{1} || s < Real{-1}) {
            s = limited(s, Real{1});
            state.anchor = count;
            state.side = s;
        }
        return s;
    }

    [[nodiscard]] Real predicted_force(State& state, std::int32_t count) const noexcept {
        const auto m = static_cast<std::uint32_t>(taps());
        if constexpr (single) {
            const auto now = static_cast<std::uint32_t>(count);
            const auto motion = static_cast<std::int32_t>(m * now - state.sum);
            const auto parts = static_cast<std::int32_t>(m * (m + 1));
            const std::int32_t whole = motion / parts;
            const Real fraction = static_cast<Real>(motion - whole * parts) *
                                  static_cast<Real>(1.0 / static_cast<double>(parts));
            state.sum += now - static_cast<std::uint32_t>(state.past_counts[state.oldest]);
            state.past_counts[state.oldest] = count;
            state.oldest = state.oldest + 1 == m ? 0 : state.oldest + 1;
            const auto ahead = static_cast<std::int32_t>(now + static_cast<std::uint32_t>(whole));
            Real s = 0;
            if (model_.hysteretic()) {
                (void)moved(state, count);
                const auto distance = static_cast<std::int32_t>(static_cast<std::uint32_t>(ahead) -
                                                                static_cast<std::uint32_t>(state.anchor));
                s = limited(state.side + (static_cast<Real>(distance) + fraction) * per_play(), Real{1});
            }
            return with_direction(place(model_.law(), ahead, fraction), s, false).force;
        } else {
            const double x = position(count);
            double motion = 0.0;
            for (std::uint32_t j = 0; j < m; ++j) {
                motion += x - state.past[j];
            }
            const double ahead = x + motion * (1.0 / static_cast<double>(m * (m + 1)));
            state.past[state.oldest] = x;
            state.oldest = state.oldest + 1 == m ? 0 : state.oldest + 1;
            advance(state, count);
            return at_position(state.play, ahead).force;
        }
    }

    [[nodiscard]] Real limited_step(State& state, std::int32_t count, Real limit) const noexcept {
        const Real back = static_cast<Real>(model_.lag().memory) * state.lag;
        const CellTable& table = *model_.response();
        const auto& lines = model_.response_lines();
        Real force = 0;
        if constexpr (single) {
            const auto whole = static_cast<std::int32_t>(back);
            const auto z = static_cast<std::int32_t>(static_cast<std::uint32_t>(count) -
                                                     static_cast<std::uint32_t>(whole));
            const Real fraction = static_cast<Real>(whole) - back;
            force = value(table, lines, place(table, z, fraction), 0).force;
        } else {
            force = value(table, lines, place(table, position(count) - back), 0).force;
        }
        force = limited(force, limit);
        state.lag = back + force * static_cast<Real>(model_.lag().compliance);
        return force;
    }

    /// Place of a position in a table.
    struct Place {
        int side = 0;          ///< -1 below the domain, 1 above it, 0 inside
        Real distance = 0;     ///< outside: distance from the domain [counts or m]
        std::size_t cell = 0;  ///< inside: number of the cell
        Real t = 0;            ///< inside: place in the cell
        Real per_width = 0;    ///< inside: 1 / width of the cell [1/m]
    };

    /// Returns the force g + s h and its slope at a place.
    [[nodiscard]] Sample with_direction(const Place& at, Real s, bool sticks) const noexcept {
        const Sample g = value(model_.law(), model_.lines()[0], at, 0);
        if (!model_.hysteretic()) {
            return g;
        }
        const Sample h = value(model_.law(), model_.lines()[1], at, 1);
        const Real force = g.force + s * h.force;
        const Real slope = g.slope + s * h.slope;
        return {force, sticks ? slope + h.force * static_cast<Real>(1.0 / model_.play_radius()) : slope};
    }

    /// Returns force and slope in double precision at a position, with the play operator at `before`.
    [[nodiscard]] Sample at_position(double before, double x) const noexcept {
        const Place at = place(model_.law(), x);
        const Sample g = value(model_.law(), model_.lines()[0], at, 0);
        if (!model_.hysteretic()) {
            return g;
        }
        const double r = model_.play_radius();
        const double play = palpate::play(x, before, r);
        const Real s = static_cast<Real>((x - play) * (1.0 / r));
        const Sample h = value(model_.law(), model_.lines()[1], at, 1);
        const Real slope = g.slope + s * h.slope;
        return {g.force + s * h.force, play == before ? slope + h.force * static_cast<Real>(1.0 / r) : slope};
    }

    /// Returns the place of a count in a table.
    [[nodiscard]] Place place(const CellTable& table, std::int32_t count) const noexcept {
        const CellGrid& grid = table.grid();
        const auto now = static_cast<std::uint32_t>(count);
        const auto first = static_cast<std::uint32_t>(grid.first_count);
        const auto last = static_cast<std::uint32_t>(grid.last_count);
        if (!grid.periodic && now - first > last - first) {
            const bool below = count < grid.first_count;
            return {below ? -1 : 1,
                    static_cast<Real>(below ? first - now : now - last) - offset(table, below), 0, 0, 0};
        }
        return in_cell(table, phase(grid, count));
    }

    /// Returns the place of a count plus a fraction of a count in a table.
    [[nodiscard]] Place place(const CellTable& table, std::int32_t count, Real fraction) const noexcept {
        const CellGrid& grid = table.grid();
        const std::uint32_t at =
            phase(grid, count) + static_cast<std::uint32_t>(static_cast<std::int32_t>(
                                     fraction * static_cast<Real>(grid.phase_per_count())));
        if (!grid.periodic && (static_cast<std::uint32_t>(count) - static_cast<std::uint32_t>(grid.origin) >
                                   static_cast<std::uint32_t>(grid.last_count - grid.origin + 1) ||
                               at - grid.phase_lower > grid.phase_upper - grid.phase_lower)) {
            const bool below = count < grid.first_count + (grid.last_count - grid.first_count) / 2;
            const Real counts = static_cast<Real>(below ? grid.first_count - count : count - grid.last_count);
            return {below ? -1 : 1, (below ? counts - fraction : counts + fraction) - offset(table, below), 0,
                    0, 0};
        }
        return in_cell(table, at);
    }

    /// Returns the distance of the outermost count of the domain from the end of the domain [counts].
    [[nodiscard]] Real offset(const CellTable& table, bool below) const noexcept {
        const auto& lines = &table == &model_.law() ? model_.lines()[0] : model_.response_lines();
        return static_cast<Real>(lines[below ? 0 : 1].offset);
    }

    [[nodiscard]] static std::uint32_t phase(const CellGrid& grid, std::int32_t count) noexcept {
        if (grid.periodic) {
            const auto wide = static_cast<std::uint64_t>(static_cast<std::int64_t>(count));
            return static_cast<std::uint32_t>((wide * grid.phase_step + grid.phase_start) >> 32U);
        }
        return (static_cast<std::uint32_t>(count) - static_cast<std::uint32_t>(grid.origin)) << grid.shift;
    }

    [[nodiscard]] Place in_cell(const CellTable& table, std::uint32_t phase) const noexcept {
        const CellGrid& grid = table.grid();
        const std::uint32_t split = table.splits()[phase >> (32U - grid.bits)];
        const std::uint32_t rest = phase << grid.bits;
        const std::uint32_t k = split & 15U;
        return {0, 0, (split >> 4U) + ((rest >> 1U) >> (31U - k)),
                static_cast<Real>(static_cast<std::int32_t>((rest << k) ^ 0x80000000U)) *
                    static_cast<Real>(0x1p-32),
                static_cast<Real>(1.0 / grid.width(k))};
    }

    /// Returns the place of a position in a table, in the arithmetic of doubles.
    [[nodiscard]] Place place(const CellTable& table, double x) const noexcept {
        const CellGrid& grid = table.grid();
        double within = x;
        if (grid.periodic) {
            (void)wrapped(grid, within);
        } else if (!(x >= grid.lower && x <= grid.upper)) {
            Place at;
            at.side = x < grid.lower ? -1 : 1;
            at.distance = static_cast<Real>(x < grid.lower ? grid.lower - x : x - grid.upper);
            return at;
        }
        return in_cell(table, within);
    }

    /// Moves a position into the first period, and returns the number of periods by which it is moved.
    [[nodiscard]] static double wrapped(const CellGrid& grid, double& x) noexcept {
        const double period = grid.upper - grid.lower;
        const double turns = std::floor((x - grid.lower) * (1.0 / period));
        x -= turns * period;
        x = x < grid.lower ? grid.lower : x > grid.upper ? grid.upper : x;
        return turns;
    }

    /// A cell of a table and the place in it.
    struct Cell {
        std::size_t number;
        std::uint32_t k;  ///< the cell is 2^k times narrower than a coarse cell
        double t;         ///< distance from the middle of the cell, divided by the width of the cell
    };

    [[nodiscard]] static Cell cell_at(const CellTable& table, double x) noexcept {
        const CellGrid& grid = table.grid();
        const double along = (x - grid.start) * (1.0 / grid.coarse_width);
        auto coarse = static_cast<std::uint32_t>(along);
        const auto last = static_cast<std::uint32_t>(table.splits().size() - 1);
        coarse = coarse > last ? last : coarse;
        const std::uint32_t split = table.splits()[coarse];
        const std::uint32_t k = split & 15U;
        const double part = (along - static_cast<double>(coarse)) * static_cast<double>(1U << k);
        auto cell = static_cast<std::uint32_t>(part);
        cell = cell > (1U << k) - 1U ? (1U << k) - 1U : cell;
        return {(split >> 4U) + cell, k, part - static_cast<double>(cell) - 0.5};
    }

    [[nodiscard]] Place in_cell(const CellTable& table, double x) const noexcept {
        const Cell cell = cell_at(table, x);
        Place at;
        at.cell = cell.number;
        at.t = static_cast<Real>(cell.t);
        at.per_width = static_cast<Real>(1.0 / table.grid().width(cell.k));
        return at;
    }

    /// Returns value and slope of curve n of a table at a place.
    [[nodiscard]] Sample value(const CellTable& table, const std::array<ExportedLine, 2>& lines,
                               const Place& at, std::size_t n) const noexcept {
        if (at.side != 0) {
            const ExportedLine& line = lines[at.side < 0 ? 0 : 1];
            if (at.distance >= static_cast<Real>(line.reach)) {
                return {Real{0}, Real{0}};
            }
            return {static_cast<Real>(line.value) + static_cast<Real>(line.gain) * at.distance,
                    static_cast<Real>(line.slope)};
        }
        const double* c =
            table.coefficients().data() + (at.cell * table.curves().size() + n) * CellTable::terms;
        Real p = static_cast<Real>(c[5]);
        Real d = p;
        p = p * at.t + static_cast<Real>(c[4]);
        for (std::size_t j = 4; j-- > 0;) {
            d = d * at.t + p;
            p = p * at.t + static_cast<Real>(c[j]);
        }
        return {p, d * at.per_width};
    }

    /// Computes the first two antiderivatives of curve n of the law at a position, in the arithmetic of doubles.
    void integrals(std::size_t n, double x, double& first, double& second) const noexcept {
        const CellGrid& grid = model_.law().grid();
        const NetworkCurve& curve = model_.law().curves()[n].curve();
        if (grid.periodic) {
            const double turns = wrapped(grid, x);
            integrals_in_cell(n, x, first, second);
            const Curve& a = curve.below().at_edge;
            const Curve& b = curve.above().at_edge;
            const double period = grid.upper - grid.lower;
            const double along = x - grid.lower;
            const double turn = b.integral - a.integral;
            const double double_turn = b.double_integral - a.double_integral - a.integral * period;
            first += turns * turn - a.integral;
            second += turns * (turn * along + double_turn + 0.5 * (turns - 1.0) * turn * period) -
                      a.double_integral - a.integral * along;
        } else if (x < grid.lower || x > grid.upper) {
            const EdgeLine& line = x < grid.lower ? curve.below() : curve.above();
            const double d = x - line.edge;
            const double inside = d > line.reach ? line.reach : d < -line.reach ? -line.reach : d;
            const Curve& e = line.at_edge;
            first = e.integral + (e.value + 0.5 * e.slope * inside) * inside;
            second = e.double_integral +
                     (e.integral + (0.5 * e.value + e.slope * (1.0 / 6.0) * inside) * inside) * inside +
                     first * (d - inside);
        } else {
            integrals_in_cell(n, x, first, second);
        }
    }

    void integrals_in_cell(std::size_t n, double x, double& first, double& second) const noexcept {
        const CellTable& table = model_.law();
        const Cell cell = cell_at(table, x);
        const double t = cell.t;
        const double u = t * table.grid().width(cell.k);
        const std::size_t row = cell.number * table.curves().size() + n;
        const double* c = table.coefficients().data() + row * CellTable::terms;
        const double* middle = table.integrals().data() + 2 * row;
        const double once =
            ((((c[5] / 6.0 * t + c[4] / 5.0) * t + c[3] / 4.0) * t + c[2] / 3.0) * t + c[1] / 2.0) * t + c[0];
        const double twice =
            ((((c[5] / 42.0 * t + c[4] / 30.0) * t + c[3] / 20.0) * t + c[2] / 12.0) * t + c[1] / 6.0) * t +
            c[0] / 2.0;
        first = middle[0] + u * once;
        second = middle[1] + u * (middle[0] + u * twice);
    }

    const ExportedModel& model_;
};

}  // namespace palpate
