// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/wavelet.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "palpate/model/hat_sum.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

/// Values of one radial wavelet psi(u) at a block of up to 64 samples, computed from the squares u . u of the scaled
/// distance u = alpha o (x - beta) to the wavelet's centre.
struct Hats {
    static constexpr std::size_t block = 64;

    double inputs = 1.0;  ///< d, the number of input variables of the wavelet
    std::size_t first = 0, size = 0;
    std::array<double, block> square{}, gaussian{};

    [[nodiscard]] RadialMexicanHat at(std::size_t k) const noexcept {
        return {(square[k] - inputs) * gaussian[k], (inputs + 2.0 - square[k]) * gaussian[k]};
    }
};

/// Samples X (n, d) and the dilations alpha and translations beta (N, d) of N wavelets of d inputs. One-dimensional
/// arrays mean d = 1.
struct Frame {
    std::size_t samples, wavelets, dimension;
    /// X, the values of all input variables: those of variable 1 for all samples, then those of variable 2, ...
    std::vector<double> inputs;
    const double *alpha, *beta;

    Frame(const Array& x_array, const Array& alpha_array, const Array& beta_array) {
        const auto columns = [](const Array& array, const char* name) {
            if (array.ndim() != 1 && array.ndim() != 2) {
                throw std::invalid_argument(std::string(name) + " has shape " + shape_of(array) +
                                            ", must be (n, d) or (n,)");
            }
            return static_cast<std::size_t>(array.ndim() == 2 ? array.shape(1) : 1);
        };
        dimension = columns(x_array, "x");
        if (columns(alpha_array, "alpha") != dimension || columns(beta_array, "beta") != dimension ||
            alpha_array.size() != beta_array.size()) {
            throw std::invalid_argument("alpha has shape " + shape_of(alpha_array) + " and beta " +
                                        shape_of(beta_array) + ", both must be (N, " +
                                        std::to_string(dimension) + ") for x of shape " + shape_of(x_array));
        }
        samples = static_cast<std::size_t>(x_array.shape(0));
        wavelets = static_cast<std::size_t>(alpha_array.shape(0));
        inputs.resize(samples * dimension);
        for (std::size_t j = 0; j < dimension; ++j) {
            for (std::size_t k = 0; k < samples; ++k) {
                inputs[j * samples + k] = x_array.data()[k * dimension + j];
            }
        }
        alpha = alpha_array.data();
        beta = beta_array.data();
    }

    /// Returns u_j = alpha_ij (x_kj - beta_ij), the scaled distance of sample k to wavelet i along input j.
    [[nodiscard]] double scaled(std::size_t i, std::size_t k, std::size_t j) const noexcept {
        return alpha[i * dimension + j] * (inputs[j * samples + k] - beta[i * dimension + j]);
    }

    /// Returns the scaled distance u_j, limited to the largest |u| at which a wavelet is not zero, so that the product
    /// of u_j with a wavelet that is zero is never infinity times zero.
    [[nodiscard]] double clamped(std::size_t i, std::size_t k, std::size_t j) const noexcept {
        return std::clamp(scaled(i, k, j), -detail::hat_reach, detail::hat_reach);
    }

    /// Calls visit(hats) with the values of wavelet i for every block of samples. Each step is a loop over a block that
    /// the compiler vectorises. A block so far from the wavelet that all its values are 0 needs no exponentials.
    template <class Visitor>
    void radial(std::size_t i, Visitor visit) const {
        // Values below exp(-80) = 2e-35 become 0: products of still smaller values are denormal numbers, which make
        // linear algebra about ten times slower.
        constexpr double negligible_square = 160.0;
        constexpr double most = detail::hat_reach * detail::hat_reach;
        Hats hats;
        hats.inputs = static_cast<double>(dimension);
        for (; hats.first < samples; hats.first += Hats::block) {
            hats.size = std::min(Hats::block, samples - hats.first);
            std::fill_n(hats.square.begin(), hats.size, 0.0);
            for (std::size_t j = 0; j < dimension; ++j) {
                const double dilation = alpha[i * dimension + j];
                const double centre = beta[i * dimension + j];
                const double* input = inputs.data() + j * samples + hats.first;
                for (std::size_t k = 0; k < hats.size; ++k) {
                    const double u = dilation * (input[k] - centre);
                    hats.square[k] += u * u;
                }
            }
            double nearest = most;
            for (std::size_t k = 0; k < hats.size; ++k) {
                const double square = hats.square[k];
                hats.square[k] = square > most ? most : square;
                nearest = square < nearest ? square : nearest;
            }
            if (nearest < negligible_square) {
                detail::hat_kernel().gaussians(hats.square.data(), hats.size, hats.gaussian.data());
            }
            for (std::size_t k = 0; k < hats.size; ++k) {
                const double gaussian = hats.gaussian[k];
                hats.gaussian[k] = hats.square[k] < negligible_square ? gaussian : 0.0;
            }
            visit(std::as_const(hats));
        }
    }
};

