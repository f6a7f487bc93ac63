// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/model/fingerprint.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/coupled_inequalities.hpp"
#include "palpate/stability/direct_inequalities.hpp"
#include "palpate/stability/explicit_inequalities.hpp"
#include "palpate/stability/force_bounds.hpp"
#include "palpate/stability/inequality.hpp"

namespace palpate {

enum class Verdict : std::uint8_t {
    Certified,      ///< no motion of the handle can take more energy out than went in
    StableLocally,  ///< the linearised system is stable; energy is not accounted for
    Refused,
};

inline constexpr std::array<std::string_view, 3> verdict_names{"certified", "stable-locally", "refused"};

[[nodiscard]] constexpr std::string_view name_of(Verdict verdict) noexcept {
    return verdict_names[static_cast<std::size_t>(verdict)];
}

/// What is proved of a model, rendered by a scheme, on a device: every inequality with both its sides.
struct Certificate {
    Scheme scheme;
    DeviceProfile device;
    std::string model;   ///< its fingerprint; empty where only bounds were certified
    ForceBounds bounds;  ///< of the force that is rendered, compensation included
    std::vector<Inequality> inequalities;
    Verdict verdict = Verdict::Refused;
    std::string why;                ///< one sentence
    double longest_period_s = 0.0;  ///< up to which all inequalities hold; 0 where they do not
    std::string fingerprint;        ///< of every number and name above, as `fingerprint_of` computes it

