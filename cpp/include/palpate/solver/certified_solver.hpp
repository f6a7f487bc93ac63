// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "palpate/model/bounds.hpp"
#include "palpate/model/derivatives.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/model/parameters.hpp"
#include "palpate/solver/newton.hpp"
#include "palpate/solver/piecewise_force.hpp"
#include "palpate/status.hpp"

namespace palpate {

namespace detail {

/// Derivatives of a function in the middle of a cell, bounds of their rounding errors, and bounds of the derivatives over
/// the cell.
struct Expansion {
    Derivatives middle{};
    Derivatives rounding{};
    DerivativeBounds over{};
};

/// Returns the derivatives of the force g + s h, in which the direction state s changes with the position by `by_radius`
/// (1 / r while the play operator sticks, otherwise 0). Fills the elements 1 to 4 and `over[5]`.
[[nodiscard]] inline Expansion sheet(const Expansion& g, const Expansion& h, double s,
                                     double by_radius) noexcept {
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    Expansion f;
    for (std::size_t n = 1; n < f.middle.size(); ++n) {
        const double times = static_cast<double>(n) * by_radius;
        f.middle[n] = g.middle[n] + s * h.middle[n] + times * h.middle[n - 1];
        f.rounding[n] =
            g.rounding[n] + std::abs(s) * h.rounding[n] + times * h.rounding[n - 1] +
            8.0 * epsilon *
                (std::abs(g.middle[n]) + std::abs(s * h.middle[n]) + times * std::abs(h.middle[n - 1]));
    }
    f.over[5] = g.over[5] + std::abs(s) * h.over[5] + 5.0 * by_radius * h.over[4];
    return f;
}

/// Returns c = max|F''| / (2 min F') of F(y) = f(y) + p y over a cell of half width r, by Taylor's formula about its
/// middle. Returns infinity if 8 r max|F''| < min F', condition (C) of `CertifiedSolver`, is not proved.
[[nodiscard]] inline double proved_curvature(const Expansion& f, double p, double r) noexcept {
    const auto& [force, f1, f2, f3, f4] = f.middle;
    const auto& [of_force, e1, e2, e3, e4] = f.rounding;
    double lowest = -std::abs(f2) * r + 0.5 * f3 * r * r;
    if (std::abs(f2) < f3 * r) {
        lowest = -0.5 * f2 * f2 / f3;
    }
    const double fourth = std::abs(f4) + e4;
    const double fifth = f.over[5];
    const double of_slope = e1 + 8.0 * std::numeric_limits<double>::epsilon() * std::abs(p);
    const double least =
        p + f1 + lowest - of_slope - r * (e2 + r * (0.5 * e3 + r * (fourth / 6.0 + r * fifth / 24.0)));
    const double most = std::abs(f2) + e2 + r * (std::abs(f3) + e3 + r * (0.5 * fourth + r * fifth / 6.0));
    return 8.0 * r * most < least ? 0.5 * most / least : std::numeric_limits<double>::infinity();
}

}  // namespace detail

/// Solves the load line f(y) + p y = q for the position y in at most four evaluations of the force f, for every start
/// and every q. This requires a slope p for which F(y) = f(y) + p y is proved to rise everywhere. For other slopes
/// `LoadLineSolver` searches from the last position.
///
/// When the model is loaded, the constructor divides all positions into cells of width w with
///
///     w max|F''| <= min F' / 4.                                                                        (C)
///
/// Taylor's formula about the middle of each cell proves condition (C), and F is stored at the borders of the cells. As
/// the cells cover all positions, F rises everywhere. `solve` finds the cell with F = q by the values at the borders,
/// interpolates linearly between them and applies Newton's method inside the cell:
/// - The error of the linear interpolation is at most w^2 max|F''| / 8 in F and w/32 in the position. A first guess
///   that differs from the interpolated position by at most w/32, such as the tangent of the last solution, differs
///   from the solution by at most w/16.
/// - A Newton step reduces a position error e to at most c e^2 with c = max|F''| / (2 min F') <= 1/(8w). The errors are
///   w/16, w/2^11, w/2^25, w/2^53. Limiting the position to the cell does not increase the error, because the cell
///   contains the solution.
/// - The correction d of a Newton step gives a bound of the error e before the step: e <= |d| + c e^2 <= |d| + e/8. The
///   error after the step is at most (64/49) c d^2. If this error is below `tolerance`, or the residual F(y) - q is
///   below rounding, the solution needs no evaluation to confirm it.
///
/// If the tangent of the last solution predicts a position in the same cell, `solve` tries this position before it
/// searches for the cell. Most ticks of a slow motion then need one evaluation; the other ticks need at most three
/// more.
///
/// A force with hysteresis (mean force g, hysteresis h, play radius r) has three sheets. These are functions F with g +
/// h (press), with g - h (release) and with g + (y - play) h / r (sticking: the play operator does not move). Each
/// sheet rises and satisfies (C), the sticking sheet for all |y - play| <= r + w, so the same cells are valid for every
/// position `play` of the play operator. F is the median of the three sheets. The median of the three interpolations,
/// or of the three Newton steps, is as accurate as each of them for its sheet. At the solution two sheets are >= q and
/// two are <= q. Two of the Newton steps therefore end below the solution (except for c e^2), and two above the
/// solution.
class CertifiedSolver {
  public:
    /// State between two calls of `solve`: the last solution, its tangent as a function of q, and the interval of
    /// positions around it in which F is smooth.
    struct Memory {
        double position = 0.0;  ///< solution of the last call [m]
        /// Position at which the tangent to F, drawn at the last solution, has the value 0 [m]
        double at_zero = 0.0;
        double compliance = 0.0;  ///< 1 / F' at the last solution [m/N]
        /// Lower end of the interval around the last solution in which F is smooth; low > high: no prediction [m]
        double low = std::numeric_limits<double>::infinity();
        /// Upper end of the interval around the last solution over which F is smooth [m]
        double high = -std::numeric_limits<double>::infinity();
        /// c = max|F''| / (2 min F') over the cell that contains the last solution [1/m]
        double curvature = 0.0;
        double play = 0.0;  ///< position of the play operator at the last solution [m]

