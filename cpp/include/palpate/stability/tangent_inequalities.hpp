// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/rendering/held_slope.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/rendering/tangent.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/held_force.hpp"
#include "palpate/stability/inequality.hpp"
#include "palpate/stability/raised_need.hpp"

namespace palpate {

/// Returns the largest energy that a hand can take out after a motion faster than that of the certificate, until the
/// zero force acts that the guard sends [J]: (T + t_d) (F_max - f_c)^2 / 4 b.
[[nodiscard]] inline double fast_motion_energy(const DeviceProfile& device) noexcept {
    const double force = std::max(0.0, device.force_limit - device.coulomb_friction);
    return (device.longest_period_s() + device.delay_s) * force * force / (4.0 * device.viscous_damping);
}

namespace detail {

/// Returns T_in B(kappa, 0, t_in), the device damping that the loop of the controller needs for a line of slope kappa
/// [N*s/m]. The controller holds its force for a period T_in and applies it t_in after its sample.
[[nodiscard]] inline double inner_need(const HeldLine& loop, double stiffness) {
    DeviceProfile controller;
    controller.period_s = loop.period_s;
    controller.delay_s = loop.delay_s;
    controller.jitter_s = 0.0;
    return loop.period_s * device_need(controller, {stiffness, 0.0});
}

/// Returns Lambda^2 of a device, see `lag_squared_of`.
[[nodiscard]] inline double lag_squared(const DeviceProfile& device) noexcept {
    return lag_squared_of(device.delay_s, device.period_s, device.jitter_s);
}
/// Returns the damping divided by the period for a difference of force and line with slopes from -slope to slope [N/m].
[[nodiscard]] inline double either_need(const DeviceProfile& device, double slope) noexcept {
    return held_need(std::sqrt(lag_squared(device)), {slope, slope});
}

/// What the inequalities of a held line need, by the rule for its slope.
struct LineNeed {
    double stiffness = 0.0;  ///< largest slope of the line [N/m]
    double outer = 0.0;      ///< B_o, device damping divided by the longest period [N/m]
    double residual =
        0.0;  ///< largest difference of slopes, line and force, while both follow a reading [N/m]
    const char* formula = "";
};

/// Returns a * b, or 0 if one factor is 0 and the other is infinite.
[[nodiscard]] inline double product(double a, double b) noexcept {
    return a == 0.0 || b == 0.0 ? 0.0 : a * b;
}

/// Returns the needs of the rule `Steepest` on a device without delay. `rising` is the bound of the rising slope, with
/// the stiffness of a sticking play operator and of a memory.
[[nodiscard]] inline LineNeed steepest_line_need(const ForceBounds& bounds, const HeldSlope& line) {
    const double M = bounds.rising();
    const BendBounds bend = bounds.bend.value_or(BendBounds{});
    const double w = line.motion.value_or(std::numeric_limits<double>::infinity());
    LineNeed need;
    need.stiffness = std::min(line.slope, M);
    need.outer = 0.5 * std::max(0.0, M - line.slope);
    need.formula = "b >= T_in B(kappa, 0, t_in) + T (M - kappa) / 2";
    // The slopes are computed for cells, so they see f' up to w / 3 and three cells away
    const double above = product(bend.curvature, w) * (1.0 / 3.0 + 3.0 / cells_in_motion) + bend.jump;
    need.residual = bounds.hysteresis
                        ? bounds.sliding + 2.0 * bounds.hysteresis_per_play + need.stiffness
                        : std::max(bounds.falling() + std::min(above, need.stiffness), M - need.stiffness);
    return need;
}

/// Returns the needs of the rule `Raised`. The smaller of two bounds counts: one for every motion and no lift, and one
/// for motions up to w in a period.
[[nodiscard]] inline LineNeed raised_line_need(const ForceBounds& bounds, const HeldSlope& line,
                                               const DeviceProfile& device) {
    const double M = bounds.rising();
    const double s = bounds.falling();
    const BendBounds bend = bounds.bend.value_or(BendBounds{});
    // A reading wrong by Delta / 2 changes the slope of the line by C Delta / 2
    const double by_reading = 0.5 * product(bend.curvature, device.encoder_step);
    LineNeed need;
    need.stiffness = M + line.lift;
    need.residual = std::min(s + line.lift + by_reading + bend.jump, M + s + line.lift);
    need.outer = std::numeric_limits<double>::infinity();
    need.formula = "b >= T_in B(kappa, 0, t_in) + T B(M, M + s_, t_d)";
    if (line.lift == 0.0) {
        need.outer = device_need(device, {M, M + s});
    }
    if (!line.motion || !std::isfinite(bend.curvature)) {
        return need;
    }
    const double T = device.longest_period_s();
    // w is the motion in the nominal period, so the largest speed is w / period
    const double bent = bend.curvature * *line.motion * T / device.period_s;
    const double straight = device_need(device, {0.0, s}) + either_need(device, bend.jump + by_reading);
    const double curved = bent > 0.0
                              ? bent * raised_need(device.delay_s / T, lag_squared(device), line.lift / bent)
                              : device_need(device, {0.0, line.lift});
    if (straight + curved < need.outer) {
        need.outer = straight + curved;
        need.formula = "b >= T_in B(kappa, 0, t_in) + T (C w c + B(0, s_, t_d) + ...)";
    }
    return need;
}

/// Returns the needs of the rule `Constant`, for every motion.
[[nodiscard]] inline LineNeed constant_line_need(const ForceBounds& bounds, const HeldSlope& line,
                                                 const DeviceProfile& device) {
    const SlopeRange rest{std::max(0.0, bounds.rising() - line.slope),
                          std::max(0.0, bounds.falling() + line.slope)};
    return {line.slope, device_need(device, rest), rest.steepest(),
            "b >= T_in B(kappa, 0, t_in) + T B(M - kappa, s_ + kappa, t_d)"};
}

/// Returns the lines of the cases that no proof covers.
[[nodiscard]] inline std::vector<Inequality> open_line_cases(const ForceBounds& bounds, const HeldSlope& line,
                                                             const DeviceProfile& device) {
    std::vector<Inequality> open;
    const auto refuse = [&](const char* id, const char* name, const char* formula, double right,
                            const char* advice) {
        open.push_back({id, name, formula, 0.0, right, Basis::None, advice});
    };
    if (!device.held_line) {
        refuse("line-controller", "line that the device cannot hold",
               "proved only for 0 structures that need held_line in the profile", 1.0,
               "use direct rendering, or state held_line if the controller of the device holds a line");
    } else if (!device.held_line->limits_force) {
        refuse("line-limit", "force limit outside the loop that holds the line",
               "proved only for 0 such limits", 1.0, "let the controller limit the force of the line");
    }
    if (device.held_line && device.held_line->largest_center && line.rule != SlopeRule::Constant) {
        refuse("line-spring", "slope that changes with the position, for a controller that takes springs",
               "proved only for 0 such slopes", 1.0, "use the rule constant");
    }
    if (line.rule == SlopeRule::Steepest && device.delay_s > 0.0) {
        refuse("line-delay", "line of the rule steepest, with a delay [s]", "proved only for t_d = 0",
               device.delay_s, "use the rule raised or constant");
    }
    if (bounds.hysteresis && line.rule != SlopeRule::Steepest) {
        refuse("line-hysteresis", "hysteresis behind a line of another rule than steepest",
               "proved only for h / r = 0", bounds.hysteresis_per_play,
               "use direct rendering, or a device without delay");
    }
    return open;
}

}  // namespace detail

/// Returns the inequalities of a tangent: a line of slope kappa that the controller of the device holds for a period.
/// The controller's loop needs damping for kappa, the difference between force and line needs B_o. `HeldSlope` is the
/// rule for kappa (docs/certificate.md has the proofs).
[[nodiscard]] inline std::vector<Inequality> inequalities(TangentStructure, const ForceBounds& bounds,
                                                          const Scheme& scheme, const DeviceProfile& device) {
    const HeldSlope line = scheme.line.value_or(HeldSlope{});
    std::vector<Inequality> lines = detail::open_line_cases(bounds, line, device);
    if (!lines.empty()) {
        return lines;
    }
    const HeldLine& loop = *device.held_line;
    const detail::LineNeed need = line.rule == SlopeRule::Steepest ? detail::steepest_line_need(bounds, line)
                                  : line.rule == SlopeRule::Raised
                                      ? detail::raised_line_need(bounds, line, device)
                                      : detail::constant_line_need(bounds, line, device);
    const double rounded = 0.5 * loop.stiffness_step;
    const double stiffness = need.stiffness + rounded;
    const double T = device.longest_period_s();
    lines.push_back(
        {"damping-line", "viscous damping against the held line", need.formula, device.viscous_damping,
         detail::inner_need(loop, stiffness) + T * (need.outer + detail::either_need(device, rounded)),
         Basis::Proved, "docs/certificate.md"});
    // The force of a command compensates the rounding of its position; the center of a spring has no force to do so
    const double center_step = loop.largest_center ? loop.position_step : 0.0;
    const double errors = detail::product(0.5 * device.encoder_step, need.residual + rounded) +
                          0.5 * (loop.encoder_step + center_step) * stiffness;
    lines.push_back({"friction-line", "Coulomb friction against encoder and force steps",
                     "f_c >= (f' - kappa) Delta / 2 + kappa Delta_in / 2 + Delta_F / 2" +
                         std::string(bounds.mean_force > 0.0 ? " + |mean c(f)|" : ""),
                     device.coulomb_friction,
                     errors + 0.5 * device.force_step + bounds.mean_force + bounds.force_error, Basis::Proved,
                     "docs/certificate.md"});
    if (loop.largest_stiffness) {
        lines.push_back({"line-stiffness", "stiffness that the controller can hold", "kappa_max >= kappa",
                         *loop.largest_stiffness, stiffness, Basis::Proved, "docs/certificate.md"});
    }
    if (loop.watchdog_s) {
        lines.push_back({"line-watchdog", "time until the controller makes zero force", "t_w > T",
                         *loop.watchdog_s, T, Basis::Proved, "docs/certificate.md", true});
    }
    if (line.motion) {
        // A cell of the slopes is as wide as half an encoder step; the guard needs a motion that it can measure
        const double steps = line.rule == SlopeRule::Steepest ? 0.5 * cells_in_motion : 1.0;
        lines.push_back({"line-motion", "largest motion in a period against the encoder step",
                         line.rule == SlopeRule::Steepest ? "w >= 8 Delta" : "w >= Delta", *line.motion,
                         steps * device.encoder_step, Basis::Proved, "docs/certificate.md"});
    }
    return lines;
}

namespace detail {

/// Returns the damping that is missing for a line, relative to that of the device [-]; at most 0 if it is enough.
/// Another inequality that does not hold gives infinity.
[[nodiscard]] inline double line_shortfall(const ForceBounds& bounds, const HeldSlope& line,
                                           const DeviceProfile& device) {
    Scheme scheme;
    scheme.structure = StructureKind::Tangent;
    scheme.line = line;
    double missing = -1.0;
    for (const Inequality& each : inequalities(TangentStructure{}, bounds, scheme, device)) {
        if (each.id == "damping-line" || each.id == "friction-line") {
            missing = std::max(missing, each.right / each.left - 1.0);
        } else if (!each.holds()) {
            return std::numeric_limits<double>::infinity();
        }
    }
    return missing;
}

/// Returns the line of the rule `Raised` that needs least, for motions up to w in a period. A lift of C w / 2 needs the
/// least damping against the delay; a smaller one needs less damping in the loop of the controller.
[[nodiscard]] inline HeldSlope best_raised(const ForceBounds& bounds, const DeviceProfile& device,
                                           double motion) {
    constexpr int steps = 4;
    const double curvature = bounds.bend ? bounds.bend->curvature : 0.0;
    const double bent =
        std::isfinite(curvature) ? curvature * motion * device.longest_period_s() / device.period_s : 0.0;
    HeldSlope best{SlopeRule::Raised, 0.0, 0.0, motion};
    for (int k = 1; k <= steps && bent > 0.0; ++k) {
        const HeldSlope higher{SlopeRule::Raised, 0.0, 0.5 * bent * k / steps, motion};
        if (line_shortfall(bounds, higher, device) < line_shortfall(bounds, best, device)) {
            best = higher;
        }
    }
    return best;
}

/// Returns the line of the rule `Constant` that needs least.
[[nodiscard]] inline HeldSlope best_constant(const ForceBounds& bounds, const DeviceProfile& device) {
    const auto constant = [](double slope) {
        return HeldSlope{SlopeRule::Constant, slope, 0.0, std::nullopt};
    };
    return constant(minimum_between(0.0, bounds.rising(), [&](double slope) {
                        return line_shortfall(bounds, constant(slope), device);
                    }).at);
}

}  // namespace detail

/// Returns the line of the simplest rule that is certified for a force with these bounds on a device, for motions up to
/// w = `motion` in a period; if none is certified, the line that needs least. Without delay this is `Steepest`. With a
/// delay the rules are tried in this order: the slope of the force, without a largest motion; `Raised` with the best
/// lift; `Constant` with the best slope, for every motion. A controller that takes springs gets a constant slope: the
/// center of the spring then contains the force, so one report states the line.
[[nodiscard]] inline HeldSlope line_for(const ForceBounds& bounds, const DeviceProfile& device,
                                        double motion) {
    const double M = bounds.rising();
    if (device.held_line && device.held_line->largest_center) {
        return detail::best_constant(bounds, device);
    }
    if (device.delay_s == 0.0) {
        const double highest = device.held_line ? device.held_line->largest_stiffness.value_or(M) -
                                                      device.held_line->stiffness_step
                                                : M;
        return {SlopeRule::Steepest, std::clamp(M, 0.0, std::max(0.0, highest)), 0.0, motion};
    }
    const auto missing = [&](const HeldSlope& line) { return detail::line_shortfall(bounds, line, device); };
    const HeldSlope plain{SlopeRule::Raised, 0.0, 0.0, std::nullopt};
    if (missing(plain) <= 0.0) {
        return plain;
    }
    const HeldSlope best = detail::best_raised(bounds, device, motion);
    if (missing(best) <= 0.0) {
        return best;
    }
    const HeldSlope flat = detail::best_constant(bounds, device);
    return missing(flat) < missing(best) ? flat : best;
}

/// Wall whose slope rises from 0 to K: f'(x) = K / (1 + exp(-x / width)), with the curvature K / (4 width).
[[nodiscard]] inline ForceBounds wall_bounds(double stiffness, double width) noexcept {
    ForceBounds bounds;
    bounds.slope = {0.0, stiffness};
    bounds.steepest = bounds.sliding = stiffness;
    bounds.bend = BendBounds{0.25 * stiffness / width, 0.0};
    return bounds;
}

/// Returns the largest stiffness K of a wall of this width that a line renders, certified for motions up to `motion` in
/// a period [N/m]; 0 if no wall is certified. Without a motion the line is certified for every motion.
[[nodiscard]] inline double stiffest_line_wall(const DeviceProfile& device, double width,
                                               std::optional<double> motion) {
    const double most = 1e6 * (1.0 + device.viscous_damping / device.period_s);
    const auto holds = [&](double stiffness) {
        const ForceBounds bounds = wall_bounds(stiffness, width);
        const HeldSlope line =
            motion ? line_for(bounds, device, *motion) : detail::best_constant(bounds, device);
        return detail::line_shortfall(bounds, line, device) <= 0.0;
    };
    double low = 0.0;
    double high = most;
    for (int k = 0; k < 20 && low == 0.0; ++k) {
        const double guess = std::ldexp(most, -3 * (k + 1));
        (holds(guess) ? low : high) = guess;
    }
    for (int k = 0; k < 20 && low > 0.0; ++k) {
        const double middle = 0.5 * (low + high);
        (holds(middle) ? low : high) = middle;
    }
    return low;
}

}  // namespace palpate
