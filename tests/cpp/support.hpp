// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "palpate/model/bounds.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/hysteresis.hpp"
#include "palpate/model/memory.hpp"
#include "palpate/model/network.hpp"
#include "palpate/solver/piecewise_force.hpp"

namespace palpate::test {

/// Returns the number of random test cases: `quick` in the normal test run, PALPATE_TEST_SCALE times `quick` in the
/// full test run.
inline int cases(int quick) {
    const char* scale = std::getenv("PALPATE_TEST_SCALE");
    return quick * std::max(1, scale == nullptr ? 1 : std::atoi(scale));
}

/// Returns the number of random test cases: `quick` in the normal test run, PALPATE_TEST_SCALE times `each` in the full
/// test run.
inline int cases(int quick, int each) {
    return cases(1) > 1 ? cases(each) : quick;
}

/// Returns true if the normal test run includes the combination of this number: one of `every`. The full test run
/// includes all. If `every` has no common divisor with the number of values of a parameter, each value is included.
inline bool is_sampled(int number, int every) {
    return cases(1) > 1 || number % every == 0;
}

using Random = std::mt19937_64;

/// Returns a uniform random number.
inline double uniform(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>{low, high}(random);
}

/// Returns a network of `size` wavelets over [0, 1]^d.
inline NetworkParameters random_network(Random& random, std::size_t size, std::size_t dimension = 1) {
    NetworkParameters network;
    network.dimension = dimension;
    network.linear.clear();
    for (std::size_t k = 0; k < size * dimension; ++k) {
        network.alpha.push_back(std::exp(uniform(random, 0.0, 4.0)));
        network.beta.push_back(uniform(random, -0.1, 1.1));
    }
    for (std::size_t k = 0; k < size; ++k) {
        network.weight.push_back(uniform(random, -1.0, 1.0));
    }
    for (std::size_t k = 0; k < dimension; ++k) {
        network.linear.push_back(uniform(random, -2.0, 4.0));
    }
    network.bias = uniform(random, -0.5, 0.5);
    return network;
}

/// Returns the network with `count` more wavelets that are harmonics of the period 1.
inline NetworkParameters with_harmonics(Random& random, NetworkParameters network, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
        network.alpha.push_back(2.0 * std::numbers::pi * static_cast<double>(1 + random() % 90));
        network.beta.push_back(uniform(random, -0.1, 1.1));
        network.weight.push_back(uniform(random, -1.0, 1.0));
    }
    network.harmonics += count;
    return network;
}

/// Returns a memory of one to four branches over [0, 1], some of which slip. The ratio may have any sign; in half of the
/// cases it is 1.
inline MemoryParameters random_memory(Random& random) {
    MemoryParameters memory;
    if (random() % 2 == 0) {
        memory.ratio = random_network(random, random() % 3);
        memory.ratio.bias += 1.0;
    }
    const std::size_t branches = 1 + random() % 4;
    for (std::size_t j = 0; j < branches; ++j) {
        memory.stiffness.push_back(std::exp(uniform(random, -2.0, 3.0)));
        memory.time_constant_s.push_back(std::exp(uniform(random, -7.0, 3.0)));
    }
    if (random() % 2 == 0) {
        for (std::size_t j = 0; j < branches; ++j) {
            memory.yield_stretch.push_back(std::exp(uniform(random, -6.0, 0.0)));
            if (random() % 2 == 0) {
                (random() % 2 == 0 ? memory.time_constant_s : memory.yield_stretch)[j] =
                    std::numeric_limits<double>::infinity();
            }
        }
    }
    return memory;
}

inline Domain unit_domain(Continuation below = Continuation::Linear,
                          Continuation above = Continuation::Linear) {
    return {{0.0}, {1.0}, below, above, std::nullopt};
}

/// Returns the steepest falling slope of the force f, including its straight continuations, within 1e-9 of max|f'|;
/// negative if f rises at every position.
inline double steepest_fall(const PiecewiseForce& force) {
    double least = slope_bounds(force.network, force.lower, force.upper, 1e-9).lower;
    for (const auto* side : {&force.below, &force.above}) {
        for (const OuterLine& line : *side) {
            least = std::min(least, line.slope);
        }
    }
    return -least;
}

/// A spring, f = stiffness * x, for which every stability limit has a formula.
struct Spring {
    using State = Stateless;
    double stiffness;

    [[nodiscard]] EnvironmentSample at(double x, State /*stateless*/) const noexcept {
        return {stiffness * x, stiffness, 0.5 * stiffness * x * x, false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

/// The comparison scene: a spring, a click and a wall, f(x) = 2x + 0.6
/// exp(-((x - 0.15)/0.03)^2) + 60 * 0.004 softplus((x - 0.4)/0.004) N*m over rad.
struct ClickAndWall {
    using State = Stateless;

    [[nodiscard]] EnvironmentSample at(double x, State /*stateless*/) const noexcept {
        const double u = (x - 0.15) / 0.03;
        const double click = 0.6 * std::exp(-u * u);
        const double z = (x - 0.4) / 0.004;
        const double softplus = std::max(z, 0.0) + std::log1p(std::exp(-std::abs(z)));
        const double wall_slope = 60.0 / (1.0 + std::exp(-z));
        return {2.0 * x + click + 60.0 * 0.004 * softplus, 2.0 - 2.0 * u / 0.03 * click + wall_slope, 0.0,
                false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

/// Object without force up to the position 0.5, whose force is not a number beyond.
struct BrokenBeyond {
    using State = Stateless;

    [[nodiscard]] EnvironmentSample at(double x, State /*stateless*/) const noexcept {
        return {x > 0.5 ? std::numeric_limits<double>::quiet_NaN() : 0.0, 0.0, 0.0, false};
    }
    void advance(double /*x*/, State& /*stateless*/) const noexcept {}
    [[nodiscard]] State start(double /*x*/) const noexcept { return {}; }
};

/// Environment that counts the evaluations of another environment.
template <class E>
struct Counted {
    using State = typename E::State;
    E environment;
    int* count;

    [[nodiscard]] EnvironmentSample at(double x, const State& state) const noexcept {
        ++*count;
        return environment.at(x, state);
    }
    void advance(double x, State& state) const noexcept { environment.advance(x, state); }
    [[nodiscard]] State start(double x) const noexcept { return environment.start(x); }
};

/// Returns the message with which a call refuses its arguments; empty if it accepts them.
template <class Call>
std::string refusal(const Call& call) {
    try {
        call();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

}  // namespace palpate::test