        Memory() = default;
        explicit Memory(double at) noexcept : position{at} {}
    };

    CertifiedSolver(const PiecewiseForce& force, double p)
        : CertifiedSolver{force, zero_hysteresis(force), 0.0, p} {}
    CertifiedSolver(const HysteresisNetwork& pair, double p)
        : CertifiedSolver{piecewise(pair, 0.0), piecewise_hysteresis(pair), pair.play_radius(), p} {}

    [[nodiscard]] static constexpr bool tabulated() noexcept { return false; }
    /// Returns true if it is proved that every load line of slope p has exactly one solution.
    [[nodiscard]] bool unique(double p) const noexcept { return p >= least_slope_; }
    /// Returns the solver for load lines that are not proved to have exactly one solution.
    [[nodiscard]] const LoadLineSolver& uncertified() const noexcept { return search_; }
    [[nodiscard]] std::size_t cells() const noexcept { return borders_.empty() ? 0 : borders_.size() - 1; }

    /// Returns the position on the load line with its force, and updates `memory` with this solution.
    template <Environment E>
    [[nodiscard, gnu::always_inline]] inline Solution solve(const E& environment,
                                                            const typename E::State& state, LoadLine line,
                                                            Memory& memory) const noexcept {
        const double y = memory.at_zero + line.intercept * memory.compliance;
        if (!(y > memory.low && y < memory.high && play_of(state) == memory.play && unique(line.slope))) {
            return from_borders(environment, state, line, memory, y, 0);
        }
        const EnvironmentSample sample = environment.at(y, state);
        // Newton's correction without a division: 1 / F' is the last compliance times a geometric series, of which
        // three terms are used. The relative error of the correction is slope_mismatch^3.
        const double first_correction =
            (sample.force + (line.slope * y - line.intercept)) * memory.compliance;
        const double slope_mismatch =
            (1.0 - memory.compliance * line.slope) - memory.compliance * sample.slope;
        const double correction =
            -first_correction - first_correction * (slope_mismatch + slope_mismatch * slope_mismatch);
        // F' changes by at most a quarter over a cell. The cell contains the solution if its ends are farther from y
        // than `reach`.
        const double reach = 3.0 * std::abs(correction);
        const double remaining_error =
            2.0 * (std::abs(first_correction * slope_mismatch) * (slope_mismatch * slope_mismatch) +
                   memory.curvature * (correction * correction));
        if (!(remaining_error <= tolerance_ && std::abs(slope_mismatch) <= 0.25 && y - reach >= memory.low &&
              y + reach <= memory.high)) {
            return from_borders(environment, state, line, memory, y + correction, 1);
        }
        return found(sample, y + correction, 1.0 / (line.slope + sample.slope), line, 1, memory);
    }

