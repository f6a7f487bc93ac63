// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
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
#include "palpate/stability/coupled_inequalities.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/explicit_inequalities.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"
#include "palpate/stability/tangent_inequalities.hpp"

namespace palpate {

/// Verdict of a certificate about a rendering.
enum class Verdict : std::uint8_t {
    /// Passive, proved: in no motion of the handle does the device give more energy than it received from the hand,
    /// plus the energy that the object stored at the start
    Certified,
    StableLocally,  ///< the linearised rendering is stable; it is not proved that the rendering is passive
    Refused,
    /// Held by the energy account, proved: in no motion of the handle does a hand take more energy out than E0, the
    /// energy that the object can store
    HeldByAccount,
};

template <>
inline constexpr auto words_of<Verdict> =
    std::array<std::string_view, 4>{"certified", "stable-locally", "refused", "held-by-account"};

/// Result of the checks of a rendering (model, structure with its numbers, device): all inequalities with both sides,
/// and the verdict.
struct Certificate {
    std::string model;
    Scheme scheme;
    DeviceProfile device;
    ForceBounds bounds;
    std::vector<Inequality> inequalities;
    Verdict verdict = Verdict::Refused;
    double longest_period_s = 0.0;
    std::string fingerprint;
    std::string reason;

    /// Returns true if it is proved that the rendering is passive.
    [[nodiscard]] bool certified() const noexcept { return verdict == Verdict::Certified; }
    /// Returns true if the energy that a hand takes is limited by the energy account only.
    [[nodiscard]] bool held_by_account() const noexcept { return verdict == Verdict::HeldByAccount; }
};

template <>
inline constexpr auto fields_of<Certificate> = FieldTable{
    Field<&Certificate::model>{"model", "Fingerprint of the model; empty if only bounds were certified."},
    Field<&Certificate::scheme>{"scheme", "Structure that renders the model, with its numbers."},
    Field<&Certificate::device>{"device", "Device for which the certificate holds."},
    Field<&Certificate::bounds>{"bounds", "Bounds of the rendered force, compensation included."},
    Field<&Certificate::inequalities>{"inequalities", "All inequalities with both sides."},
    Field<&Certificate::verdict>{"verdict", "certified, held-by-account, stable-locally or refused."},
    Field<&Certificate::longest_period_s>{
        "longest_period_s",
        "Longest time between two samples for which every inequality holds [s]; 0 if one does not hold.",
        Rule::NotNegative},
    Field<&Certificate::fingerprint>{"fingerprint",
                                     "16 hexadecimal digits computed from all other stored fields."},
    Field<&Certificate::reason>{"reason", "Reason for the verdict, one sentence.", Rule::Any, false}};

namespace detail {

template <class T>
void hash_value(NumberHash& hash, const T& value) {
    if constexpr (HasFields<T>) {
        for_each_field<T>([&](const auto& field) {
            const auto& part = field.of(value);
            if constexpr (is_optional<std::remove_cvref_t<decltype(part)>>) {
                // An empty optional field does not change the hash, so fingerprints computed before this field existed
                // remain valid
                if (part) {
                    hash.add(std::string_view{field.name});
                    hash_value(hash, *part);
                }
            } else if (field.stored) {
                hash_value(hash, part);
            }
        });
    } else if constexpr (std::is_enum_v<T>) {
        hash.add(static_cast<std::uint64_t>(value));
    } else if constexpr (std::is_arithmetic_v<T>) {
        hash.add(static_cast<double>(value));
    } else if constexpr (std::is_same_v<T, std::string>) {
        hash.add(std::string_view{value});
    } else {
        for (const auto& item : value) {
            hash_value(hash, item);
        }
    }
}

}  // namespace detail

/// Returns 16 hexadecimal digits that change with every stored number and name of a certificate: model, scheme (without
/// coupling and object mass that its structure does not use), device, bounds, sides of each line, verdict. The digits
/// detect an edited certificate; they are not a signature.
[[nodiscard]] inline std::string fingerprint_of(const Certificate& certificate) {
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

/// Returns 32 bits that change with every number and name of a device profile. A program in C compares them with those
/// of the device for which its model was exported.
[[nodiscard]] inline std::uint32_t checksum(const DeviceProfile& device) {
    detail::NumberHash hash;
    detail::hash_value(hash, device);
    return static_cast<std::uint32_t>(hash.bits() ^ (hash.bits() >> 32U));
}

/// Returns the inequalities of a certificate for a force with these bounds, rendered by a scheme on a device.
/// Inequalities that do not hold are included. Numbers of the scheme that its structure does not use are ignored.
[[nodiscard]] inline std::vector<Inequality> inequalities_of(const ForceBounds& bounds, const Scheme& scheme,
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

/// Returns the inequality with the smallest `reserve`, of those whose left side is not 0; null if there is none.
[[nodiscard]] inline const Inequality* tightest(const std::vector<Inequality>& lines) noexcept {
    const Inequality* least = nullptr;
    for (const Inequality& line : lines) {
        if (line.left != 0.0 && (least == nullptr || line.reserve() < least->reserve())) {
            least = &line;
        }
    }
    return least;
}

/// Returns a sentence that explains the verdict: the first inequality that does not hold, or the smallest reserve.
[[nodiscard]] inline std::string reason(const std::vector<Inequality>& lines, Verdict verdict) {
    for (const Inequality& line : lines) {
        if (!line.holds()) {
            return (line.basis == Basis::None ? "no bound is known: " : "") + shortfall(line);
        }
    }
    std::string text = verdict == Verdict::Certified
                           ? "every inequality is proved and holds"
                           : "the linearised system is stable; energy is not accounted for";
    if (const Inequality* least = tightest(lines)) {
        text += "; smallest reserve: " + least->name + ", " + readable(100.0 * least->reserve()) + " %";
    }
    return text;
}

}  // namespace detail

/// Returns bounds of the rendered force: the bounds of the model, or those of the compensated model if the scheme is
/// compensated.
[[nodiscard]] inline ForceBounds rendered_bounds(const ForceBounds& bounds, const Scheme& scheme) noexcept {
    return scheme.compensated ? compensated(bounds, scheme.coupling.stiffness) : bounds;
}

/// Returns a certificate that holds for any rendered force whose slopes, hysteresis and mean lie within `bounds`. Wider
/// bounds never prove more.
[[nodiscard]] inline Certificate certify_rendered(const ForceBounds& bounds, const Scheme& scheme,
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

/// Returns a certificate that holds for any model whose slopes, hysteresis and mean lie within `bounds`, rendered by a
/// scheme on a device.
[[nodiscard]] inline Certificate certify(const ForceBounds& bounds, const Scheme& scheme,
                                         const DeviceProfile& device) {
    return certify_rendered(rendered_bounds(bounds, scheme), scheme, device);
}

/// Returns bounds of a model's force as a scheme renders it on a device. The mean of a periodic force is computed with
/// the force limit of the device, but without a force limit for a virtual object with mass. The energy-consistent
/// structure may dissipate less energy than the hysteresis of the model, so its mean force is computed without
/// hysteresis.
[[nodiscard]] inline ForceBounds rendered_bounds(const ForceModel& model, const Scheme& scheme,
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

/// Returns the certificate of a model that a scheme renders on a device. A refused certificate contains the reason; an
/// impossible scheme or device profile throws std::invalid_argument.
[[nodiscard]] inline Certificate certify(const ForceModel& model, const Scheme& scheme,
                                         const DeviceProfile& device) {
    validate(device);
    validate(scheme, model);
    Certificate certificate = certify_rendered(rendered_bounds(model, scheme, device), scheme, device);
    certificate.model = fingerprint(model);
    certificate.fingerprint = fingerprint_of(certificate);
    return certificate;
}

/// Returns the certificate of the same rendering by another program, such as an exported model, whose force differs by
/// at most `force_error` [N or N*m] from the force with the certified bounds. Friction must exceed the sum of all force
/// errors. Model and fingerprint remain those of `certificate`, which a model file stores.
[[nodiscard]] inline Certificate with_force_error(const Certificate& certificate, double force_error) {
    ForceBounds bounds = certificate.bounds;
    bounds.force_error += force_error;
    Certificate now = certify_rendered(bounds, certificate.scheme, certificate.device);
    now.model = certificate.model;
    now.fingerprint = certificate.fingerprint;
    return now;
}

}  // namespace palpate
