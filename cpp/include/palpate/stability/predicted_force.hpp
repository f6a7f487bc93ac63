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

/// Returns the filter Q from the handle's steps to the position error, for a force that is delayed by n samples
/// (`whole`) and computed at a position predicted from m samples (`predict`). The elements are the coefficients of
/// z^-1, z^-2, ...:
///
///     Q = z^-1 + ... + z^-n - z^-n sum of w_j z^-j.
[[nodiscard]] inline std::vector<double> prediction_taps(int whole, int predict) {
    std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
    for (int j = 1; j <= predict; ++j) {
        taps.push_back(-prediction_weight(predict, j));
    }
    return taps;
}

/// Returns the device damping divided by the longest period, b / T [N/m], for a held force that is computed at a
/// predicted position. The force may have hysteresis if its play operator follows the measured position. The prediction
/// changes the force by at most L |sum of w_j d_{k-j}| (steepest slope L, prediction weights w, handle's steps d),
/// which adds L / 2 to the result.
[[nodiscard]] inline double predicted_path_need(const DeviceProfile& device, SlopeRange slopes) {
    return device_need(device, slopes) + 0.5 * slopes.steepest();
}

/// Returns the largest error of a predicted position divided by the position error of the encoder, (m + 3) / (m + 1)
/// for a prediction from m samples. The absolute weight of the last sample is (m + 2) / (m + 1); the m samples before
/// it have together the absolute weight 1 / (m + 1).
[[nodiscard]] constexpr double predicted_encoder_gain(int predict) noexcept {
    return predict > 0 ? (predict + 3.0) / (predict + 1.0) : 1.0;
}

/// Returns the device damping divided by the longest period, b / T [N/m], for a held force without hysteresis that is
/// computed at a predicted position. Without delay it is at most R(1/2) of `held_need`; with delay it is often less
/// than without prediction.
///
/// With jitter, the time at which a force begins to act varies within its sample by up to the jitter. If the force can
/// begin to act in another sample, the delay is rounded to whole samples, and the handle's motion during the remaining
/// delay is treated as unknown.
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
        return std::min(
            simple,
            // The true delay may be shorter, so the damping needed without the remaining delay counts too
            std::max(filtered_need(taps, slopes), split));
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
