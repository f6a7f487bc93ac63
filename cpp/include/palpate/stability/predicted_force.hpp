// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/rendering/direct.hpp"
#include "palpate/stability/held_force.hpp"

namespace palpate {

/// Returns Q of a force that is delayed by n samples at a position predicted from m samples, as taps of z^-1, z^-2,
/// ...:
///
///     Q = z^-1 + ... + z^-n - z^-n sum of w_j z^-j.
[[nodiscard]] inline std::vector<double> prediction_taps(int whole, int predict) {
    std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
    for (int j = 1; j <= predict; ++j) {
        taps.push_back(-prediction_weight(predict, j));
    }
    return taps;
}

/// Returns b / T that a force held at a predicted position needs, static or with a play that follows the measured
/// position. The prediction changes the force by at most L |sum of w_j d_{k-j}|, which adds L / 2.
[[nodiscard]] inline double predicted_path_need(const DeviceProfile& device, SlopeRange slopes) {
    return device_need(device, slopes) + 0.5 * slopes.steepest();
}

/// Returns the largest error of a predicted position divided by that of the encoder, (m + 3) / (m + 1). The last sample
/// has the weight (m + 2) / (m + 1), the m before it together 1 / (m + 1).
[[nodiscard]] constexpr double predicted_encoder_gain(int predict) noexcept {
    return predict > 0 ? (predict + 3.0) / (predict + 1.0) : 1.0;
}

/// Returns b / T that a static force held at a predicted position needs: at most R(1/2) without delay; with delay often
/// less than without prediction.
///
/// With jitter the instant at which a command begins to act varies by up to the jitter within its sample. If it can
/// leave the sample, the delay is rounded to whole samples and the rest is treated as unknown motion.
[[nodiscard]] inline double predicted_need(const DeviceProfile& device, int predict, SlopeRange slopes) {
    const double simple = predicted_path_need(device, slopes);
    if (!(slopes.steepest() > 0.0) || !std::isfinite(simple)) {
        return simple;
    }
    const double P = device.period_s;
    const double T = device.longest_period_s();
    const double fraction = device.delay_fraction();
    const double jitter = device.late_samples() > 0 ? device.jitter_s : 0.0;
    const int whole = device.whole_delay_samples();
    if (fraction == 0.0 && jitter == 0.0) {
        return std::min(simple, filtered_need(prediction_taps(whole, predict), slopes));
    }
    if (whole == 0 ? device.delay_s <= P - jitter : jitter <= std::min(fraction, 1.0 - fraction) * P) {
        const double uncertain_s = whole == 0 ? 0.0 : jitter;
        const std::vector<double> taps = prediction_taps(whole, predict);
        const double split = filtered_need(taps, (fraction * P + uncertain_s) / T, slopes,
                                           ((1.0 - fraction) * P + jitter) / T);
        return std::min(simple, std::max(filtered_need(taps, slopes), split));  // a delay may be shorter
    }
    if (jitter >= P) {
        return simple;
    }
    const int nearest = static_cast<int>(std::lround(device.delay_s / P));
    const double nu = detail::uncertain_time(device.delay_s, P, jitter, nearest);
    return std::min(simple, detail::roughly_filtered_need(prediction_taps(nearest, predict),
                                                          predicted_encoder_gain(predict), nu, slopes));
}

}  // namespace palpate
