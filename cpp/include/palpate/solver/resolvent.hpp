// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "palpate/model/bounds.hpp"
#include "palpate/model/derivatives.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/solver/certified_solver.hpp"
#include "palpate/solver/inverse_table.hpp"
#include "palpate/solver/newton.hpp"
#include "palpate/solver/piecewise_force.hpp"
#include "palpate/solver/rising.hpp"

namespace palpate {

/// Interval of positions y over which F(y) = f(y) + p y rises from `values.lower` to `values.upper`. For each q between
/// these values the interval contains one solution of F(y) = q. It is computed by a table, a straight line, or Newton's
/// method between the ends of the interval.
struct Branch {
    Interval values{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    Interval positions{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    InverseTable table;
    /// Slope p + f' of F if F is a straight line over this branch; otherwise 0 [N/m]
    double line_slope = 0.0;
    /// |f''| at the lower end of this branch if F falls at the positions below this end; otherwise 0
    double curvature_low = 0.0;
    /// |f''| at the upper end of this branch if F falls at the positions above this end; otherwise 0
    double curvature_high = 0.0;

    /// Returns the position y with F(y) = q if F is a straight line over this interval, computed from a finite end of
    /// the interval.
    [[nodiscard]] double on_line(double q) const noexcept {
        return std::isfinite(positions.upper) ? positions.upper + (q - values.upper) / line_slope
                                              : positions.lower + (q - values.lower) / line_slope;
    }

    /// Returns a first position for Newton's method at the value q. Near a fold (an end at which F changes from rising
    /// to falling) it lies on a parabola; elsewhere it is the last position `last`. If this position lies outside the
    /// interval, the middle of the interval is returned.
    [[nodiscard]] double first_guess(double q, double last) const noexcept {
        const double near = 0.1 * (values.upper - values.lower);
        if (curvature_high > 0.0 && values.upper - q < near) {
            last = positions.upper - std::sqrt(2.0 * (values.upper - q) / curvature_high);
        } else if (curvature_low > 0.0 && q - values.lower < near) {
            last = positions.lower + std::sqrt(2.0 * (q - values.lower) / curvature_low);
        }
        return last > positions.lower && last < positions.upper ? last
                                                                : 0.5 * (positions.lower + positions.upper);
    }
};

/// Solves the load line f(y) + p y = q for a fixed slope p without iteration: tables give the position y = R(q) as a
/// function of q.
///
/// F(y) = f(y) + p y rises over intervals called branches; between some of them F falls. A branch inside the domain has
/// a table with an error bound proved for each cell (`inverse_tables`). Outside the domain f is a straight line, which
/// is solved exactly. For a periodic force all branches repeat with every period. If several branches contain a
/// solution, the motion defines the branch: from the last position, the solver moves in the direction of -residual (q -
/// F) to the first solution. It goes to the next branch while q is above the largest F of the branch, and to the
/// previous branch while q is below the smallest F of the branch.
///
/// A short branch near a fold (a position at which F changes between rising and falling) has no table, nor has a branch
/// whose required error cannot be proved. In such a branch `CertifiedSolver` solves load lines that have exactly one
/// solution, and Newton's method between the ends of the branch solves other load lines. If the folds cannot be
/// located, or F falls far outside the domain, `CertifiedSolver` is called for all load lines.
class Resolvent {
  public:
    /// State between two calls of `solve`: the branch (interval of rising F) that contains the last solution, and the
    /// state of `CertifiedSolver`.
    struct Memory {
        CertifiedSolver::Memory newton;
        std::size_t branch = 0;  ///< index of the branch with the last solution; 0: no branch found yet
        /// Number of repeat lengths of the force from the first branches to the position
        double turns = 0.0;

        Memory() = default;
        explicit Memory(double position) noexcept : newton{position} {}
    };

    Resolvent(const PiecewiseForce& force, double p, const ResolventOptions& options = {})
        : solver_{force, p}, slope_{p}, period_{force.upper - force.lower} {
        if (std::isfinite(p)) {
            build_branches(force, options);
        }
    }
    Resolvent(const NetworkCurve& curve, double p, const ResolventOptions& options = {})
        : Resolvent{piecewise(curve), p, options} {}

    /// Returns true if at least one branch (interval of rising F) has a table of solutions.
    [[nodiscard]] bool tabulated() const noexcept { return cells() > 0; }
    [[nodiscard]] std::size_t cells() const noexcept {
        std::size_t sum = 0;
        for (const Branch& branch : branches_) {
            sum += branch.table.table.size();
        }
        return sum;
    }
    /// Returns a proved bound of the position error of all tables [m]; 0 without tables.
    [[nodiscard]] double position_error() const noexcept {
        double worst = 0.0;
        for (const Branch& branch : branches_) {
            worst = std::max(worst, branch.table.error);
        }
        return worst;
    }
    /// Returns the branches of F (of one period if the force is periodic), in the order of position. The first element
    /// is empty and represents an unknown branch.
    [[nodiscard]] const std::vector<Branch>& branches() const noexcept { return branches_; }
    [[nodiscard]] const CertifiedSolver& solver() const noexcept { return solver_; }
    /// Returns true if it is proved that every load line of slope p has exactly one solution.
    [[nodiscard]] bool unique(double p) const noexcept { return solver_.unique(p); }
    /// Returns the solver for load lines that are not proved to have exactly one solution.
    [[nodiscard]] const LoadLineSolver& uncertified() const noexcept { return solver_.uncertified(); }

    /// Returns the position on the load line with its force, and updates `memory` with this solution. Inlined, so that
    /// the compiler drops the results that a caller does not use.
    template <Environment E>
    [[nodiscard, gnu::always_inline]] inline Solution solve(const E& environment,
                                                            const typename E::State& state, LoadLine line,
                                                            Memory& memory) const noexcept {
        if (in_last_table(line, memory)) {
            memory.newton.position = branches_[memory.branch].table.at(line.intercept);
            return solution_at(memory.newton.position, line.intercept, false);
        }
        return solve_outside_table(environment, state, line, memory);
    }

    /// Returns the solution of a load line that has exactly one, if a table or a straight line gives it without an
    /// evaluation of the force; otherwise the position NaN.
    [[nodiscard, gnu::always_inline]] inline Solution without_evaluation(LoadLine line,
                                                                         Memory& memory) const noexcept {
        if (in_last_table(line, memory)) {
            return solution_at(branches_[memory.branch].table.at(line.intercept), line.intercept, false);
        }
        return from_any_branch(line, memory);
    }

    /// Solves the load line from the position `start`.
    template <Environment E>
    [[nodiscard]] Solution solve(const E& environment, const typename E::State& state, LoadLine line,
                                 double start) const noexcept {
        Memory memory{start};
        return solve(environment, state, line, memory);
    }

  private:
    /// Returns true if the table of the last branch, in the first period, contains the solution.
    [[nodiscard, gnu::always_inline]] inline bool in_last_table(LoadLine line,
                                                                const Memory& memory) const noexcept {
        return branches_[memory.branch].table.covers(line.intercept) && memory.turns == 0.0 &&
               line.slope == slope_;
    }

    /// Returns the position NaN, for a load line that neither a table nor a straight line solves.
    [[nodiscard]] static Solution no_solution() noexcept {
        Solution solution;
        solution.position = std::numeric_limits<double>::quiet_NaN();
        return solution;
    }

    /// Returns the solution y with its force q - p y. Slope and energy are NaN: they would double the computing time,
    /// and no structure uses them.
    [[nodiscard]] Solution solution_at(double y, double q, bool extrapolated) const noexcept {
        constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
        return {y, {q - slope_ * y, unknown, unknown, extrapolated}};
    }

    template <Environment E>
    [[nodiscard, gnu::noinline]] Solution solve_outside_table(const E& environment,
                                                              const typename E::State& state, LoadLine line,
                                                              Memory& memory) const noexcept {
        if (!(branches_.size() > 1 && line.slope == slope_ && std::isfinite(line.intercept) &&
              std::isfinite(memory.newton.position))) {
            const Solution solution = solver_.solve(environment, state, line, memory.newton);
            if (solution.status != Status::NonFinite) {
                memory.branch = 0;
                memory.turns = 0.0;
            }
            return solution;
        }
        if (unique(slope_)) {
            Solution solution = from_any_branch(line, memory);
            if (std::isnan(solution.position)) {
                return solver_.solve(environment, state, line, memory.newton);
            }
            memory.newton.position = solution.position;
            return solution;
        }
        Memory next = memory;
        const int located = next.branch == 0 ? locate_branch(environment, state, line, next) : 0;
        find_branch(line.intercept, next);
        Solution solution = on_branch(line.intercept, next);
        if (std::isnan(solution.position)) {
            const Branch& branch = branches_[next.branch];
            const double turn_offset = period_ * next.turns;
            const double q =
                std::clamp(line.intercept - slope_ * turn_offset, branch.values.lower, branch.values.upper);
            solution = uncertified().solve(
                environment, state, line,
                branch.first_guess(q, next.newton.position - turn_offset) + turn_offset,
                {branch.positions.lower + turn_offset, branch.positions.upper + turn_offset});
        }
        solution.evaluations += located;
        if (solution.status != Status::NonFinite) {
            next.newton = CertifiedSolver::Memory{solution.position};
            memory = next;
        }
        return solution;
    }

    /// Returns the solution from the table or the straight line of the first branch that contains q; the position is
    /// NaN if that branch has neither, or if the load line has another slope than the branches.
    [[nodiscard, gnu::noinline]] Solution from_any_branch(LoadLine line, Memory& memory) const noexcept {
        if (!(branches_.size() > 1 && line.slope == slope_ && std::isfinite(line.intercept))) {
            return no_solution();
        }
        memory.branch = std::max(memory.branch, std::size_t{1});
        find_branch(line.intercept, memory);
        return on_branch(line.intercept, memory);
    }

    /// Returns the solution from the table or the straight line of the branch in `memory`; the position is NaN if that
    /// branch has neither.
    [[nodiscard]] Solution on_branch(double intercept, const Memory& memory) const noexcept {
        const Branch& branch = branches_[memory.branch];
        const double turn_offset = period_ * memory.turns;
        const double q =
            std::clamp(intercept - slope_ * turn_offset, branch.values.lower, branch.values.upper);
        if (branch.table.covers(q)) {
            return solution_at(branch.table.at(q) + turn_offset, intercept, false);
        }
        if (branch.line_slope > 0.0) {
            return solution_at(branch.on_line(q), q, true);
        }
        return no_solution();
    }

    /// Sets `memory.branch` to the branch that contains the last position. If F falls at this position, sets it to the
    /// nearest branch in the direction of -residual, that is of q - F. Returns the number of evaluations of the force.
    template <Environment E>
    int locate_branch(const E& environment, const typename E::State& state, LoadLine line,
                      Memory& memory) const noexcept {
        const double y = memory.newton.position;
        memory.turns = repeats_ ? std::floor((y - branches_[1].positions.lower) / period_) : 0.0;
        double along = y - memory.turns * period_;
        memory.branch = 1;
        while (memory.branch < branches_.size() && along > branches_[memory.branch].positions.upper) {
            ++memory.branch;
        }
        if (memory.branch == branches_.size()) {
            memory.branch = 1;
            memory.turns += 1.0;
            along -= period_;
        }
        if (!(along < branches_[memory.branch].positions.lower)) {
            return 0;
        }
        if (environment.at(y, state).force + line.slope * y > line.intercept) {
            to_previous_branch(memory);
        }
        return 1;
    }

    void to_next_branch(Memory& memory) const noexcept {
        if (++memory.branch == branches_.size()) {
            memory.branch = 1;
            memory.turns += 1.0;
        }
    }

    void to_previous_branch(Memory& memory) const noexcept {
        if (--memory.branch == 0) {
            memory.branch = branches_.size() - 1;
            memory.turns -= 1.0;
        }
    }

    /// Moves `memory.branch` from branch to branch (intervals of rising F) until the branch contains the solution for
    /// q.
    void find_branch(double q, Memory& memory) const noexcept {
        const double turn = slope_ * period_;
        if (repeats_) {
            // Goes directly to a repeat length of the periodic force that can contain the solution.
            if (q > highest_ + memory.turns * turn) {
                memory.branch = 1;
                memory.turns = std::ceil((q - highest_) / turn);
            } else if (q < lowest_ + memory.turns * turn) {
                memory.branch = branches_.size() - 1;
                memory.turns = std::floor((q - lowest_) / turn);
            }
        }
        // All branches of two periods are sufficient. The limit of the iterations ends the loop at positions so large
        // that their rounding error exceeds a period.
        std::size_t steps = 2 * branches_.size();
        while (q - memory.turns * turn > branches_[memory.branch].values.upper && steps-- > 0) {
            to_next_branch(memory);
        }
        while (q - memory.turns * turn < branches_[memory.branch].values.lower && steps-- > 0) {
            to_previous_branch(memory);
        }
    }

    void build_branches(const PiecewiseForce& force, const ResolventOptions& options) {
        const auto intervals = rising_intervals(force.network, slope_, force.lower, force.upper);
        const auto rises = [&](const std::vector<OuterLine>& side) {
            return side.empty() || slope_ + side.back().slope > 0.0;
        };
        if (!intervals || !rises(force.below) || !rises(force.above) || (force.periodic && !(slope_ > 0.0))) {
            return;
        }
        add_lines(force.below, force.lower, total(force, force.lower), -1.0);
        std::reverse(branches_.begin() + 1, branches_.end());
        for (const Interval& positions : *intervals) {
            add_interval(force, positions, options);
        }
        add_lines(force.above, force.upper, total(force, force.upper), 1.0);
        repeats_ = force.periodic;
    }

    [[nodiscard]] double total(const PiecewiseForce& force, double y) const noexcept {
        return jet(force.network, y)[0] + slope_ * y;
    }

    /// Adds a branch for each table of the inverse of F over `positions`, an interval over which F rises, and branches
    /// without a table for the gaps between the tables.
    void add_interval(const PiecewiseForce& force, Interval positions, const ResolventOptions& options) {
        const Interval values{total(force, positions.lower), total(force, positions.upper)};
        const bool folds_below = positions.lower > force.lower;
        const bool folds_above = positions.upper < force.upper;
        const auto curvature = [&](double y) { return std::abs(jet(force.network, y)[2]); };
        Branch gap;
        gap.values = values;
        gap.positions = positions;
        gap.curvature_low = folds_below ? curvature(positions.lower) : 0.0;
        const auto close_gap = [&](double value, double position) {
            gap.values.upper = value;
            gap.positions.upper = position;
            if (gap.values.upper > gap.values.lower) {
                branches_.push_back(gap);
            }
        };
        // Without a fold at its end, a branch without a table may be slightly wider than the gap between two tables,
        // because the ends of the tables are not exact positions.
        const double margin = 1e-9 * period_;
        for (InverseTable& table :
             inverse_tables({force.network, slope_, positions, values, folds_below, folds_above},
                            options.relative_error * period_, options.largest_table)) {
            close_gap(table.values.lower, table.positions.lower + margin);
            gap = Branch{};
            gap.values.lower = table.values.upper;
            gap.positions.lower = table.positions.upper - margin;
            Branch branch;
            branch.values = table.values;
            branch.positions = table.positions;
            branch.table = std::move(table);
            branches_.push_back(std::move(branch));
        }
        gap.curvature_high = folds_above ? curvature(positions.upper) : 0.0;
        close_gap(values.upper, positions.upper);
        highest_ = std::max(highest_, values.upper);
        lowest_ = std::min(lowest_, values.lower);
    }

    /// Adds a branch for each straight line outside one edge of the domain, the nearest first. A line along which F
    /// falls is not a branch.
    void add_lines(const std::vector<OuterLine>& lines, double y, double q, double outward) {
        for (const OuterLine& line : lines) {
            const double y_end = y + outward * line.length;
            const double q_end = q + outward * (slope_ + line.slope) * line.length;
            if (slope_ + line.slope > 0.0) {
                Branch branch;
                branch.line_slope = slope_ + line.slope;
                branch.positions = {std::min(y, y_end), std::max(y, y_end)};
                branch.values = {std::min(q, q_end), std::max(q, q_end)};
                branches_.push_back(std::move(branch));
            }
            y = y_end;
            q = q_end;
        }
    }

    CertifiedSolver solver_;
    double slope_;
    double period_;
    bool repeats_ = false;
    /// Largest value of F(y) = f(y) + p y over the first repeat length of a periodic force [N]
    double highest_ = -std::numeric_limits<double>::infinity();
    /// Smallest value of F(y) = f(y) + p y over the first repeat length of a periodic force [N]
    double lowest_ = std::numeric_limits<double>::infinity();
    std::vector<Branch> branches_ = std::vector<Branch>(1);
};

}  // namespace palpate
