// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <stdexcept>
#include <vector>

#include "palpate/simulation/closed_loop.hpp"

namespace palpate {

/// Errors of a rendered force F, compared with the model's force f at the true position x(t) of the handle, over all
/// ticks. Each tick lasts from t_k to t_k + T, and the device holds F. The errors differ in the time of comparison:
/// - end: F(t_k + T) - f(x(t_k + T)), RMS
/// - instant: F(t_k + T) - f(x(t_k)), RMS
/// - mean: e_k = (1/T) integral of F(t) - f(x(t)) dt, RMS
/// - band: e_k after a low-pass of 50 Hz without phase shift, RMS
/// - work: integral of (F - f) dx over all ticks; below 0 the rendering absorbs less energy than the model
///
/// The error `end` is small also for a force that wrongly leads the motion. The error `mean` is not, so it describes
/// the error that a hand feels, because a hand is slow compared with the sample rate.
struct ForceError {
    double end = 0.0;  ///< RMS error of the rendered force at the end of the tick [N or N*m]
    /// RMS error of the rendered force for the position at the start of the tick [N or N*m]
    double instant = 0.0;
    double mean = 0.0;  ///< RMS of the mean force error of each tick [N or N*m]
    double band = 0.0;  ///< RMS of the mean force error of each tick, parts above 50 Hz removed [N or N*m]
    double work = 0.0;  ///< work of the handle against the force error [J]
};

/// Parts of the force error above this frequency are removed for `ForceError::band` [Hz].
inline constexpr double force_error_band_hz = 50.0;

/// Removes the part of a signal above the frequency f, without a phase shift. Convolves the signal with
/// sin(2 pi f t) / (pi t) under a Hann window from -4 / f to 4 / f. The signal is mirrored at its ends. The amplitude
/// at the frequency f is halved.
[[nodiscard]] inline std::vector<double> below_frequency(std::span<const double> signal, double period_s,
                                                         double frequency_hz) {
    const double cycles = frequency_hz * period_s;
    if (cycles >= 0.5 || signal.empty()) {
        return {signal.begin(), signal.end()};
    }
    const auto half = static_cast<std::ptrdiff_t>(std::ceil(4.0 / cycles));
    std::vector<double> kernel;
    double sum = 0.0;
    for (std::ptrdiff_t k = -half; k <= half; ++k) {
        const double angle = 2.0 * std::numbers::pi * cycles * static_cast<double>(k);
        const double sinc = k == 0 ? 1.0 : std::sin(angle) / angle;
        const double share = static_cast<double>(k) / static_cast<double>(half + 1);
        kernel.push_back(sinc * (0.5 + 0.5 * std::cos(std::numbers::pi * share)));
        sum += kernel.back();
    }
    const auto size = static_cast<std::ptrdiff_t>(signal.size());
    std::vector<double> filtered;
    filtered.reserve(signal.size());
    for (std::ptrdiff_t n = 0; n < size; ++n) {
        double value = 0.0;
        for (std::ptrdiff_t k = -half; k <= half; ++k) {
            std::ptrdiff_t at = n + k;
            while (at < 0 || at >= size) {
                at = at < 0 ? -1 - at : 2 * size - 1 - at;
            }
            value += kernel[static_cast<std::size_t>(k + half)] * signal[static_cast<std::size_t>(at)];
        }
        filtered.push_back(value / sum);
    }
    return filtered;
}

/// True positions of the handle and forces of the device, one value for each tick.
struct HeldForces {
    std::span<const double> start;         ///< handle position at the start of the tick [m or rad]
    std::span<const double> middle;        ///< handle position in the middle of the tick [m or rad]
    std::span<const double> end;           ///< handle position at the end of the tick [m or rad]
    std::span<const double> applied;       ///< force of the motor at the end of the tick [N or N*m]
    std::span<const double> mean_applied;  ///< mean force of the motor during the tick [N or N*m]
};

/// Returns the positions and forces of a simulated rendering that the force error needs.
[[nodiscard]] inline HeldForces held_forces(const Trace& trace) noexcept {
    return {trace.handle_start, trace.handle_middle, trace.handle_end, trace.applied, trace.mean_applied};
}

/// Returns the errors of applied forces, compared with the force law `law(motion, step_s)`, which returns the force f
/// along a motion with a constant time step. In each tick f is evaluated at four evenly spaced times; the motion in the
/// tick is the parabola through the positions at start, middle and end.
template <class Law>
[[nodiscard]] ForceError force_error(const HeldForces& held, double period_s, Law&& law) {
    const std::size_t ticks = held.start.size();
    for (const std::span<const double> column : {held.middle, held.end, held.applied, held.mean_applied}) {
        if (column.size() != ticks) {
            throw std::invalid_argument("every column of force_error must have as many values as start, " +
                                        std::to_string(ticks) + ", not " + std::to_string(column.size()));
        }
    }
    if (ticks == 0) {
        return {};
    }
    constexpr std::size_t parts = 4;
    std::vector<double> motion;  // handle position in the middle of each quarter of a tick
    std::vector<double> moved;   // change of the handle position in each quarter of a tick
    std::vector<double> ends{held.start[0]};
    for (std::size_t k = 0; k < ticks; ++k) {
        const double slope = held.end[k] - held.start[k];
        const double bend = 2.0 * (held.start[k] + held.end[k] - 2.0 * held.middle[k]);
        const auto at = [&](double u) { return held.start[k] + u * (slope - bend * (1.0 - u)); };
        for (std::size_t j = 0; j < parts; ++j) {
            const double u = static_cast<double>(j) / parts;
            motion.push_back(at(u + 0.5 / parts));
            moved.push_back(at(u + 1.0 / parts) - at(u));
        }
        ends.push_back(held.end[k]);
    }
    const std::vector<double> within = law(motion, period_s / parts);
    const std::vector<double> at_ends = law(ends, period_s);
    const std::vector<double> at_starts =
        law(std::vector<double>(held.start.begin(), held.start.end()), period_s);
    ForceError error;
    std::vector<double> means;
    means.reserve(ticks);
    for (std::size_t k = 0; k < ticks; ++k) {
        error.end += std::pow(held.applied[k] - at_ends[k + 1], 2);
        error.instant += std::pow(held.applied[k] - at_starts[k], 2);
        double mean = 0.0;
        for (std::size_t j = 0; j < parts; ++j) {
            const double difference = held.mean_applied[k] - within[parts * k + j];
            mean += difference / parts;
            error.work += difference * moved[parts * k + j];
        }
        means.push_back(mean);
        error.mean += mean * mean;
    }
    for (const double value : below_frequency(means, period_s, force_error_band_hz)) {
        error.band += value * value;
    }
    for (double* sum : {&error.end, &error.instant, &error.mean, &error.band}) {
        *sum = std::sqrt(*sum / static_cast<double>(ticks));
    }
    return error;
}

/// Returns the errors of a simulated rendering, compared with the force of the model itself at the true positions of
/// the handle. `play_radius` is the play radius of a hysteresis model; 0 = that of the model.
[[nodiscard]] inline ForceError force_error(const ForceModel& model, double play_radius,
                                            const HeldForces& held, double period_s) {
    Scheme exact;
    exact.structure = StructureKind::Direct;
    exact.play_radius = play_radius;
    return force_error(held, period_s, [&](std::span<const double> motion, double step_s) {
        std::vector<double> force;
        force.reserve(motion.size());
        for (const Rendered& rendered : motion_driven(model, exact, motion, step_s)) {
            force.push_back(rendered.force);
        }
        return force;
    });
}

}  // namespace palpate
