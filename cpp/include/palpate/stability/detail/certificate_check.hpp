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
#include "palpate/stability/certificate_check.hpp"

// Definitions of device_difference and checked.
namespace palpate {

PALPATE_INLINE std::string device_difference(const DeviceProfile& certified, const DeviceProfile& device) {
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

PALPATE_INLINE Certificate checked(const Certificate& stored, const ForceModel& model) {
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
