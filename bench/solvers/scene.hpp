// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "palpate/model/network.hpp"
#include "palpate/model/radial_network.hpp"

namespace palpate::bench {

/// Returns a spring with a wall: a soft line, a kink and a steep line, with `size` wavelets around the kink at 0.4 rad.
/// Its slope is between about 2 and 60 N*m/rad.
inline WaveletNetwork spring_and_wall(std::size_t size) {
    NetworkParameters network;
    network.linear = {20.0};
    network.bias = -1.0;
    for (std::size_t k = 0; k < size; ++k) {
        const double fraction = (static_cast<double>(k) + 0.5) / static_cast<double>(size);
        network.alpha.push_back(6.0 + 30.0 * fraction);
        network.beta.push_back(0.1 + 0.4 * fraction);
        network.weight.push_back(0.6 / static_cast<double>(size) *
                                 std::cos(3.0 * std::numbers::pi * fraction));
    }
    return {network, {{0.0}, {0.6}, Continuation::Linear, Continuation::Linear, std::nullopt}};
}

/// Returns two clicks and a wall. The force falls with slopes to -23 N*m/rad, so a soft coupling snaps through. Eight
/// of the `size` wavelets contribute to the force.
inline WaveletNetwork two_clicks(std::size_t size) {
    NetworkParameters network{1,
                              {30.0, 25.0, 15.0, 8.0, 40.0, 60.0, 45.0, 38.0},
                              {0.15, 0.45, 0.5, 0.62, 0.3, 0.41, 0.27, 0.36},
                              {-0.45, 0.3, -0.8, 1.5, 0.02, 0.02, -0.5, -0.3},
                              {12.0},
                              0.0};
    for (std::size_t k = network.weight.size(); k < size; ++k) {
        const double fraction = static_cast<double>(k) / static_cast<double>(size);
        network.alpha.push_back(10.0 + 30.0 * fraction);
        network.beta.push_back(0.6 * fraction);
        network.weight.push_back(0.01 / static_cast<double>(size));
    }
    return {network, {{0.0}, {0.6}, Continuation::Linear, Continuation::Linear, std::nullopt}};
}

/// Returns a network of several inputs, each from 0 to 1, whose force rises and falls repeatedly.
inline RadialNetwork several_inputs(std::size_t size, std::size_t inputs) {
    NetworkParameters network;
    network.dimension = inputs;
    network.linear.assign(inputs, 1.0);
    for (std::size_t k = 0; k < size; ++k) {
        for (std::size_t j = 0; j < inputs; ++j) {
            const double turn = std::numbers::phi * static_cast<double>(k * (j + 1));
            network.alpha.push_back(3.0 + static_cast<double>(k % 5));
            network.beta.push_back(turn - std::floor(turn));
        }
        network.weight.push_back(k % 2 == 0 ? 0.3 : -0.2);
    }
    return {network,
            {std::vector<double>(inputs, 0.0), std::vector<double>(inputs, 1.0), Continuation::Linear,
             Continuation::Linear, std::nullopt}};
}

/// Returns the positions of a hand that presses and releases twice a second, sampled at 1 kHz.
inline std::vector<double> hand_motion(std::size_t ticks) {
    std::vector<double> position(ticks);
    for (std::size_t k = 0; k < ticks; ++k) {
        const double time = 1e-3 * static_cast<double>(k);
        position[k] = 0.25 - 0.22 * std::cos(2.0 * std::numbers::pi * 0.5 * time) +
                      0.01 * std::sin(2.0 * std::numbers::pi * 7.0 * time);
    }
    return position;
}

}  // namespace palpate::bench
