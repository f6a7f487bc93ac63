// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <tuple>

#include "palpate/model/force_model.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate {

/// Whether two computations of one number agree: on another machine the last digits may differ. What is not finite
/// agrees with nothing.
[[nodiscard]] inline bool agree(double stored, double recomputed) noexcept {
    const double larger = std::max(std::abs(stored), std::abs(recomputed));
    return std::isfinite(larger) && std::abs(stored - recomputed) <= 1e-9 * larger;
}

namespace detail {

[[nodiscard]] inline std::string disagrees(const std::string& path, double stored, double recomputed) {
    return "certificate." + path + " is " + readable(stored) + ": must be " + readable(recomputed) +
           ", which is what model and device give; plan it again";
}

/// A bound that is stored must hold for the model; it may be wider than what is computed today, because an older
/// release bounded less sharply and what it proved is still true.
[[nodiscard]] inline std::string tighter_than_true(const ForceBounds& stored, const ForceBounds& now) {
    const auto sentence = [](const char* name, double bound, const char* side, double true_bound) {
        return std::string("certificate.bounds.") + name + " is " + readable(bound) + ": must be " + side +
               " " + readable(true_bound) + ", which is what model and device give; plan it again";
    };
    for (const auto& [name, left, right] : {std::tuple{"slope_min", stored.slope.lower, now.slope.lower},
                                            {"loss_min", stored.loss.lower, now.loss.lower}}) {
        if (!(left <= right || agree(left, right))) {
            return sentence(name, left, "at most", right);
        }
    }
    for (const auto& [name, left, right] : {std::tuple{"slope_max", stored.slope.upper, now.slope.upper},
                                            {"steepest", stored.steepest, now.steepest},
                                            {"sliding", stored.sliding, now.sliding},
                                            {"loss_max", stored.loss.upper, now.loss.upper},
                                            {"loss_per_play", stored.loss_per_play, now.loss_per_play},
                                            {"mean_force", stored.mean_force, now.mean_force},
                                            {"drag", stored.drag, now.drag}}) {
        if (!(left >= right || agree(left, right))) {
            return sentence(name, left, "at least", right);
        }
    }
    return "";
}

[[nodiscard]] inline std::string line_disagrees(const std::string& path, const Inequality& stored,
                                                const Inequality& now) {
    if (stored.id != now.id) {
        return "certificate." + path + ".id is \"" + stored.id + "\": must be \"" + now.id + "\"";
    }
    if (!agree(stored.left, now.left)) {
        return disagrees(path + ".left", stored.left, now.left);
    }
    if (!agree(stored.right, now.right)) {
        return disagrees(path + ".right", stored.right, now.right);
    }
    return "";
}

}  // namespace detail

/// The first field in which a device is not the one that was certified, as a sentence; empty where it is that one.
[[nodiscard]] inline std::string device_difference(const DeviceProfile& certified,
                                                   const DeviceProfile& device) {
    const std::string opening = "the certificate is for the device " + certified.id;
    if (device.id != certified.id) {
        return opening + ", and this is " + device.id + "; plan it again for this one";
    }
    if (device.position_unit != certified.position_unit) {
        return opening + " in " + certified.position_unit + ", and here it moves in " + device.position_unit;
    }
    for (const auto& [name, before, now] :
         {std::tuple{"period_s", certified.period_s, device.period_s},
          {"jitter_s", certified.jitter_s, device.jitter_s},
          {"inertia", certified.inertia, device.inertia},
          {"viscous_damping", certified.viscous_damping, device.viscous_damping},
          {"coulomb_friction", certified.coulomb_friction, device.coulomb_friction},
          {"encoder_step", certified.encoder_step, device.encoder_step},
          {"force_step", certified.force_step, device.force_step},
          {"delay_s", certified.delay_s, device.delay_s},
          {"force_limit", certified.force_limit, device.force_limit}}) {
        if (!agree(before, now)) {
            return opening + " with " + name + " = " + readable(before) + ", and here it is " +
                   readable(now) + "; plan it again";
        }
    }
    return "";
}

/// Computes a stored certificate again and returns the result, with its texts. The stored sides, verdict and period
/// must follow from the stored bounds. The stored bounds must be no narrower than the bounds computed from the model.
/// Throws std::invalid_argument with the first field that differs, its value and the right one.
[[nodiscard]] inline Certificate checked(const Certificate& stored, const ForceModel& model) {
    const auto require = [](const std::string& wrong) { detail::require(wrong.empty(), wrong); };
    if (const std::string now = fingerprint(model); stored.model != now) {
        require("certificate.model is \"" + stored.model + "\": must be \"" + now +
                "\", that of this network; it was changed after it was certified, plan it again");
    }
    ForceBounds bounds;
    try {
        validate(stored.device);
        validate(stored.scheme, model);
        bounds = rendered_bounds(model, stored.scheme, stored.device);
    } catch (const std::invalid_argument& error) {
        require(std::string("certificate is of an impossible plan: ") + error.what());
    }
    require(detail::tighter_than_true(stored.bounds, bounds));
    Certificate now = certify_rendered(stored.bounds, stored.scheme, stored.device);
    if (stored.verdict != now.verdict || now.verdict == Verdict::Refused) {
        require("certificate.verdict is \"" + std::string(name_of(stored.verdict)) + "\": must be \"" +
                std::string(name_of(now.verdict)) + "\", " + now.why);
    }
    if (stored.inequalities.size() != now.inequalities.size()) {
        require("certificate.inequalities has " + std::to_string(stored.inequalities.size()) +
                " lines: must have " + std::to_string(now.inequalities.size()));
    }
    for (std::size_t k = 0; k < now.inequalities.size(); ++k) {
        const std::string path = "inequalities[" + std::to_string(k) + "]";
        require(detail::line_disagrees(path, stored.inequalities[k], now.inequalities[k]));
        // Another machine may round differently: keep the stored numbers, which the fingerprint covers.
        now.inequalities[k].left = stored.inequalities[k].left;
        now.inequalities[k].right = stored.inequalities[k].right;
    }
    if (!agree(stored.longest_period_s, now.longest_period_s)) {
        require(detail::disagrees("longest_period_s", stored.longest_period_s, now.longest_period_s));
    }
    if (const std::string right = fingerprint_of(stored); stored.fingerprint != right) {
        require("certificate.fingerprint is \"" + stored.fingerprint + "\": must be \"" + right +
                "\"; the certificate was edited, plan it again");
    }
    now.longest_period_s = stored.longest_period_s;
    now.model = stored.model;
    now.fingerprint = stored.fingerprint;
    return now;
}

}  // namespace palpate