    /// Searches a solution of the load line, starting at the last solution in `memory`. It is not proved that the load
    /// line has only one solution.
    template <Environment E>
    [[nodiscard]] Solution search(const E& environment, const typename E::State& state, LoadLine line,
                                  Memory& memory) const noexcept {
        const Solution solution = search_.solve(environment, state, line, memory.position);
        if (solution.status != Status::NonFinite) {
            memory = Memory{solution.position};
        }
        return solution;
    }

  private:
    static constexpr double infinity = std::numeric_limits<double>::infinity();
    static constexpr double epsilon = std::numeric_limits<double>::epsilon();

    /// A border between two cells of positions; `curvature` is c = max|F''| / (2 min F') over the cell above the
    /// border.
    struct Border {
        double position;
        double force;       ///< force f at the border; for a model with hysteresis, mean force g [N]
        double hysteresis;  ///< hysteresis h [N]
        double curvature;
    };

    /// An interval of positions. Cell k lies between border k - 1 and border k. The first cell begins at -infinity, the
    /// last cell ends at +infinity.
    struct Cell {
        double low;
        double high;
        double curvature;
    };

    /// Index of a cell in the first period of the force, and the whole periods from this cell to the position, as a
    /// distance [m].
    struct Place {
        std::size_t cell;
        double turn_offset;
    };

    /// An interval of positions with the networks of force and hysteresis; a straight line is a network without
    /// wavelets.
    struct Piece {
        Interval positions;
        NetworkParameters force;
        NetworkParameters hysteresis;
    };

    /// Result of one step of Newton's method.
    struct Trial {
        double position;
        double correction;
        double compliance;  ///< 1 / F' at the position at which this step evaluated F [m/N]
        /// p plus the largest of the slopes of press force, release force and sticking force [N/m]
        double steepest;
        EnvironmentSample sample;
    };

    CertifiedSolver(const PiecewiseForce& force, const PiecewiseForce& hysteresis, double radius, double p)
        : radius_{radius},
          by_radius_{radius > 0.0 ? 1.0 / radius : 0.0},
          travel_{force.upper - force.lower},
          period_{force.periodic ? travel_ : 0.0},
          tolerance_{1e-13 * travel_} {
        search_.longest_step = 0.25 * travel_;
        for (const double alpha : force.network.alpha) {
            search_.longest_step = std::min(search_.longest_step, 0.25 / alpha);
        }
        if (radius > 0.0) {
            search_.longest_step = std::min(search_.longest_step, 0.5 * radius);
        }
        if (std::isfinite(p)) {
            cut(pieces_of(force, hysteresis), p);
        }
    }

