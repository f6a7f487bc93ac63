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
#include "palpate/rendering/any_structure.hpp"
#include "palpate/rendering/make_structure.hpp"
#include "palpate/run/controller.hpp"
#include "special_values.hpp"
#include "support.hpp"
#include "tick.hpp"
#include "variants.hpp"

namespace palpate {
namespace {

constexpr double period_s = 1e-3;
using test::infinity;
using test::nan;

GuardSettings guard_settings() {
    GuardSettings settings;
    settings.force_limit = 2.0;
    settings.ramp_s = 0.005;
    settings.encoder_step = 1e-4;
    settings.device_damping = 0.01;
    settings.device_friction = 0.01;
    return settings;
}

/// Positions inside, at the borders and far outside of the model, and readings that are not finite.
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
                                    infinity,
                                    -infinity,
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
        const AnyStructure structure = make_structure(variant.model, variant.scheme, period_s, 2.0);
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
                    test::HeldDevice device;
                    device.next.position = start;
                    Controller controller{device, structure, guards};
                    (void)controller.start();
                    for (const double position : {start, first, start, second, 0.05}) {
                        device.next.position = position;
                        const Status status = controller.tick().status;
                        ASSERT_EQ(std::fetestexcept(exceptions), 0)
                            << variant.name << " from " << start << " to " << first << ", " << second << ": "
                            << text(status).word;
                        if (is_final(status)) {
                            break;
                        }
                    }
                }
            }
        }
    }
}

#if defined(__x86_64__) && defined(__linux__)

#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ == 12 && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
constexpr bool counts_are_comparable = true;
#else
constexpr bool counts_are_comparable = false;
#endif

/// Positions of successive ticks.
struct Input {
    const char* name;
    std::vector<double> positions;
};

std::vector<Input> inputs() {
    std::vector<Input> all;
    all.push_back({"inside", {}});
    for (int k = 0; k < 40; ++k) {
        all.back().positions.push_back(0.02 + 0.005 * k + 1e-4 * (k % 7));
    }
    all.push_back({"borders of cells", {}});
    for (int k = 0; k <= 64; ++k) {
        for (const double side : {-1.0, 2.0}) {
            all.back().positions.push_back(std::nextafter(k / 64.0, side));
        }
    }
    all.push_back({"outside", {1.5, 1.55, 1.52, 1.53}});
    all.push_back({"far outside", {1e6, 1e6 + 0.05, 1e6 - 0.02}});
    all.push_back({"force limit", {0.9, 0.95, 0.88, 0.86, 0.94}});
    all.push_back({"reversals", {}});
    for (int k = 0; k < 30; ++k) {
        all.back().positions.push_back(0.2 + (k % 2 == 0 ? 0.04 : -0.04));
    }
    all.push_back({"NaN", {0.1, nan, 0.1, nan}});
    all.push_back({"jump", {0.1, 0.9}});
    return all;
}

/// Most instructions of a tick, in the order of `all_variants`: 1.2 times the numbers counted with g++ 12.2, -O1, glibc
/// 2.36 and the AVX-512 kernels, for all ticks of `inputs`. With -O3 a tick needs fewer.
constexpr std::array<std::uint64_t, 20> most_instructions{
    1670,   // direct, position
    1520,   // direct, hysteresis
    1190,   // direct, predicted
    1690,   // direct, predicted hysteresis
    1480,   // massless, position
    4770,   // massless, hysteresis
    2450,   // massless, compensated
    1850,   // implicit, position
    6380,   // implicit, hysteresis
    1830,   // implicit, compensated
    1080,   // explicit, position
    1690,   // explicit, hysteresis
    2750,   // explicit, compensated
    4430,   // energy-consistent, position
    11730,  // energy-consistent, hysteresis
    15160,  // energy-consistent, compensated
    940,    // tangent
    1350,   // tangent, hysteresis
    1390,   // direct, velocity
    1620,   // direct, memory
};

// A tick must end in time for every reading, so its number of instructions is bounded.
TEST(Tick, ExecutesABoundedNumberOfInstructions) {
    if (!counts_are_comparable) {
        GTEST_SKIP() << "the numbers are known for g++ 12 without sanitizers";
    }
    if (__builtin_cpu_supports("avx2") == 0) {
        GTEST_SKIP() << "the numbers are known for processors with AVX2";
    }
    const bool all_ticks = test::cases(1) > 1;  // some machines need 20 us for an instruction
    const std::vector<test::Variant> variants = test::all_variants();
    ASSERT_EQ(variants.size(), most_instructions.size());
    for (std::size_t k = 0; k < variants.size(); ++k) {
        const test::Variant& variant = variants[k];
        const AnyStructure structure = make_structure(variant.model, variant.scheme, period_s, 2.0);
        const Guards guards = guards_of(guard_settings(), variant.model, variant.scheme, period_s);
        for (const Input& input : inputs()) {
            test::HeldDevice device;
            device.next.position = input.positions.front();
            Controller controller{device, structure, guards};
            (void)controller.start();
            // A tick uses the reading of the exchange before it
            std::vector<double> played = input.positions;
            played.push_back(played.back());
            for (const double& position : played) {
                device.next.position = position;
                if (all_ticks || &position == &played.back()) {
                    const std::uint64_t counted = test::instructions([&] { (void)controller.tick(); });
                    EXPECT_GT(counted, 100U);
                    EXPECT_LE(counted, most_instructions.at(k)) << variant.name << ": " << input.name;
                } else {
                    (void)controller.tick();
                }
            }
        }
    }
}

#endif

}  // namespace
}  // namespace palpate
