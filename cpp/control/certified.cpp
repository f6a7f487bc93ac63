// SPDX-License-Identifier: Apache-2.0
#include "certified.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "palpate/fields/readable.hpp"

namespace palpate::control {

namespace {

constexpr double rounding = 1e-6;  ///< what a profile written by hand may be off by, relative

[[nodiscard]] bool differs(double certified, double measured) {
    return std::abs(certified - measured) > rounding * std::abs(measured);
}

}  // namespace

void keep_to(const Certificate& certificate, GuardSettings& guards, LoopSettings& loop) {
    guards.certified = true;
    guards.slew_s = 0.0;
    guards.force_limit = certificate.device.force_limit;
    guards.device_damping = certificate.device.viscous_damping;
    guards.device_friction = certificate.device.coulomb_friction;
    loop.tolerated = 0;
    loop.lowest_rate_share = std::max(loop.lowest_rate_share, certified_rate_share);
    loop.longest_period_s = certificate.longest_period_s;
}

std::string not_certified(const ModelFile& file, const Options& options, const DeviceProfile& device) {
    if (!file.certificate) {
        return "has no certificate";
    }
    const DeviceProfile& certified = file.certificate->device;
    if (!file.certificate->certified()) {
        return "is not certified: " + file.certificate->why;
    }
    if (certified.id != device.id) {
        return "is certified for the device " + certified.id + ", not for " + device.id;
    }
    if (differs(certified.period_s, device.period_s)) {
        return "is certified for a period of " + readable(1e3 * certified.period_s) + " ms, the device has " +
               readable(1e3 * device.period_s) + " ms";
    }
    if (certified.encoder_step < device.encoder_step &&
        differs(certified.encoder_step, device.encoder_step)) {
        return "is certified for an encoder step of " + readable(certified.encoder_step) +
               " rad, the device has " + readable(device.encoder_step) + " rad";
    }
    if (certified.force_limit > device.force_limit && differs(certified.force_limit, device.force_limit)) {
        return "is certified for " + readable(certified.force_limit) + " N*m, the device makes " +
               readable(device.force_limit) + " N*m";
    }
    if (chooses_rendering(options)) {
        return "is certified as it was planned: leave out --structure and its numbers, --force-limit, "
               "--slew-s, "
               "--tolerated-samples";
    }
    return "";
}

Job job_on_real_device(const Options& options, ModelFile file, RecordUnits units, const TestRig& rig) {
    if (!options.uncertified) {
        if (const std::string reason = not_certified(file, options, rig.device); !reason.empty()) {
            refuse(options.model + " " + reason +
                   "; make a certificate with 'palpate plan', or type --uncertified to render without");
        }
    }
    const Scheme scheme = scheme_of(options, file, rig);
    GuardSettings guards = guards_of(options, rig);
    LoopSettings loop = options.loop;
    if (!options.uncertified) {
        keep_to(*file.certificate, guards, loop);
    }
    return job_of(options, std::move(file), std::move(units), scheme, guards, loop);
}

}  // namespace palpate::control