    template <class State>
    [[nodiscard]] static double play_of(const State& state) noexcept {
        if constexpr (requires { state.play; }) {
            return state.play;
        } else {
            return 0.0;
        }
    }

    /// Returns the distance from a kink of F at position y above which a position is on a certain side of the kink, in
    /// spite of rounding [m].
    [[nodiscard]] double margin(double y) const noexcept { return 4.0 * epsilon * (std::abs(y) + travel_); }

    [[nodiscard]] static double median(double a, double b, double c) noexcept {
        return std::max(std::min(a, b), std::min(std::max(a, b), c));
    }

    /// Returns true if the cell contains positions for which the play operator does not move from `play`.
    [[nodiscard]] bool may_stick(const Cell& cell, double play) const noexcept {
        return radius_ > 0.0 && cell.low < play + radius_ && cell.high > play - radius_;
    }

    /// Returns the direction state of positions in a cell without sticking: 1 (press) above `play`, otherwise -1
    /// (release).
    [[nodiscard]] static double direction(const Cell& cell, double play) noexcept {
        return cell.low >= play ? 1.0 : -1.0;
    }

    /// Returns F at a border of a cell that is moved by `turn_offset` (whole periods), for the position `play` of the
    /// play operator [N].
    [[nodiscard]] double value(const Border& border, double turn_offset, double p,
                               double play) const noexcept {
        const double y = border.position + turn_offset;
        const double s = std::clamp((y - play) * by_radius_, -1.0, 1.0);
        return border.force + s * border.hysteresis + p * y;
    }

    /// Returns cell k, moved by the distance `turn_offset`. This distance is a whole number of repeat lengths of a
    /// periodic force.
    [[nodiscard]] Cell cell_at(std::size_t k, double turn_offset) const noexcept {
        return {k == 0 ? -infinity : borders_[k - 1].position + turn_offset,
                k == borders_.size() ? infinity : borders_[k].position + turn_offset,
                k == 0 ? 0.0 : borders_[k - 1].curvature};
    }

    /// Applies one Newton step from position y and limits the result to the cell. The force is evaluated slightly
    /// inside the borders of the cell, because the slope f' may jump at a border.
    template <class E, class State>
    [[nodiscard, gnu::always_inline]] inline Trial newton(const E& environment, const State& state,
                                                          LoadLine line, double y,
                                                          const Cell& cell) const noexcept {
        y = std::fmax(std::fmin(y, cell.high - margin(y)), cell.low + margin(y));
        const auto clamped = [&](double to) { return std::clamp(to, cell.low, cell.high); };
        const double sum = line.slope * y - line.intercept;
        if constexpr (requires { state.play; }) {
            const auto g = environment.force().at(y);
            const auto h = environment.hysteresis_force().at(y);
            constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
            Trial trial{};
            trial.sample = {g.value, unknown, unknown, environment.force().extrapolated(y)};
            const auto step = [&](double s, double gain) {
                const double slope = line.slope + g.slope + s * h.slope + gain;
                trial.steepest = std::max(trial.steepest, slope);
                trial.compliance = 1.0 / slope;
                return y - (g.value + s * h.value + sum) * trial.compliance;
            };
            if (may_stick(cell, state.play)) {
                const double press = step(1.0, 0.0);
                const double pressing = trial.compliance;
                const double release = step(-1.0, 0.0);
                const double releasing = trial.compliance;
                const double stick = step((y - state.play) * by_radius_, h.value * by_radius_);
                trial.position = median(press, release, stick);
                trial.compliance = trial.position == stick   ? trial.compliance
                                   : trial.position == press ? pressing
                                                             : releasing;
            } else {
                trial.position = step(direction(cell, state.play), 0.0);
            }
            trial.position = clamped(trial.position);
            trial.correction = trial.position - y;
            return trial;
        } else {
            const EnvironmentSample sample = environment.at(y, state);
            const double slope = line.slope + sample.slope;
            const double compliance = 1.0 / slope;
            const double position = clamped(y - (sample.force + sum) * compliance);
            return {position, position - y, compliance, slope, sample};
        }
    }