/// A numpy array (n, N) that is stored column by column, the order that linear algebra routines need.
using Columns = py::array_t<double, py::array::f_style>;

[[nodiscard]] Columns columns(std::size_t samples, std::size_t wavelets) {
    return Columns({static_cast<py::ssize_t>(samples), static_cast<py::ssize_t>(wavelets)});
}

/// Returns the array (n, N) of value(hats, i, k) for every wavelet i and every sample, where k is the index of the
/// sample in its block. The last `harmonics` columns are those of wave(u, i) with the scaled distance u.
template <class Value, class Wave>
Columns filled(const Frame& frame, std::size_t harmonics, Value value, Wave wave) {
    if (harmonics > (frame.dimension == 1 ? frame.wavelets : 0)) {
        throw std::invalid_argument("harmonics is " + std::to_string(harmonics) +
                                    ", must be at most the number of wavelets of one input");
    }
    const std::size_t hats_end = frame.wavelets - harmonics;
    auto result = columns(frame.samples, frame.wavelets);
    double* out = result.mutable_data();
    const py::gil_scoped_release unlocked;
    for (std::size_t i = 0; i < hats_end; ++i) {
        frame.radial(i, [&](const Hats& hats) {
            double* column = out + i * frame.samples + hats.first;
            for (std::size_t k = 0; k < hats.size; ++k) {
                column[k] = value(hats, i, k);
            }
        });
    }
    for (std::size_t i = hats_end; i < frame.wavelets; ++i) {
        for (std::size_t k = 0; k < frame.samples; ++k) {
            out[i * frame.samples + k] = wave(frame.scaled(i, k, 0), i);
        }
    }
    return result;
}

Columns wavelet_columns(const Array& x, const Array& alpha, const Array& beta, std::size_t harmonics) {
    return filled(
        Frame(x, alpha, beta), harmonics,
        [](const Hats& hats, std::size_t /*i*/, std::size_t k) { return hats.at(k).value; },
        [](double u, std::size_t /*i*/) { return std::cos(u); });
}

std::tuple<Columns, std::vector<Columns>, std::vector<Columns>> wavelet_jacobian(const Array& x,
                                                                                 const Array& alpha,
                                                                                 const Array& beta) {
    const Frame frame(x, alpha, beta);
    auto value = columns(frame.samples, frame.wavelets);
    std::vector<Columns> by_alpha;
    std::vector<Columns> by_beta;
    std::vector<double*> alpha_out;
    std::vector<double*> beta_out;
    for (std::size_t j = 0; j < frame.dimension; ++j) {
        by_alpha.push_back(columns(frame.samples, frame.wavelets));
        by_beta.push_back(columns(frame.samples, frame.wavelets));
        alpha_out.push_back(by_alpha.back().mutable_data());
        beta_out.push_back(by_beta.back().mutable_data());
    }
    double* value_out = value.mutable_data();
    {
        const py::gil_scoped_release unlocked;
        for (std::size_t i = 0; i < frame.wavelets; ++i) {
            frame.radial(i, [&](const Hats& hats) {
                const std::size_t at = i * frame.samples + hats.first;
                for (std::size_t k = 0; k < hats.size; ++k) {
                    value_out[at + k] = hats.at(k).value;
                }
                for (std::size_t j = 0; j < frame.dimension; ++j) {
                    const double dilation = frame.alpha[i * frame.dimension + j];
                    for (std::size_t k = 0; k < hats.size; ++k) {
                        const double u = frame.clamped(i, hats.first + k, j);
                        const double by_u = hats.at(k).gradient_over_u * u;
                        alpha_out[j][at + k] = by_u * (u / dilation);
                        beta_out[j][at + k] = -dilation * by_u;
                    }
                }
            });
        }
    }
    return {std::move(value), std::move(by_alpha), std::move(by_beta)};
}

using Mask = py::array_t<bool, py::array::c_style | py::array::forcecast>;

