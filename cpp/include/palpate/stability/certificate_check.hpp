// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/field_table.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/inline.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"

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
[[nodiscard]] PALPATE_INLINE std::string device_difference(const DeviceProfile& certified,
                                                           const DeviceProfile& device);

/// Recomputes a stored certificate and returns the recomputed certificate, with the texts that files do not store. The
/// stored inequalities, verdict and longest period must follow from the stored bounds of the force. The stored bounds
/// must contain the bounds computed from the model. Throws std::invalid_argument with the first field that differs, its
/// stored value and the recomputed value; also if the verdict is `Refused`.
[[nodiscard]] PALPATE_INLINE Certificate checked(const Certificate& stored, const ForceModel& model);

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/stability/detail/certificate_check.hpp"
#endif
