// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

#include "palpate/model/radial_bounds.hpp"

// Definition of radial_bounds, which every model contains.
namespace palpate {

PALPATE_INLINE RadialBounds radial_bounds(const NetworkParameters& network, std::span<const double> lower,
                                          std::span<const double> upper, double relative, std::size_t budget,
                                          const detail::HatKernel& kernel) {
    const std::size_t d = network.dimension;
    const RadialSum hats{network, lower, upper, kernel};
    const detail::RadialRounding rounding{network, lower, upper};
    detail::SampledRange value;
    std::vector<detail::SampledRange> gradient(d);
    const auto add_sample = [&](double at, std::span<const double> slopes) {
        value.add(at);
        for (std::size_t j = 0; j < d; ++j) {
            gradient[j].add(slopes[j]);
        }
    };
    // Positions at which the network is probably large are computed first: a box is finished if its bounds do not
    // exceed the largest computed value by much.
    std::vector<double> slopes(d);
    detail::visit_steep_positions(network, lower, upper, [&](const std::vector<double>& x) {
        slopes = network.linear;
        double at = std::inner_product(x.begin(), x.end(), network.linear.begin(), network.bias);
        hats.add(x.data(), at, slopes.data());
        add_sample(at, slopes);
    });
    const auto is_finished = [&](const RadialBounds& box) {
        bool all = value.is_finished(box.value, relative * value.range.largest() + rounding.value);
        for (std::size_t j = 0; j < d && all; ++j) {
            all = gradient[j].is_finished(box.gradient[j],
                                          relative * gradient[j].range.largest() + rounding.gradient[j]);
        }
        return all;
    };
    detail::RadialEnclosure box{network, hats};
    RadialBounds bounds;
    // The edges of all boxes, 2 d numbers for each box. Wide boxes come first, so that all boxes have similar widths
    // when the largest number of boxes is reached.
    std::vector<double> edges{lower.begin(), lower.end()};
    edges.insert(edges.end(), upper.begin(), upper.end());
    edges.reserve(4096);
    for (std::size_t next = 0; next < edges.size(); next += 2 * d) {
        box.over(&edges[next], &edges[next + d]);
        add_sample(box.value, box.gradient);
        const std::size_t widest = box.widest();
        const double from = edges[next + widest];
        const double to = edges[next + d + widest];
        const double cut = 0.5 * (from + to);
        if (is_finished(box.ranges) || edges.size() >= 2 * d * budget || cut <= from || cut >= to) {
            if (bounds.gradient.empty()) {
                bounds = box.ranges;
            }
            bounds.value = bounds.value.with(box.ranges.value);
            for (std::size_t j = 0; j < d; ++j) {
                bounds.gradient[j] = bounds.gradient[j].with(box.ranges.gradient[j]);
            }
            continue;
        }
        for (const std::size_t side : {d, std::size_t{0}}) {
            for (std::size_t j = 0; j < 2 * d; ++j) {
                edges.push_back(j == side + widest ? cut : edges[next + j]);
            }
        }
    }
    bounds.value = {bounds.value.lower - rounding.value, bounds.value.upper + rounding.value};
    for (std::size_t j = 0; j < d; ++j) {
        bounds.gradient[j] = {bounds.gradient[j].lower - rounding.gradient[j],
                              bounds.gradient[j].upper + rounding.gradient[j]};
    }
    return bounds;
}

}  // namespace palpate
