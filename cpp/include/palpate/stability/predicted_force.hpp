// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/rendering/predicted.hpp"
#include "palpate/stability/held_force.hpp"

namespace palpate {

/// Q of a force that is held n samples late at a position predicted from m samples, as taps of z^-1, z^-2, ...:
///
///     Q = z^-1 + ... + z^-n - z^-n sum of w_j z^-j.
[[nodiscard]] inline std::vector<double> prediction_taps(int whole, int predict) {
    std::vector<double> taps(static_cast<std::size_t>(whole), 1.0);
    for (int j = 1; j <= predict; ++j) {
        taps.push_back(-prediction_weight(predict, j));
    }
    return taps;
}

/// b / T that a force held at a predicted position needs, static or with a play that follows the measured position.
/// The advance changes the force by at most L |sum of w_j d_{k-j}|, which costs L / 2 and no more.
[[nodiscard]] inline double predicted_path_need(const DeviceProfile& device, SlopeRange slopes) {
    return device_need(device, slopes) + 0.5 * slopes.steepest();
}

/// b / T that a static force held at a predicted position needs: R(1/2) or less without delay; with delay often less
/// than without prediction. The larger of whole and fractional delay, because a delay may be shorter than stated.
[[nodiscard]] inline double predicted_need(const DeviceProfile& device, int predict, SlopeRange slopes) {
    const double simple = predicted_path_need(device, slopes);
    if (device.jitter_s > 0.0 && device.late_samples() > 0) {
        return simple;
    }
    const std::vector<double> taps = prediction_taps(device.whole_delay_samples(), predict);
    double sharp = filtered_need(taps, slopes);
    if (device.delay_fraction() > 0.0) {
        sharp = std::max(sharp, filtered_need(taps, device.delay_fraction(), slopes));
    }
    return std::min(simple, sharp);
}

/// Largest error of a predicted position over that of the encoder, (m + 3) / (m + 1): the last sample counts
/// (m + 2) / (m + 1) times, the m before it 1 / (m + 1) together.
[[nodiscard]] constexpr double predicted_encoder_gain(int predict) noexcept {
    return predict > 0 ? (predict + 3.0) / (predict + 1.0) : 1.0;
}

}  // namespace palpate
