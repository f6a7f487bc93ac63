// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/rendering/explicit.hpp"
#include "palpate/stability/explicit_inequalities.hpp"
#include "slopes.hpp"
#include "support.hpp"

namespace palpate {
namespace {

using test::slopes;

constexpr double T = 1e-3;

/// Returns the frequency response of the rendered force to the handle's position, measured: the structure renders a
/// spring while the handle moves like cos(theta k), until the start has died out.
std::complex<double> measured_response(double theta, double slope, Inertia inertia,
                                       VirtualCoupling coupling) {
    Explicit structure{test::Spring{slope}, inertia, coupling, T};
    structure.reset(1.0);
    constexpr int settle = 4000;
    constexpr int measured = 4000;
    std::complex<double> sum;
    for (int k = 0; k < settle + measured; ++k) {
        const double force = structure.step(std::cos(theta * k)).force;
        if (k >= settle) {
            // A window that is zero at both ends, so that the count of periods need not be whole
            const double part = (k - settle + 0.5) / measured;
            const double window = std::pow(std::sin(std::numbers::pi * part), 4) / 0.375;
            sum += 2.0 / measured * window * force * std::polar(1.0, -theta * k);
        }
    }
    return sum;
}

// Colgate and Schenkel: a held force with the response H z^-n needs the damping
// T / (2 (1 - cos theta)) Re{(1 - e^{-j theta}) z^-n H}.
TEST(ExplicitNeed, IsThatOfTheMeasuredFrequencyResponse) {
    for (const auto& [slope, inertia, coupling] :
         {std::tuple{50.0, Inertia{1e-3, 0.3}, VirtualCoupling{100.0, 0.02}},
          std::tuple{-30.0, Inertia{2e-4, 0.1}, VirtualCoupling{80.0, 0.0}}}) {
        for (const double theta : {0.2, 0.9, 2.5}) {
            const std::complex<double> H = measured_response(theta, slope, inertia, coupling);
            for (const int delay : {0, 1, 3}) {
                const double expected =
                    T / (2.0 * (1.0 - std::cos(theta))) *
                    ((1.0 - std::polar(1.0, -theta)) * std::polar(1.0, -theta * delay) * H).real();
                EXPECT_NEAR(explicit_need_at(theta, slope, inertia, coupling, T, delay), expected,
                            1e-6 * std::abs(H) * T / (1.0 - std::cos(theta)))
                    << theta << " " << delay;
            }
        }
    }
}

TEST(ExplicitNeed, IsTheLargestOverFrequenciesAndSlopes) {
    for (const auto& [slopes, inertia, coupling, delay] :
         {std::tuple{Interval{2.0, 2800.0}, Inertia{1e-3, 0.5}, VirtualCoupling{100.0, 0.02}, 0},
          std::tuple{Interval{-50.0, 20.0}, Inertia{1e-3, 0.05}, VirtualCoupling{100.0, 0.0}, 0},
          std::tuple{Interval{0.0, 0.0}, Inertia{5e-4, 0.02}, VirtualCoupling{200.0, 0.01}, 2},
          std::tuple{Interval{10.0, 200.0}, Inertia{2e-4, 0.1}, VirtualCoupling{50.0, 0.1}, 1},
          std::tuple{Interval{100.0, 130.0}, Inertia{1e-3, 0.01}, VirtualCoupling{10.0, 0.001}, 0}}) {
        double most = -std::numeric_limits<double>::infinity();
        for (int i = 0; i <= 60; ++i) {
            for (int k = 1; k <= 4000; ++k) {
                most = std::max(most, explicit_need_at(std::numbers::pi * k / 4000,
                                                       slopes.lower + (slopes.upper - slopes.lower) * i / 60,
                                                       inertia, coupling, T, delay));
            }
        }
        const double need = explicit_need(slopes, inertia, coupling, T, delay);
        EXPECT_GE(need, most * (1.0 - 1e-5)) << slopes.upper;
        EXPECT_LE(need, most * (1.0 + 1e-2)) << slopes.upper;
    }
}

/// Returns the largest need over frequencies and slopes: the largest of many samples, then of smaller and smaller steps
/// around it.
double largest_need(Interval slopes, Inertia inertia, VirtualCoupling coupling, int delay) {
    double most = -std::numeric_limits<double>::infinity();
    double at = 0.0;
    double slope = 0.0;
    const auto consider = [&](double theta, double K) {
        K = std::clamp(K, slopes.lower, slopes.upper);
        if (const double value = explicit_need_at(theta, K, inertia, coupling, T, delay); value > most) {
            most = value;
            at = theta;
            slope = K;
        }
    };
    const double across = slopes.upper - slopes.lower;
    for (int i = 0; i <= 100; ++i) {
        for (int k = 1; k <= 1500; ++k) {
            consider(std::numbers::pi * k / 1500, slopes.lower + across * i / 100);
        }
    }
    for (double step = 1.0; step > 1e-9; step *= 0.7) {
        for (int repeat = 0; repeat < 4; ++repeat) {
            const double theta = at;
            const double K = slope;
            for (int i = -1; i <= 1; ++i) {
                for (int k = -1; k <= 1; ++k) {
                    consider(theta + k * step * std::numbers::pi / 1500, K + i * step * across / 100);
                }
            }
        }
    }
    return most;
}

TEST(ExplicitNeed, FindsTheLargestNeedBetweenBothSlopes) {
    for (const auto& [slopes, inertia, coupling, delay] :
         {std::tuple{Interval{-16.84, 595.6}, Inertia{3.87e-4, 0.1062}, VirtualCoupling{134.1, 0.0458}, 1},
          std::tuple{Interval{-44.5, 851.6}, Inertia{1.295e-3, 0.0879}, VirtualCoupling{59.8, 0.0445}, 2},
          std::tuple{Interval{-19.7, 512.9}, Inertia{4.29e-4, 0.0311}, VirtualCoupling{33.7, 0.045}, 3},
          std::tuple{Interval{-9.6, 374.3}, Inertia{3.579e-4, 0.022}, VirtualCoupling{26.37, 0.0656}, 2},
          std::tuple{Interval{-22.4, 861.1}, Inertia{3.946e-4, 0.13}, VirtualCoupling{115.1, 0.0732}, 1},
          std::tuple{Interval{-45.8, 453.8}, Inertia{5.222e-4, 0.0549}, VirtualCoupling{37.68, 0.04}, 3},
          std::tuple{Interval{-20.1, 858.6}, Inertia{4.639e-4, 0.2}, VirtualCoupling{148.4, 0.0823}, 1}}) {
        const double need = explicit_need(slopes, inertia, coupling, T, delay);
        const double expected = largest_need(slopes, inertia, coupling, delay);
        EXPECT_GE(need, expected * (1.0 - 1e-9)) << slopes.upper;
        EXPECT_LE(need, expected * (1.0 + 1e-5)) << slopes.upper;
        for (const double end : {slopes.lower, slopes.upper}) {
            EXPECT_GT(need, 1.001 * explicit_need({end, end}, inertia, coupling, T, delay))
                << "inside the range";
        }
    }
}

// A lightly damped object has narrow maxima over the frequency, whose largest sample need not be the largest maximum.
TEST(ExplicitNeed, IsAtLeastThatOfEachEndOfTheRange) {
    const VirtualCoupling coupling{100.0, 0.02};
    int lower_decides = 0;
    for (const double lower : {-60.0, 0.0, 40.0, 300.0}) {
        for (const double damping : {0.03, 0.3}) {
            for (const int delay : {0, 1, 3}) {
                const Inertia inertia{1e-3, damping};
                const double need = explicit_need({lower, lower + 50.0}, inertia, coupling, T, delay);
                const double at_lower = explicit_need({lower, lower}, inertia, coupling, T, delay);
                const double at_upper =
                    explicit_need({lower + 50.0, lower + 50.0}, inertia, coupling, T, delay);
                EXPECT_GE(need, at_lower * (1.0 - 1e-10)) << lower << " " << damping << " " << delay;
                EXPECT_GE(need, at_upper * (1.0 - 1e-10)) << lower << " " << damping << " " << delay;
                lower_decides += at_lower > at_upper ? 1 : 0;
            }
        }
    }
    EXPECT_GE(lower_decides, 3);
}

// The largest need between two of the tried samples is found by the refinement, nearly to rounding.
TEST(ExplicitNeed, RefinesTheLargestSample) {
    const Inertia inertia{1e-3, 0.004};
    const VirtualCoupling coupling{100.0, 0.001};
    const double need = explicit_need({90.0, 90.0}, inertia, coupling, T, 0);
    double most = -1e300;
    double at = 0.0;
    for (int k = 1; k <= 20'000; ++k) {
        const double theta = std::numbers::pi * k / 20'000;
        const double value = explicit_need_at(theta, 90.0, inertia, coupling, T, 0);
        at = value > most ? theta : at;
        most = std::max(most, value);
    }
    for (double step = std::numbers::pi / 20'000; step > 1e-9; step *= 0.5) {
        for (const double side : {-1.0, 1.0}) {
            const double value = explicit_need_at(at + side * step, 90.0, inertia, coupling, T, 0);
            at = value > most ? at + side * step : at;
            most = std::max(most, value);
        }
    }
    EXPECT_NEAR(need, most, 1e-9 * most);
}

// The maximum of this object moves with the slope. At the tried slopes it is found nearly to rounding, between two of
// them within a share of 1e-3.
TEST(ExplicitNeed, FindsANarrowMaximumThatMovesWithTheSlope) {
    const Inertia inertia{6.91725e-4, 0.00779283};
    const VirtualCoupling coupling{158.675, 0.00793102};
    const double need = explicit_need({-15.2061, 851.194}, inertia, coupling, T, 1);
    EXPECT_GE(need, (1.0 - 1e-3) * largest_need({-15.2061, 851.194}, inertia, coupling, 1));
}

std::vector<Inequality> lines_of(const ForceBounds& bounds, Inertia inertia, VirtualCoupling coupling,
                                 const DeviceProfile& device) {
    Scheme scheme;
    scheme.structure = StructureKind::Explicit;
    scheme.inertia = inertia;
    scheme.coupling = coupling;
    return inequalities(ExplicitStructure{}, bounds, scheme, device);
}

TEST(ExplicitInequalities, HaveTheSidesOfTheirFormulas) {
    DeviceProfile device;
    device.viscous_damping = 0.3;
    device.delay_s = 1.5 * T;
    device.jitter_s = 0.25 * T;
    const Inertia inertia{1e-3, 0.25};
    const VirtualCoupling coupling{100.0, 0.02};
    const std::vector<Inequality> lines = lines_of(slopes(-20.0, 60.0), inertia, coupling, device);
    ASSERT_EQ(lines.size(), 5U);
    const std::array<const char*, 5> ids{"explicit-slope", "explicit-damping", "explicit-damping-positive",
                                         "explicit-falling-slope", "explicit-port-damping"};
    const std::array<double, 5> left{(4e-3 - 2.0 * 0.27 * T) / (T * T), 2e-3, 0.27, 100.0, 0.3};
    const std::array<double, 5> right{160.0, 0.27 * T, 0.0, 20.0,
                                      1.25 * explicit_need({-20.0, 60.0}, inertia, coupling, T, 2)};
    for (std::size_t k = 0; k < 5; ++k) {
        EXPECT_EQ(lines[k].id, ids[k]);
        EXPECT_DOUBLE_EQ(lines[k].left, left[k]) << ids[k];
        EXPECT_DOUBLE_EQ(lines[k].right, right[k]) << ids[k];
        EXPECT_EQ(lines[k].basis, Basis::Linear);
        EXPECT_EQ(lines[k].strict, k < 4) << ids[k];
    }
    EXPECT_DOUBLE_EQ(lines_of(slopes(5.0, 60.0), inertia, coupling, device)[3].right, 0.0);
}

/// Returns the largest position of a free object at a device that does not move, after many steps from 1.
double size_after(int steps, double slope, Inertia inertia, VirtualCoupling coupling) {
    // v_k = v_{k-1} + (T/m)(F_{k-1} - f_{k-1} - B_o v_{k-1}), y_k = y_{k-1} + T v_k, F = -K_c y - B_c v
    double y = 1.0;
    double v = 0.0;
    double largest = 0.0;
    for (int k = 0; k < steps; ++k) {
        const double force = -coupling.stiffness * y - coupling.damping * v - slope * y - inertia.damping * v;
        v += T / inertia.mass * force;
        y += T * v;
        largest = k > steps - 10 ? std::max(largest, std::abs(y)) : 0.0;
        if (!(std::abs(y) < 1e100)) {
            return 1e100;
        }
    }
    return largest;
}

// The first four lines state the region in which the object at a held device is stable: the free object decays just
// inside each line and grows just outside.
TEST(ExplicitInequalities, ChangeTheirVerdictWhereTheObjectBecomesUnstable) {
    const Inertia inertia{1e-3, 0.25};
    const VirtualCoupling coupling{100.0, 0.02};
    const DeviceProfile device;
    const auto stable = [&](double slope, Inertia object, VirtualCoupling spring) {
        const std::vector<Inequality> lines = lines_of(slopes(slope, slope), object, spring, device);
        return lines[0].holds() && lines[1].holds() && lines[2].holds() && lines[3].holds();
    };
    const double steepest = (4e-3 - 2.0 * 0.27 * T) / (T * T) - 100.0;
    for (const auto& [slope, expected] : {std::pair{0.999 * steepest, true},
                                          {1.001 * steepest, false},
                                          std::pair{-99.0, true},
                                          {-101.0, false}}) {
        EXPECT_EQ(stable(slope, inertia, coupling), expected) << slope;
        EXPECT_EQ(size_after(20'000, slope, inertia, coupling) < 1.0, expected) << slope;
    }
    for (const auto& [damping, expected] : {std::pair{1.9, true}, {2.1, false}}) {
        const Inertia damped{1e-3, damping};
        EXPECT_EQ(stable(-80.0, damped, {100.0, 0.0}), expected) << damping;
        EXPECT_EQ(size_after(20'000, -80.0, damped, {100.0, 0.0}) < 1.0, expected) << damping;
    }
    EXPECT_FALSE(stable(10.0, {1e-3, 0.0}, {100.0, 0.0})) << "no damping at all";
    EXPECT_TRUE(stable(10.0, {1e-3, 1e-9}, {100.0, 0.0}));
    EXPECT_FALSE(stable(-100.0, inertia, coupling)) << "K_c = s_";
}

}  // namespace
}  // namespace palpate
