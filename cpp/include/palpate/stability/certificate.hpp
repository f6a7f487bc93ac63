// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/field_table.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/inline.hpp"
#include "palpate/model/fingerprint.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"

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

/// Returns 16 hexadecimal digits that change with every stored number and name of a certificate: model, scheme (without
/// coupling and object mass that its structure does not use), device, bounds, sides of each line, verdict. The digits
/// detect an edited certificate; they are not a signature.
[[nodiscard]] PALPATE_INLINE std::string fingerprint_of(const Certificate& certificate);

/// Returns 32 bits that change with every number and name of a device profile. A program in C compares them with those
/// of the device for which its model was exported.
[[nodiscard]] PALPATE_INLINE std::uint32_t checksum(const DeviceProfile& device);

/// Returns the inequalities of a certificate for a force with these bounds, rendered by a scheme on a device.
/// Inequalities that do not hold are included. Numbers of the scheme that its structure does not use are ignored.
[[nodiscard]] PALPATE_INLINE std::vector<Inequality> inequalities_of(const ForceBounds& bounds,
                                                                     const Scheme& scheme,
                                                                     const DeviceProfile& device);

/// Returns bounds of the rendered force: the bounds of the model, or those of the compensated model if the scheme is
/// compensated.
[[nodiscard]] PALPATE_INLINE ForceBounds rendered_bounds(const ForceBounds& bounds,
                                                         const Scheme& scheme) noexcept;

/// Returns a certificate that holds for any rendered force whose slopes, hysteresis and mean lie within `bounds`. Wider
/// bounds never prove more.
[[nodiscard]] PALPATE_INLINE Certificate certify_rendered(const ForceBounds& bounds, const Scheme& scheme,
                                                          const DeviceProfile& device);

/// Returns a certificate that holds for any model whose slopes, hysteresis and mean lie within `bounds`, rendered by a
/// scheme on a device.
[[nodiscard]] PALPATE_INLINE Certificate certify(const ForceBounds& bounds, const Scheme& scheme,
                                                 const DeviceProfile& device);

/// Returns bounds of a model's force as a scheme renders it on a device. The mean of a periodic force is computed with
/// the force limit of the device, but without a force limit for a virtual object with mass. The energy-consistent
/// structure may dissipate less energy than the hysteresis of the model, so its mean force is computed without
/// hysteresis.
[[nodiscard]] PALPATE_INLINE ForceBounds rendered_bounds(const ForceModel& model, const Scheme& scheme,
                                                         const DeviceProfile& device);

/// Returns the certificate of a model that a scheme renders on a device. A refused certificate contains the reason; an
/// impossible scheme or device profile throws std::invalid_argument.
[[nodiscard]] PALPATE_INLINE Certificate certify(const ForceModel& model, const Scheme& scheme,
                                                 const DeviceProfile& device);

/// Returns the certificate of the same rendering by another program, such as an exported model, whose force differs by
/// at most `force_error` [N or N*m] from the force with the certified bounds. Friction must exceed the sum of all force
/// errors. Model and fingerprint remain those of `certificate`, which a model file stores.
[[nodiscard]] PALPATE_INLINE Certificate with_force_error(const Certificate& certificate, double force_error);

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/stability/detail/certificate.hpp"
#endif