    /// Stores the solution `position` and its tangent in `memory`, and returns the solution.
    [[nodiscard]] static Solution found(const EnvironmentSample& sample, double position, double compliance,
                                        LoadLine line, int evaluations, Memory& memory) noexcept {
        memory.position = position;
        memory.at_zero = position - line.intercept * compliance;
        memory.compliance = compliance;
        return {position,
                {line.intercept - line.slope * position, sample.slope, sample.energy, sample.extrapolated},
                0.0,
                evaluations,
                Status::Ok};
    }

    /// Solves the load line inside the cell that contains the solution. Starts at the linear interpolation between the
    /// borders of the cell, or at `guess` if it is near the interpolated position.
    template <Environment E>
    [[nodiscard, gnu::noinline]] Solution from_borders(const E& environment, const typename E::State& state,
                                                       LoadLine line, Memory& memory, double guess,
                                                       int evaluations) const noexcept {
        constexpr int most_steps = 3;
        if (!(unique(line.slope) && std::isfinite(line.intercept))) {
            return search(environment, state, line, memory);
        }
        const double play = play_of(state);
        const auto [k, turn_offset] = locate(line, play);
        const Cell cell = cell_at(k, turn_offset);
        double y = interpolated(k, turn_offset, line, play);
        if (32.0 * std::abs(guess - y) <= std::fmin(cell.high - cell.low, travel_)) {
            y = guess;
        }
        for (int steps = 1;; ++steps) {
            const Trial trial = newton(environment, state, line, y, cell);
            if (!std::isfinite(trial.position)) {
                return {y, trial.sample, trial.position, evaluations + steps, Status::NonFinite};
            }
            const double remaining_error =
                64.0 / 49.0 * cell.curvature * (trial.correction * trial.correction);
            y = trial.position;
            const double size =
                std::abs(trial.sample.force) + std::abs(line.slope * y) + std::abs(line.intercept);
            if (remaining_error <= tolerance_ || remaining_error * trial.steepest <= 4.0 * epsilon * size ||
                steps == most_steps) {
                store_range(cell, y, play, memory);
                return found(trial.sample, y, trial.compliance, line, evaluations + steps, memory);
            }
        }
    }

    /// Stores in `memory` the interval of positions around the solution y in which F is smooth.
    void store_range(const Cell& cell, double y, double play, Memory& memory) const noexcept {
        memory.low = cell.low + margin(y);
        memory.high = cell.high - margin(y);
        if (radius_ > 0.0) {
            const double from = play - radius_;
            const double to = play + radius_;
            memory.low = std::fmax(memory.low, y > to     ? to + margin(y)
                                               : y > from ? from + margin(y)
                                                          : -infinity);
            memory.high = std::fmin(memory.high, y < from ? from - margin(y)
                                                 : y < to ? to - margin(y)
                                                          : infinity);
        }
        memory.curvature = cell.curvature;
        memory.play = play;
    }

    /// Returns the cell that contains the solution of the load line, found by comparing q with F at the borders of the
    /// cells.
    [[nodiscard]] Place locate(LoadLine line, double play) const noexcept {
        double turn_offset = 0.0;
        const auto lies_below = [&](const Border& border) {
            return value(border, turn_offset, line.slope, play) <= line.intercept;
        };
        if (period_ > 0.0) {
            // F at the first border plus k repeat lengths rises with k. Without hysteresis it is linear in k, and the
            // hysteresis changes it by at most |h|. Bisection finds the last k for which it is <= q.
            const Border& first = borders_.front();
            const double rise = line.slope * period_;
            const double size = std::abs(first.hysteresis);
            const double linear = line.intercept - first.force - line.slope * first.position;
            double turns = std::floor((linear - size) / rise) - 1.0;
            double past = std::floor((linear + size) / rise) + 2.0;
            constexpr int most_halvings = 64;
            for (int halving = 0; past - turns > 1.0 && halving < most_halvings; ++halving) {
                const double middle = std::floor(0.5 * (turns + past));
                turn_offset = middle * period_;
                (lies_below(first) ? turns : past) = middle;
            }
            turn_offset = turns * period_;
        }
        const auto above = std::partition_point(borders_.begin(), borders_.end(), lies_below);
        const auto k = static_cast<std::size_t>(above - borders_.begin());
        // Rounding can place a solution at an end of the period outside the period, but there is no infinite cell.
        return {period_ > 0.0 ? std::clamp(k, std::size_t{1}, borders_.size() - 1) : k, turn_offset};
    }

