// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "../method.hpp"

namespace palpate::rivals {

/// Energy account: counts the work at the encoder and the certain losses of the device, and reserves the most energy that
/// every pending force can give in its tick. This is r(F) = max over d <= reach of (|F| - f_c) d - b d^2 / T. The reach is 4 times
/// the hands' step; a faster motion ends the force. The hand obtains at most the budget E_0.
struct AccountMethod {
    static constexpr Method about{
        .name = "energy account",
        .source = "this project",
        .proved = "energy <= E_0: every object, motion up to a speed, delay, encoder steps",
        .knows = "b, T, f_c, encoder step, delay, E_0, largest speed",
        .ours = true};
    static double bound(const Scene& /*scene*/) { return every_object; }
    static Rendering make(const Scene& scene) {
        const DeviceProfile& device = scene.profile();
        return {Limited{scene.object.held(scene.period()), device.viscous_damping / device.period_s,
                        device.coulomb_friction, device.encoder_step, scene.budget,
                        4.0 * scene.device.speed * device.period_s, scene.delay()},
                device, scene.object};
    }

    struct Limited {
        AnyStructure object;
        double B, friction, encoder, budget, reach;
        int delay;
        double account = 0.0, last = 0.0, played = 0.0;
        bool ended = false;
        Sent<double> sent{};

        void reset(double position) noexcept {
            object.reset(position), sent.reset();
            account = -0.5 * friction * encoder, last = played = position, ended = false;
        }
        [[nodiscard]] Rendered step(double position) noexcept {
            Rendered rendered = object.step(position);
            const double moved = position - std::exchange(last, position);
            const double sure = std::max(0.0, std::abs(moved) - encoder);
            const double before = std::exchange(played, play(position, played, 0.5 * encoder));
            account += sent[delay] * moved + B * sure * sure + friction * std::abs(played - before) -
                       0.5 * encoder * std::abs(sent[delay] - sent[delay + 1]);
            account = std::max(account, -budget - encoder * (0.5 * std::abs(sent[delay]) + friction));
            double free = account + budget - 0.5 * encoder * std::abs(sent[0]);
            for (int age = 0; age < delay; ++age) {
                const double excess = std::max(0.0, std::abs(sent[age]) - friction);
                const double d = std::min(reach, 0.5 * excess / B);
                free -= (excess - B * d) * d;
            }
            free = std::max(0.0, free);
            const double full = B * reach * reach;  // energy above which a force gives most at the reach
            const double extra = free < full ? 2.0 * std::sqrt(B * free) : (free + full) / reach;
            ended = ended || sure > reach;
            const double most = ended ? 0.0 : friction + extra;
            rendered.force = std::clamp(rendered.force, -most, most);
            sent.add(rendered.force);
            return rendered;
        }
    };
};
const Registered<AccountMethod> energy_account;

}  // namespace palpate::rivals