Columns wavelet_steps(const Array& x, const Array& alpha, const Array& beta, const Mask& used) {
    const Frame frame(x, alpha, beta);
    if (used.size() != alpha.size()) {
        throw std::invalid_argument("used has " + std::to_string(used.size()) + " values, alpha has " +
                                    std::to_string(alpha.size()) + ": must be equal");
    }
    std::vector<std::size_t> column(frame.dimension * frame.wavelets);
    std::size_t count = 0;
    for (std::size_t j = 0; j < frame.dimension; ++j) {
        for (std::size_t i = 0; i < frame.wavelets; ++i) {
            column[i * frame.dimension + j] = count;
            count += used.data()[i * frame.dimension + j] ? 1 : 0;
        }
    }
    auto result = columns(frame.samples, 2 * count);
    double* out = result.mutable_data();
    double* by_shift = out + count * frame.samples;
    const bool* taken = used.data();
    const py::gil_scoped_release unlocked;
    for (std::size_t i = 0; i < frame.wavelets; ++i) {
        frame.radial(i, [&](const Hats& hats) {
            for (std::size_t j = 0; j < frame.dimension; ++j) {
                if (!taken[i * frame.dimension + j]) {
                    continue;
                }
                const std::size_t at = column[i * frame.dimension + j] * frame.samples + hats.first;
                for (std::size_t k = 0; k < hats.size; ++k) {
                    const double u = frame.clamped(i, hats.first + k, j);
                    const double by_u = hats.at(k).gradient_over_u * u;
                    out[at + k] = by_u * u;
                    by_shift[at + k] = -by_u;
                }
            }
        });
    }
    return result;
}

std::vector<Columns> wavelet_curvature_columns(const Array& x, const Array& alpha, const Array& beta) {
    const Frame frame(x, alpha, beta);
    std::vector<Columns> result;
    std::vector<double*> out;
    for (std::size_t j = 0; j < frame.dimension; ++j) {
        result.push_back(columns(frame.samples, frame.wavelets));
        out.push_back(result.back().mutable_data());
    }
    const py::gil_scoped_release unlocked;
    for (std::size_t i = 0; i < frame.wavelets; ++i) {
        frame.radial(i, [&](const Hats& hats) {
            for (std::size_t j = 0; j < frame.dimension; ++j) {
                const double dilation = frame.alpha[i * frame.dimension + j];
                double* column = out[j] + i * frame.samples + hats.first;
                for (std::size_t k = 0; k < hats.size; ++k) {
                    column[k] =
                        dilation * dilation * hats.at(k).curvature(frame.clamped(i, hats.first + k, j));
                }
            }
        });
    }
    return result;
}

Columns wavelet_slope_columns(const Array& x, const Array& alpha, const Array& beta, std::size_t harmonics) {
    const Frame frame(x, alpha, beta);
    if (frame.dimension != 1) {
        throw std::invalid_argument("x has shape " + shape_of(x) + ", must be (n,), one input");
    }
    return filled(
        frame, harmonics,
        [&](const Hats& hats, std::size_t i, std::size_t k) {
            return frame.alpha[i] * (hats.at(k).gradient_over_u * frame.clamped(i, hats.first + k, 0));
        },
        [&](double u, std::size_t i) { return -frame.alpha[i] * std::sin(u); });
}

}  // namespace

void bind_wavelet(py::module_& module) {
    module.def(
        "wavelet_columns", &wavelet_columns, "x"_a, "alpha"_a, "beta"_a, "harmonics"_a = 0,
        "Returns the values psi(alpha_i o (x_k - beta_i)) of N wavelets (radial Mexican hats) at n samples: "
        "(n, N),\ncolumn by column in memory.\n\n"
        "x is (n, d), alpha and beta are (N, d); (n,) and (N,) mean d = 1. The last `harmonics` columns are\n"
        "cos(alpha_i (x_k - beta_i)), for d = 1.");
    module.def(
        "wavelet_jacobian", &wavelet_jacobian, "x"_a, "alpha"_a, "beta"_a,
        "Returns the values of the wavelets (n, N), and their derivatives by the dilations alpha and by the\n"
        "translations beta, each as a list of d arrays (n, N): (value, by_alpha, by_beta).");
    module.def(
        "wavelet_steps", &wavelet_steps, "x"_a, "alpha"_a, "beta"_a, "used"_a,
        "Returns the derivatives of the wavelets' values by changes without a unit: d log(alpha) of the\n"
        "dilations and alpha d(beta) of the translations. They are those of the M inputs of wavelets which\n"
        "`used` (N, d) marks with True: (n, 2 M), columns ordered by quantity, input, wavelet.");
    module.def(
        "wavelet_curvature_columns", &wavelet_curvature_columns, "x"_a, "alpha"_a, "beta"_a,
        "Returns the second derivatives of the wavelets' values by each input: a list of d arrays (n, N).");
    module.def(
        "wavelet_slope_columns", &wavelet_slope_columns, "x"_a, "alpha"_a, "beta"_a, "harmonics"_a = 0,
        "Returns the derivatives d psi(alpha_i (x_k - beta_i)) / dx of wavelets of one input: (n, N). The\n"
        "last `harmonics` columns are those of cosines.");
}

}  // namespace palpate::bindings
