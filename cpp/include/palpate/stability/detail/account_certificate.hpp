// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "palpate/device/device_profile.hpp"
#include "palpate/guard/energy_account.hpp"
#include "palpate/model/fingerprint.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/account_certificate.hpp"
#include "palpate/stability/certificate.hpp"
#include "palpate/stability/detail/certificate.hpp"
#include "palpate/stability/inequality.hpp"

// Definition of certify_with_account.
namespace palpate {

PALPATE_INLINE Certificate certify_with_account(const ForceModel& model, const Scheme& scheme,
                                                const DeviceProfile& device) {
    validate(device);
    validate(scheme, model);
    Certificate certificate;
    certificate.scheme = scheme;
    certificate.device = certified_part(device, holds_line(scheme.structure));
    certificate.bounds = rendered_bounds(model, scheme, device);
    const EnergyAccount account = account_of(model, scheme, device);
    const double stored = account.stored().within();
    std::vector<Inequality> lines{{"account-force", "energy account against the largest force", "2 W >= E_F",
                                   2.0 * stored,
                                   account.most_taken(largest_resting_force(model, device.force_limit)),
                                   Basis::Proved, "docs/certificate.md"}};
    if (device.renderer) {
        lines.push_back({"account-renderer", "energy account on the host",
                         "held only at 0 Hz on a controller", 0.0, 1.0 / device.period_s, Basis::None,
                         "plan without --on-device"});
    }
    if (finite(certificate.bounds) && all_hold(lines)) {
        certificate.verdict = Verdict::HeldByAccount;
        certificate.longest_period_s = device.longest_period_s();
        certificate.reason = "a hand takes at most E_0 = " + readable(stored) + " J, by the energy account";
    } else {
        certificate.reason = detail::reason(lines, Verdict::Refused);
    }
    certificate.inequalities = std::move(lines);
    certificate.model = fingerprint(model);
    certificate.fingerprint = fingerprint_of(certificate);
    return certificate;
}

}  // namespace palpate
