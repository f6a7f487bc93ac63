// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "../support.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate::energy_search {

/// Damping and friction that a certificate requires of the device.
struct Need {
    double damping = 0.0;   ///< device damping b [N*s/m or N*m*s/rad]
    double friction = 0.0;  ///< Coulomb friction f_c [N or N*m]
};

/// Returns the least device damping and friction with which `certify` accepts the device; nothing if `certify` refuses
/// every device.
template <class Certify>
[[nodiscard]] std::optional<Need> certified_need(DeviceProfile device, const Certify& certify) {
    constexpr double placeholder_damping = 1.2345e6;
    constexpr double any_friction = 5.4321e6;
    device.viscous_damping = placeholder_damping;
    device.coulomb_friction = any_friction;
    const Certificate generous = certify(std::as_const(device));
    if (!generous.certified()) {
        return std::nullopt;
    }
    Need need;
    for (const Inequality& line : generous.inequalities) {
        if (line.left == placeholder_damping) {
            need.damping = std::max(need.damping, line.right);
        } else if (line.left == any_friction) {
            need.friction = std::max(need.friction, line.right);
        }
    }
    return need;
}

/// Returns required damping and friction with slightly less friction than `need`, if another inequality of `certify`
/// then requires more damping instead.
template <class Certify>
[[nodiscard]] std::optional<Need> need_at_less_friction(DeviceProfile device, const Need& need,
                                                        const Certify& certify) {
    constexpr double placeholder_damping = 1.2345e6;
    device.viscous_damping = placeholder_damping;
    device.coulomb_friction = need.friction * (1.0 - 1e-6);
    const Certificate certificate = certify(std::as_const(device));
    if (!certificate.certified()) {
        return std::nullopt;
    }
    Need other;
    for (const Inequality& line : certificate.inequalities) {
        if (line.left == placeholder_damping) {
            other.damping = std::max(other.damping, line.right);
        } else if (line.left == device.coulomb_friction) {
            other.friction = std::max(other.friction, line.right);
        }
    }
    return other;
}

/// A certified scene. `finds_energy` searches a motion that takes energy out, on a device with the given multiples of
/// the required damping and friction.
struct Trial {
    std::function<bool(double damping, double friction)> finds_energy;
    Need need;
    std::string text{};  ///< description of the scene for the message of a failed test
};

enum class Part { Damping, Friction };

/// An inequality of the certificate and the scenes that test it.
struct Line {
    std::string id;      ///< of the inequality
    std::string name;    ///< of the scenes
    double delay = 0.0;  ///< [samples]
    Part part = Part::Damping;
    /// In at least half of the scenes some motion is close to the bound of the inequality.
    bool tight = false;
    std::function<std::optional<Trial>(test::Random&)> draw;

    /// Returns true if a motion takes energy out on a device with `factor` times the need of this inequality and all
    /// of the other needs.
    [[nodiscard]] bool fails(const Trial& trial, double factor) const {
        constexpr double rounding = 1.0 + 1e-9;
        return part == Part::Damping ? trial.finds_energy(factor, rounding)
                                     : trial.finds_energy(rounding, factor);
    }
};

}  // namespace palpate::energy_search
