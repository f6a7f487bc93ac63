// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/field_table.hpp"
#include "palpate/model/fingerprint.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/admittance_inequalities.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/coupled_inequalities.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/explicit_inequalities.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"
#include "palpate/stability/tangent_inequalities.hpp"

// Definitions of the functions that compute a certificate from all inequalities.
namespace palpate {

PALPATE_INLINE std::string fingerprint_of(const Certificate& certificate) {
    detail::NumberHash hash;
    for_each_field<Certificate>([&](const auto& field) {
        const auto& value = field.of(certificate);
        if constexpr (std::is_same_v<decltype(value), const Scheme&>) {
            detail::hash_value(hash, used_part(value));
        } else if (field.stored && field.name != std::string_view{"fingerprint"}) {
            detail::hash_value(hash, value);
        }
    });
    return hash.text();
}

PALPATE_INLINE std::uint32_t checksum(const DeviceProfile& device) {
    detail::NumberHash hash;
    detail::hash_value(hash, device);
    return static_cast<std::uint32_t>(hash.bits() ^ (hash.bits() >> 32U));
}

PALPATE_INLINE std::vector<Inequality> inequalities_of(const ForceBounds& bounds, const Scheme& scheme,
                                                       const DeviceProfile& device) {
    if (device.admittance) {
        return admittance_inequalities(bounds, scheme, device);
    }
    std::vector<Inequality> lines = with_kind(
        scheme.structure, [&](auto structure) { return inequalities(structure, bounds, scheme, device); });
    if (is_uncoupled(scheme)) {
        lines.push_back({"uncoupled", "object without a coupling on a device that applies forces",
                         "needs an admittance display", 0.0, 1.0, Basis::None, "use a virtual coupling"});
    }
    if (bounds.drag > 0.0 && !traits_of(scheme.structure).velocity) {
        lines.push_back({"velocity-coupling", "force that depends on velocity, without direct rendering",
                         "proved only for B_v = 0", 0.0, bounds.drag, Basis::None, "use direct rendering"});
    }
    return lines;
}

namespace detail {

/// Returns the longest time between two samples for which every inequality holds with all other numbers unchanged [s],
/// at most 100 times the longest period of the device. Most right sides of the inequalities are proportional to the
/// period, so the period computed from this proportion is tried before a bisection.
[[nodiscard]] inline double longest_period(const std::vector<Inequality>& lines, const ForceBounds& bounds,
                                           const Scheme& scheme, const DeviceProfile& device) {
    constexpr double most = 100.0;
    const double T = device.longest_period_s();
    const auto lines_at = [&](double factor) {
        DeviceProfile later = device;
        later.jitter_s = factor * T - device.period_s;
        return inequalities_of(bounds, scheme, later);
    };
    const auto holds = [&](double factor) { return all_hold(lines_at(factor)); };
    double guess = most;
    const std::vector<Inequality> doubled = lines_at(2.0);
    for (std::size_t k = 0; k < lines.size(); ++k) {
        const double growth = doubled[k].right - lines[k].right;
        if (growth > 0.0) {
            guess = std::min(guess, 1.0 + lines[k].margin() / growth);
        }
    }
    double low = 1.0;
    double high = most;
    if (const double below = guess * (1.0 - 1e-12); below > 1.0 && holds(below)) {
        if (guess == most || !holds(guess * (1.0 + 1e-9))) {
            return below * T;
        }
        low = below;
    } else {
        high = guess;
    }
    for (int k = 0; k < 40; ++k) {
        const double middle = 0.5 * (low + high);
        (holds(middle) ? low : high) = middle;
    }
    return low * T;
}

}  // namespace detail

PALPATE_INLINE ForceBounds rendered_bounds(const ForceBounds& bounds, const Scheme& scheme) noexcept {
    return scheme.compensated ? compensated(bounds, scheme.coupling.stiffness) : bounds;
}

PALPATE_INLINE Certificate certify_rendered(const ForceBounds& bounds, const Scheme& scheme,
                                            const DeviceProfile& device) {
    Certificate certificate;
    certificate.scheme = scheme;
    certificate.device = certified_part(device, holds_line(scheme.structure));
    certificate.bounds = bounds;
    std::vector<Inequality> lines = inequalities_of(bounds, scheme, device);
    const bool is_finite = finite(bounds);
    if (is_finite && all_hold(lines)) {
        const bool proved = std::all_of(lines.begin(), lines.end(),
                                        [](const Inequality& line) { return line.basis != Basis::Linear; });
        certificate.verdict = proved ? Verdict::Certified : Verdict::StableLocally;
        certificate.longest_period_s = detail::longest_period(lines, bounds, scheme, device);
    }
    certificate.reason = is_finite ? detail::reason(lines, certificate.verdict)
                                   : "a bound of the model is not a finite number";
    certificate.inequalities = std::move(lines);
    certificate.fingerprint = fingerprint_of(certificate);
    return certificate;
}

PALPATE_INLINE Certificate certify(const ForceBounds& bounds, const Scheme& scheme,
                                   const DeviceProfile& device) {
    return certify_rendered(rendered_bounds(bounds, scheme), scheme, device);
}

PALPATE_INLINE ForceBounds rendered_bounds(const ForceModel& model, const Scheme& scheme,
                                           const DeviceProfile& device) {
    const double limit =
        has_mass(scheme.structure) ? std::numeric_limits<double>::infinity() : device.force_limit;
    ForceBounds bounds = rendered_bounds(force_bounds(model, scheme.play_radius, limit), scheme);
    if (traits_of(scheme.structure).may_reduce_hysteresis && model.hysteresis() != nullptr) {
        bounds.mean_force =
            detail::active_mean({model.hysteresis()->force(), nullptr, bounds.sliding}, limit);
    }
    if (holds_line(scheme.structure)) {
        bounds.bend = bend_bounds(model);
    }
    return bounds;
}

PALPATE_INLINE Certificate certify(const ForceModel& model, const Scheme& scheme,
                                   const DeviceProfile& device) {
    validate(device);
    validate(scheme, model);
    Certificate certificate = certify_rendered(rendered_bounds(model, scheme, device), scheme, device);
    certificate.model = fingerprint(model);
    certificate.fingerprint = fingerprint_of(certificate);
    return certificate;
}

PALPATE_INLINE Certificate with_force_error(const Certificate& certificate, double force_error) {
    ForceBounds bounds = certificate.bounds;
    bounds.force_error += force_error;
    Certificate now = certify_rendered(bounds, certificate.scheme, certificate.device);
    now.model = certificate.model;
    now.fingerprint = certificate.fingerprint;
    return now;
}

}  // namespace palpate
