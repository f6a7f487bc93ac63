// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "palpate/device/device_profile.hpp"
#include "palpate/guard/energy_account.hpp"
#include "palpate/guard/guards.hpp"
#include "palpate/inline.hpp"
#include "palpate/model/force_model.hpp"
#include "palpate/rendering/scale.hpp"
#include "palpate/rendering/scheme.hpp"
#include "palpate/stability/certificate.hpp"

namespace palpate {

/// Returns the settings of the guards of a rendering that only the energy account limits.
[[nodiscard]] inline GuardSettings account_guards(const ForceModel& model, const DeviceProfile& device) {
    return guards_for(scale_of(model, device.position_unit == "rad"), device);
}

/// Returns the energy account of a rendering that nothing else limits.
[[nodiscard]] inline EnergyAccount account_of(const ForceModel& model, const Scheme& scheme,
                                              const DeviceProfile& device) {
    return guards_of(account_guards(model, device), model, scheme, device.period_s).account;
}

/// Returns the certificate of a rendering that is held by the energy account: in no motion of the handle does a hand take
/// more than E0, with any model and structure. It is refused if the account cannot hold the largest force at rest. A
/// motor controller has no energy account, so a model on it is refused.
[[nodiscard]] PALPATE_INLINE Certificate certify_with_account(const ForceModel& model, const Scheme& scheme,
                                                              const DeviceProfile& device);

}  // namespace palpate

#ifndef PALPATE_COMPILED
#include "palpate/stability/detail/account_certificate.hpp"
#endif