    /// Returns the position in cell k at which linear interpolation of F between the borders of the cell gives q. In an
    /// infinite cell F is a straight line, so its finite end is a sufficient start.
    [[nodiscard]] double interpolated(std::size_t k, double turn_offset, LoadLine line,
                                      double play) const noexcept {
        const Cell cell = cell_at(k, turn_offset);
        if (k == 0) {
            return cell.high;
        }
        if (k == borders_.size()) {
            return cell.low;
        }
        const Border& from = borders_[k - 1];
        const Border& to = borders_[k];
        const double width = to.position - from.position;
        const double slope_mismatch = line.intercept - (from.force + line.slope * cell.low);
        const double rise = to.force - from.force + line.slope * width;
        const auto chord = [&](double from_s, double to_s) {
            const double at_from = from_s * from.hysteresis;
            const double y =
                cell.low + width * (slope_mismatch - at_from) / (rise + to_s * to.hysteresis - at_from);
            return std::clamp(y, cell.low, cell.high);
        };
        if (may_stick(cell, play)) {
            return median(chord(1.0, 1.0), chord(-1.0, -1.0),
                          chord((cell.low - play) * by_radius_, (cell.high - play) * by_radius_));
        }
        const double s = direction(cell, play);
        return chord(s, s);
    }

    /// Returns a network without wavelets: a straight line of this slope with the force `at_zero` at position 0.
    [[nodiscard]] static NetworkParameters straight(double slope, double at_zero) {
        return {1, {}, {}, {}, {slope}, at_zero};
    }

    /// Returns a hysteresis of zero over the same intervals as the force, for a force without hysteresis.
    [[nodiscard]] static PiecewiseForce zero_hysteresis(const PiecewiseForce& force) {
        PiecewiseForce hysteresis = scaled(force, 0.0);
        hysteresis.network = straight(0.0, 0.0);
        return hysteresis;
    }

    /// Returns the intervals of force and hysteresis in the order of position; unless the force is periodic, the first
    /// and the last interval are infinite.
    [[nodiscard]] static std::vector<Piece> pieces_of(const PiecewiseForce& force,
                                                      const PiecewiseForce& hysteresis) {
        std::vector<Piece> pieces;
        const auto add_lines = [&](const std::vector<OuterLine>& of_force,
                                   const std::vector<OuterLine>& of_hysteresis, double y, double outward) {
            double g = jet(force.network, y)[0];
            double h = jet(hysteresis.network, y)[0];
            for (std::size_t k = 0; k < of_force.size(); ++k) {
                const double end = y + outward * of_force[k].length;
                const double g_slope = of_force[k].slope;
                const double h_slope = of_hysteresis[k].slope;
                pieces.push_back({{std::min(y, end), std::max(y, end)},
                                  straight(g_slope, g - g_slope * y),
                                  straight(h_slope, h - h_slope * y)});
                g += g_slope * (end - y);
                h += h_slope * (end - y);
                y = end;
            }
        };
        add_lines(force.below, hysteresis.below, force.lower, -1.0);
        std::reverse(pieces.begin(), pieces.end());
        pieces.push_back({{force.lower, force.upper}, force.network, hysteresis.network});
        add_lines(force.above, hysteresis.above, force.upper, 1.0);
        return pieces;
    }