    [[nodiscard]] bool certified() const noexcept { return verdict == Verdict::Certified; }
};

/// 16 hexadecimal digits that change with every number and name of a certificate: model, scheme, each field of the
/// device, bounds, sides of each line, verdict. Detects a certificate that was edited; it is no signature.
[[nodiscard]] inline std::string fingerprint_of(const Certificate& certificate) {
    detail::NumberHash hash;
    hash.add(certificate.model);
    const Scheme& scheme = certificate.scheme;
    hash.add(static_cast<std::uint64_t>(scheme.structure));
    const bool coupled = scheme.structure != StructureKind::Direct;
    const bool heavy = has_mass(scheme.structure);
    for (const double number :
         {coupled ? scheme.coupling.stiffness : 0.0, coupled ? scheme.coupling.damping : 0.0,
          heavy ? scheme.inertia.mass : 0.0, heavy ? scheme.inertia.damping : 0.0,
          scheme.compensated ? 1.0 : 0.0, scheme.play_radius, static_cast<double>(scheme.predict)}) {
        hash.add(number);
    }
    const DeviceProfile& device = certificate.device;
    hash.add(device.id);
    hash.add(device.position_unit);
    for (const double number :
         {device.period_s, device.inertia, device.viscous_damping, device.coulomb_friction,
          device.encoder_step, device.force_step, device.delay_s, device.force_limit, device.jitter_s}) {
        hash.add(number);
    }
    const ForceBounds& bounds = certificate.bounds;
    for (const double number :
         {bounds.slope.lower, bounds.slope.upper, bounds.steepest, bounds.sliding, bounds.loss.lower,
          bounds.loss.upper, bounds.loss_per_play, bounds.mean_force, bounds.drag}) {
        hash.add(number);
    }
    for (const Inequality& line : certificate.inequalities) {
        hash.add(line.id);
        hash.add(line.left);
        hash.add(line.right);
    }
    hash.add(static_cast<std::uint64_t>(certificate.verdict));
    hash.add(certificate.longest_period_s);
    return hash.text();
}

namespace detail {

/// The inequalities of a structure behind a coupling, of a force of position.
[[nodiscard]] inline std::vector<Inequality> inequalities_behind_a_coupling(const ForceBounds& bounds,
                                                                            const Scheme& scheme,
                                                                            const DeviceProfile& device) {
    switch (scheme.structure) {
        case StructureKind::Massless:
            return massless_inequalities(bounds, scheme.coupling, device);
        case StructureKind::Implicit:
            return implicit_inequalities(bounds, scheme.inertia, scheme.coupling, device);
        case StructureKind::EnergyConsistent:
            return energy_consistent_inequalities(bounds, scheme.inertia, scheme.coupling, device);
        default:
            return explicit_inequalities(bounds, scheme.inertia, scheme.coupling, device);
    }
}

}  // namespace detail

/// The inequalities of a scheme, whatever they say. Fields that the structure has no use for are ignored.
[[nodiscard]] inline std::vector<Inequality> inequalities_of(const ForceBounds& bounds, const Scheme& scheme,
                                                             const DeviceProfile& device) {
    if (scheme.structure == StructureKind::Direct) {
        if (bounds.drag > 0.0) {
            std::vector<Inequality> lines = velocity_inequalities(bounds, device);
            if (scheme.predict > 0) {
                lines.push_back({"velocity-prediction", "prediction of a force of velocity", "B_v = 0", 0.0,
                                 bounds.drag, Basis::None, "docs/certificate.md"});
            }
            return lines;
        }
        return bounds.hysteresis ? hysteresis_inequalities(bounds, device, scheme.predict)
                                 : direct_inequalities(bounds, device, scheme.predict);
    }
    std::vector<Inequality> lines = detail::inequalities_behind_a_coupling(bounds, scheme, device);
    if (bounds.drag > 0.0) {
        lines.push_back({"velocity-coupling", "force of velocity behind a coupling", "B_v = 0", 0.0,
                         bounds.drag, Basis::None, "use direct rendering"});
    }
    return lines;
}

namespace detail {

/// The longest period for which every line holds, all else equal; at most 100 times the longest one asked for. Most
/// right sides grow with it in proportion, so that guess is tried before a bisection.
[[nodiscard]] inline double longest_period(const std::vector<Inequality>& lines, const ForceBounds& bounds,
                                           const Scheme& scheme, const DeviceProfile& device) {
    constexpr double most = 100.0;
    const double T = device.longest_period_s();
    const auto lines_at = [&](double factor) {
        DeviceProfile later = device;
        later.jitter_s = factor * T - device.period_s;
        return inequalities_of(bounds, scheme, later);
    };
    const auto holds = [&](double factor) {
        const std::vector<Inequality> later = lines_at(factor);
        return std::all_of(later.begin(), later.end(), [](const Inequality& line) { return line.holds(); });
    };
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
    if (low > 1.0 && holds(high)) {
        return high * T;
    }
    for (int k = 0; k < 40; ++k) {
        const double middle = 0.5 * (low + high);
        (holds(middle) ? low : high) = middle;
    }
    return low * T;
}

[[nodiscard]] inline const Inequality* tightest(const std::vector<Inequality>& lines) noexcept {
    const Inequality* least = nullptr;
    const auto room = [](const Inequality& line) { return line.margin() / std::abs(line.left); };
    for (const Inequality& line : lines) {
        if (line.left != 0.0 && (least == nullptr || room(line) < room(*least))) {
            least = &line;
        }
    }
    return least;
}

[[nodiscard]] inline std::string reason(const std::vector<Inequality>& lines, Verdict verdict) {
    for (const Inequality& line : lines) {
        if (!line.holds()) {
            return (line.rests_on == Basis::None ? "no bound is known: " : "") + shortfall(line);
        }
    }
    std::string text = verdict == Verdict::Certified
                           ? "every inequality is proved and holds"
                           : "the linearised system is stable; energy is not accounted for";
    if (const Inequality* least = tightest(lines)) {
        text += "; the tightest, " + least->name + ", has " +
                readable(100.0 * least->margin() / std::abs(least->left)) + " % to spare";
    }
    return text;
}

}  // namespace detail

/// The bounds of the force that a scheme renders: those of the model, the coupling taken out where it says so.
[[nodiscard]] inline ForceBounds rendered_bounds(const ForceBounds& bounds, const Scheme& scheme) noexcept {
    return scheme.compensated ? compensated(bounds, scheme.coupling.stiffness) : bounds;
}

/// What is proved of any rendered force within bounds. Wider bounds never prove more.
[[nodiscard]] inline Certificate certify_rendered(const ForceBounds& bounds, const Scheme& scheme,
                                                  const DeviceProfile& device) {
    Certificate certificate{scheme, device, "", bounds, {}, Verdict::Refused, "", 0.0, ""};
    std::vector<Inequality> lines = inequalities_of(certificate.bounds, scheme, device);
    const auto all = [&](const auto& condition) {
        return std::all_of(lines.begin(), lines.end(), condition);
    };
    if (!certificate.bounds.finite()) {
        certificate.why = "a bound of the model is not a finite number";
        certificate.inequalities = std::move(lines);
        return certificate;
    }
    if (all([](const Inequality& line) { return line.holds(); })) {
        const bool proved = all([](const Inequality& line) { return line.rests_on != Basis::Linear; });
        certificate.verdict = proved ? Verdict::Certified : Verdict::StableLocally;
        certificate.longest_period_s = detail::longest_period(lines, certificate.bounds, scheme, device);
    }
    certificate.why = detail::reason(lines, certificate.verdict);
    certificate.inequalities = std::move(lines);
    certificate.fingerprint = fingerprint_of(certificate);
    return certificate;
}

/// What is proved of any force within bounds, rendered by a scheme on a device.
[[nodiscard]] inline Certificate certify(const ForceBounds& bounds, const Scheme& scheme,
                                         const DeviceProfile& device) {
    return certify_rendered(rendered_bounds(bounds, scheme), scheme, device);
}

/// Bounds of a model's force that a scheme renders on a device. The mean of a force that repeats is that of the limited
/// force. An object with mass has the unlimited one, and the energy-consistent step need not lose what the play loses.
[[nodiscard]] inline ForceBounds rendered_bounds(const ForceModel& model, const Scheme& scheme,
                                                 const DeviceProfile& device) {
    const double limit =
        has_mass(scheme.structure) ? std::numeric_limits<double>::infinity() : device.force_limit;
    ForceBounds bounds = rendered_bounds(force_bounds(model, scheme.play_radius, limit), scheme);
    if (scheme.structure == StructureKind::EnergyConsistent && model.hysteresis() != nullptr) {
        bounds.mean_force = detail::mean_push({model.hysteresis()->force(), nullptr, bounds.sliding}, limit);
    }
    return bounds;
}

/// What is proved of a model rendered by a scheme on a device. A refusal is an answer, with its reason; a scheme
/// or a profile that is impossible throws std::invalid_argument.
[[nodiscard]] inline Certificate certify(const ForceModel& model, const Scheme& scheme,
                                         const DeviceProfile& device) {
    validate(device);
    validate(scheme, model);
    Certificate certificate = certify_rendered(rendered_bounds(model, scheme, device), scheme, device);
    certificate.model = fingerprint(model);
    certificate.fingerprint = fingerprint_of(certificate);
    return certificate;
}

}  // namespace palpate
