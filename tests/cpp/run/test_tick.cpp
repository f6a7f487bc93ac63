// SPDX-License-Identifier: Apache-2.0
// Tests one tick of the controller on adversarial readings, for every structure: floating-point exceptions, and the
// number of machine instructions.
#include <algorithm>
#include <array>
#include <cfenv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/guard/guards.hpp"
#include "palpate/run/controller.hpp"
#include "support.hpp"
#include "variants.hpp"

namespace palpate {
namespace {

constexpr double period_s = 1e-3;
constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A device that reports one reading again and again, with the next sample number.
class HeldDevice {
  public:
    Opened open() { return {}; }
    [[nodiscard]] Reading exchange(const Command& command) noexcept {
        sent = command.force;
        Reading reported = next;
        reported.sequence = ++sequence;
        return reported;
    }
    void close() noexcept {}

    Reading next;
    double sent = 0.0;
    std::uint64_t sequence = 0;
};

GuardSettings guard_settings() {
    GuardSettings settings;
    settings.force_limit = 2.0;
    settings.ramp_s = 0.005;
    settings.encoder_step = 1e-4;
    settings.device_damping = 0.01;
    settings.device_friction = 0.01;
    return settings;
}

/// Positions inside, at the borders and far outside of the model, and readings that are no positions.
const std::vector<double> positions{0.05,
                                    0.1,
                                    0.5,
                                    1.0,
                                    1.05,
                                    0.0,
                                    -0.0,
                                    -0.05,
                                    std::numeric_limits<double>::denorm_min(),
                                    -1e-300,
                                    nan,
                                    inf,
                                    -inf,
                                    10.0,
                                    -1e3,
                                    1e9,
                                    1e100,
                                    -1e200,
                                    std::numeric_limits<double>::max(),
                                    std::numeric_limits<double>::lowest()};

// Readings are checked before they are used: an invalid reading causes no invalid operation, overflow or division by zero.
TEST(Tick, RaisesNoFloatingPointException) {
    constexpr int exceptions = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;
    for (const test::Variant& variant : test::all_variants()) {
        with_structure(variant.model, variant.scheme, period_s, 2.0, [&](const auto& structure) {
            const Guards guards = guards_of(guard_settings(), variant.model, variant.scheme, period_s);
            for (const double start : positions) {
                for (const double first : positions) {
                    for (const double second : positions) {
                        // The first valid position is known only to be finite; encoders report at most this one
                        constexpr double farthest_start = 1e9;
                        const auto is_valid = [](double position) { return std::isfinite(position); };
                        const std::array order{start, first, second};
                        const auto* const found = std::find_if(order.begin(), order.end(), is_valid);
                        if (found != order.end() && std::abs(*found) > farthest_start) {
                            continue;
                        }
                        std::feclearexcept(FE_ALL_EXCEPT);
                        HeldDevice device;
                        device.next.position = start;
                        Controller controller{device, structure, guards};
                        (void)controller.start();
                        for (const double position : {start, first, start, second, 0.05}) {
                            device.next.position = position;
                            const Status status = controller.tick().status;
                            ASSERT_EQ(std::fetestexcept(exceptions), 0)
                                << variant.name << " from " << start << " to " << first << ", " << second
                                << ": " << text(status).word;
                            if (is_final(status)) {
                                break;
                            }
                        }
                    }
                }
            }
        });
    }
}

}  // namespace
}  // namespace palpate
