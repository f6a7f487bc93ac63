// SPDX-License-Identifier: Apache-2.0
// A second implementation, from the proofs, of the device damping that a held force needs. The tests compare the
// certificates of the library with this implementation.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

namespace palpate::energy_search {

/// Returns the needed damping divided by the period T, for a force with slopes in [-s, M]. The force is computed at
/// x_k - q_k, the position x_k with an error q_k of at most lambda times the displacement d.
[[nodiscard]] inline double held_need(double M, double s, double lambda) {
    if (lambda * s <= (1.0 + lambda) * M) {
        return M * (0.5 + lambda);
    }
    if ((lambda - 1.0) * s >= lambda * M) {
        return s * (lambda - 0.5);
    }
    return 0.5 * (M + M * M / (s - M) + lambda * lambda * (s - M));
}

/// Returns the least number a with h(rho) - l rho - g rho^2 <= a for all rho. h(rho) is the cost of one step as a
/// function of rho.
[[nodiscard]] inline double step_cost(double M, double s, double l, double g) {
    // Returns the largest value of the quadratic c0 + c1 rho + c2 rho^2 for low <= rho <= high; `low` and `high` may be
    // infinite.
    const auto most = [](double c0, double c1, double c2, double low, double high) {
        const auto at = [&](double rho) { return c0 + (c1 + c2 * rho) * rho; };
        double best = -1e300;
        for (const double end : {low, high}) {
            if (std::isfinite(end)) {
                best = std::max(best, at(end));
            } else if (c2 > 0.0 || (c2 == 0.0 && c1 * end > 0.0)) {
                return 1e300;
            }
        }
        if (c2 < 0.0) {
            best = std::max(best, at(std::clamp(-0.5 * c1 / c2, low, high)));
        }
        return best;
    };
    constexpr double infinite = HUGE_VAL;
    return std::max({most(0.5 * M, M - l, -g, 0.0, infinite),
                     most(0.5 * M, M - l, 0.5 * (M + s) - g, -1.0, 0.0),
                     most(-0.5 * s, -s - l, -g, -infinite, -1.0)});
}

/// Returns the bound (W) of the proof: least over l and g of step_cost + max over theta of l Re Q + g |Q|^2. Q is the
/// filter of the steps at frequency theta; `taps[j]` multiplies z^-(j+1).
[[nodiscard]] inline double filtered_need(double M, double s, const std::vector<double>& taps) {
    if (std::max(M, s) <= 0.0) {
        return 0.0;
    }
    constexpr int angles = 400;
    std::vector<double> real;
    std::vector<double> square;
    for (int k = 0; k <= angles; ++k) {
        std::complex<double> q = 0.0;
        for (std::size_t j = 0; j < taps.size(); ++j) {
            q += taps[j] * std::polar(1.0, -std::numbers::pi * k / angles * static_cast<double>(j + 1));
        }
        real.push_back(q.real());
        square.push_back(std::norm(q));
    }
    const auto need = [&](double l, double g) {
        double most = 0.0;
        for (std::size_t k = 0; k < real.size(); ++k) {
            most = std::max(most, l * real[k] + g * square[k]);
        }
        return step_cost(M, s, l, g) + most;
    };
    const double unit = std::max(M, s);
    double best = 1e300;
    double l = 0.0;
    double g = 0.0;
    for (int i = 0; i <= 40; ++i) {
        for (int j = -20; j <= 20; ++j) {
            const double trial_g = unit * std::exp(-7.0 + 9.0 * i / 40);
            const double trial_l = unit * 1.5 * j / 20;
            const double found = need(trial_l, trial_g);
            if (found < best) {
                best = found;
                l = trial_l;
                g = trial_g;
            }
        }
    }
    double step_l = 0.075 * unit;
    double step_g = 0.2;
    while (step_l > 1e-5 * unit) {
        bool better = false;
        for (const int a : {-1, 0, 1}) {
            for (const int c : {-1, 0, 1}) {
                const double trial_l = l + a * step_l;
                const double trial_g = g * std::exp(c * step_g);
                const double found = need(trial_l, trial_g);
                if (found < best) {
                    best = found;
                    l = trial_l;
                    g = trial_g;
                    better = true;
                }
            }
        }
        if (!better) {
            step_l *= 0.5;
            step_g *= 0.5;
        }
    }
    return best * (1.0 + 1e-4);  // margin for the angles between those at which the damping was computed
}

/// Returns the required damping for slopes from -s to M at a delay of n + late samples, with n whole samples and a
/// fraction `late`.
[[nodiscard]] inline double late_need(double M, double s, int n, double late) {
    if (std::max(M, s) <= 0.0) {
        return 0.0;
    }
    const double unit = std::max(M, s);
    const auto need = [&](double g, double w) {
        const double a = step_cost(M, s, 0.0, g);
        const double x = a + g * n * (n + w);
        const double y = g * (n + w) / w;
        const double z = x + late * y;
        return 0.5 * (z + std::sqrt(std::max(0.0, z * z - 4.0 * late * (1.0 - late) * x * y)));
    };
    double best = held_need(M, s, n + std::sqrt(late));
    double log_g = 0.0;
    double log_w = 0.0;
    double least = 1e300;
    for (int i = 0; i <= 40; ++i) {
        for (int j = 0; j <= 40; ++j) {
            const double trial_g = -6.0 + 9.0 * i / 40;
            const double trial_w = -6.0 + 9.0 * j / 40;
            const double found = need(unit * std::exp(trial_g), std::exp(trial_w));
            if (found < least) {
                least = found;
                log_g = trial_g;
                log_w = trial_w;
            }
        }
    }
    double step = 0.2;
    while (step > 1e-6) {
        bool better = false;
        for (const int a : {-1, 0, 1}) {
            for (const int c : {-1, 0, 1}) {
                const double found = need(unit * std::exp(log_g + a * step), std::exp(log_w + c * step));
                if (found < least) {
                    least = found;
                    log_g += a * step;
                    log_w += c * step;
                    better = true;
                }
            }
        }
        if (!better) {
            step *= 0.5;
        }
    }
    return std::min(best, least);
}

/// Returns the position error q as a filter of the displacements, for n whole samples of delay and a prediction from m
/// samples (0: no prediction).
[[nodiscard]] inline std::vector<double> taps_of(int n, int m) {
    std::vector<double> taps(static_cast<std::size_t>(n + m), 0.0);
    for (int j = 1; j <= n; ++j) {
        taps[static_cast<std::size_t>(j - 1)] += 1.0;
    }
    for (int j = 1; j <= m; ++j) {
        taps[static_cast<std::size_t>(n + j - 1)] -= static_cast<double>(m - j + 1) / (m * (m + 1));
    }
    return taps;
}

}  // namespace palpate::energy_search