    /// Returns c = max|F''| / (2 min F') of a cell if condition (C) of the class is proved for every sheet in it;
    /// otherwise infinity. F' and F'' are linear in s, so bounds for s and for -s also hold for all direction states
    /// between.
    [[nodiscard]] double certified_curvature(const Piece& piece, double from, double to,
                                             double p) const noexcept {
        const double middle = 0.5 * (from + to);
        const auto expansion = [&](const NetworkParameters& network) {
            return detail::Expansion{derivatives(network, middle),
                                     derivatives_rounding(network, std::max(std::abs(from), std::abs(to))),
                                     derivative_bounds(network, from, to)};
        };
        const detail::Expansion g = expansion(piece.force);
        const detail::Expansion h = expansion(piece.hysteresis);
        const auto curvature = [&](double s, double by_radius) {
            return detail::proved_curvature(detail::sheet(g, h, s, by_radius), p, 0.5 * (to - from));
        };
        // Direction state in the middle of a cell that overlaps the positions of sticking by its end only
        const double s = 1.0 + 0.5 * (to - from) * by_radius_;
        return std::max(
            {curvature(1.0, 0.0), curvature(-1.0, 0.0), curvature(s, by_radius_), curvature(-s, by_radius_)});
    }

    /// Makes the cells in the order of position, each about as wide as condition (C) can be proved. Makes no cells if
    /// (C) cannot be proved for one of them or too many are needed.
    void cut(const std::vector<Piece>& pieces, double p) {
        constexpr std::size_t most_cells = 4096;
        constexpr double narrowest = 1e-12;
        const auto border = [](const Piece& piece, double y, double curvature) {
            return Border{y, jet(piece.force, y)[0], jet(piece.hysteresis, y)[0], curvature};
        };
        std::vector<Border> borders;
        double width = 0.125 * travel_;
        for (const Piece& piece : pieces) {
            const auto [lower, upper] = piece.positions;
            if (!std::isfinite(lower) || !std::isfinite(upper)) {
                // In an infinite interval, the hysteresis h is constant, so each sheet is a straight line.
                const double edge = std::isfinite(lower) ? lower : upper;
                const double gain = by_radius_ * jet(piece.hysteresis, edge)[0];
                if (!(p + piece.force.linear[0] + std::min(0.0, gain) > 0.0)) {
                    return;
                }
                continue;
            }
            for (double from = lower; from < upper;) {
                const double to = upper - from > 1.01 * width ? from + width : upper;
                const double curvature = certified_curvature(piece, from, to, p);
                if (curvature < infinity) {
                    borders.push_back(border(piece, from, curvature));
                    from = to;
                    width *= 1.5;
                } else {
                    width = 0.8 * std::min(width, to - from);
                }
                if (!(width > narrowest * travel_) || borders.size() > most_cells) {
                    return;
                }
            }
        }
        const auto last = std::find_if(pieces.rbegin(), pieces.rend(), [](const Piece& piece) {
            return std::isfinite(piece.positions.upper);
        });
        borders.push_back(border(*last, last->positions.upper, 0.0));
        borders_ = std::move(borders);
        least_slope_ = p;
    }

    LoadLineSolver search_;
    double radius_;     ///< play radius r; 0 without hysteresis [m]
    double by_radius_;  ///< 1 / r; 0 without hysteresis [1/m]
    double travel_;
    double period_;     ///< repeat length of a periodic force; 0 if the force is not periodic [m]
    double tolerance_;  ///< largest allowed error of the position y that solves a load line [m]
    double least_slope_ =
        infinity;  ///< smallest load-line slope p for which F is proved to rise in every cell [N/m]
    std::vector<Border> borders_;
};

}  // namespace palpate
