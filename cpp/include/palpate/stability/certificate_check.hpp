// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "palpate/model/force_model.hpp"
#include "palpate/stability/account_certificate.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate {

/// Returns true if a stored number and its recomputed value differ by at most 1e-9 of the larger one, because another
/// computer may round differently. A number that is not finite agrees with no number.
[[nodiscard]] inline bool agree(double stored, double recomputed) noexcept {
    const double larger = std::max(std::abs(stored), std::abs(recomputed));
    return std::isfinite(larger) && std::abs(stored - recomputed) <= 1e-9 * larger;
}
[[nodiscard]] inline bool agree(std::optional<double> stored, std::optional<double> recomputed) noexcept {
    return stored && recomputed ? agree(*stored, *recomputed) : !stored && !recomputed;
}

namespace detail {

/// Returns the error message for a number of a stored certificate that differs from the recomputed number. `path` is
/// its name in the certificate.
[[nodiscard]] inline std::string disagrees(const std::string& path, double stored, double recomputed,
                                           const char* bound = "") {
    return "certificate." + path + " is " + readable(stored) + ": must be " + bound + readable(recomputed) +
           ", computed from model and device; plan the model again";
}

/// Returns an error message if a stored bound of the force does not hold for the model, otherwise an empty text. A
/// stored bound may be wider than the recomputed bound, because an older release computed wider bounds and its proofs
/// remain valid.
[[nodiscard]] inline std::string narrower_bound(const ForceBounds& stored, const ForceBounds& now) {
    std::string difference;
    for_each_field<ForceBounds>([&](const auto& field) {
        const auto bound = static_cast<double>(field.of(stored));
        const auto recomputed = static_cast<double>(field.of(now));
        const bool lower = std::string_view{field.name}.ends_with("_min");
        if (difference.empty() && !(lower ? bound <= recomputed : bound >= recomputed) &&
            !agree(bound, recomputed)) {
            difference = disagrees(std::string("bounds.") + field.name, bound, recomputed,
                                   lower ? "at most " : "at least ");
        }
    });
    return difference;
}

/// Returns an error message about the first difference between a stored and a recomputed inequality; empty if they
/// agree.
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

/// Returns an error message about the first field in which `device` differs from the device of a certificate; empty if
/// they agree.
[[nodiscard]] inline std::string device_difference(const DeviceProfile& certified,
                                                   const DeviceProfile& device) {
    const std::string opening = "the certificate is for the device " + certified.id;
    std::string difference;
    if (certified.id == device.id && certified.renderer != device.renderer) {
        const auto place = [](const DeviceProfile& profile) {
            return std::string(profile.renderer ? "its motor controller at " : "the host at ") +
                   readable(1.0 / profile.period_s) + " Hz";
        };
        difference = opening + " with the model on " + place(certified) + ", not on " + place(device) +
                     "; plan the model again";
    }
    if (difference.empty() && certified.id == device.id && certified.held_line &&
        certified.held_line != device.held_line) {
        difference = opening + " with other numbers of held_line; plan the model again";
    }
    for_each_field<DeviceProfile>([&](const auto& field) {
        const auto& before = field.of(certified);
        const auto& now = field.of(device);
        if (!difference.empty()) {
            return;
        }
        if constexpr (std::is_same_v<decltype(before), const std::string&>) {
            if (&before == &certified.id && before != now) {
                difference = opening + ", not for " + now + "; plan the model again for this device";
            } else if (before != now) {
                difference = opening + " in " + before + ", not in " + now;
            }
        } else if constexpr (std::is_same_v<decltype(before), const std::optional<AdmittanceDisplay>&>) {
            if (before != now) {
                difference = opening + (!now ? " as an admittance display, not as one that applies forces"
                                        : !before ? ", which applies forces, not for an admittance display"
                                                  : " with another hand or position servo");
                difference += "; plan the model again";
            }
        } else if constexpr (!is_optional<std::remove_cvref_t<decltype(before)>>) {
            // The renderer is compared above; a certificate does not contain the timing of another renderer
            if (!agree(before, now)) {
                difference = opening + " with " + field.name + " = " + readable(before) + ", not " +
                             readable(now) + "; plan the model again";
            }
        }
    });
    return difference;
}

/// Recomputes a stored certificate and returns the recomputed certificate, with the texts that files do not store. The
/// stored inequalities, verdict and longest period must follow from the stored bounds of the force. The stored bounds
/// must contain the bounds computed from the model. Throws std::invalid_argument with the first field that differs, its
/// stored value and the recomputed value; also if the verdict is `Refused`.
[[nodiscard]] inline Certificate checked(const Certificate& stored, const ForceModel& model) {
    const auto require = [](const std::string& difference) {
        detail::require(difference.empty(), difference);
    };
    if (const std::string now = fingerprint(model); stored.model != now) {
        require(
            "certificate.model is \"" + stored.model + "\": must be \"" + now +
            "\", the fingerprint of this network in its units; the model, its units or its certificate was "
            "changed, plan the model again");
    }
    ForceBounds bounds;
    try {
        validate(stored.device);
        validate(stored.scheme, model);
        bounds = rendered_bounds(model, stored.scheme, stored.device);
    } catch (const std::invalid_argument& error) {
        require(std::string("certificate has an invalid plan: ") + error.what());
    }
    require(detail::narrower_bound(stored.bounds, bounds));
    Certificate now = stored.held_by_account()
                          ? certify_with_account(model, stored.scheme, stored.device)
                          : certify_rendered(stored.bounds, stored.scheme, stored.device);
    now.bounds = stored.bounds;
    if (now.verdict == Verdict::Refused && stored.verdict == now.verdict) {
        require("certificate.verdict is \"refused\": must be \"certified\" or \"stable-locally\", " +
                now.reason);
    }
    if (stored.verdict != now.verdict) {
        require("certificate.verdict is \"" + std::string(name_of(stored.verdict)) + "\": must be \"" +
                std::string(name_of(now.verdict)) + "\", " + now.reason);
    }
    if (stored.inequalities.size() != now.inequalities.size()) {
        require("certificate.inequalities has " + std::to_string(stored.inequalities.size()) +
                " lines: must have " + std::to_string(now.inequalities.size()));
    }
    for (std::size_t k = 0; k < now.inequalities.size(); ++k) {
        const std::string path = "inequalities[" + std::to_string(k) + "]";
        require(detail::line_disagrees(path, stored.inequalities[k], now.inequalities[k]));
        // The stored fingerprint was computed from the stored numbers. The returned certificate keeps these numbers,
        // because this computer may round differently from the computer that stored them.
        now.inequalities[k].left = stored.inequalities[k].left;
        now.inequalities[k].right = stored.inequalities[k].right;
    }
    if (!agree(stored.longest_period_s, now.longest_period_s)) {
        require(detail::disagrees("longest_period_s", stored.longest_period_s, now.longest_period_s));
    }
    if (const std::string right = fingerprint_of(stored); stored.fingerprint != right) {
        require("certificate.fingerprint is \"" + stored.fingerprint + "\": must be \"" + right +
                "\"; the certificate was edited, plan the model again");
    }
    now.longest_period_s = stored.longest_period_s;
    now.model = stored.model;
    now.fingerprint = stored.fingerprint;
    return now;
}

}  // namespace palpate
