// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/wavelet.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <tuple>
#include <vector>

#include <pybind11/stl.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "palpate/model/hat_sum.hpp"

namespace palpate::bindings {

namespace py = pybind11;
using namespace py::literals;

namespace {

/// Samples and wavelets of one call: X (n, d), alpha and beta (N, d). One-dimensional arrays mean d = 1.
struct Frame {
    std::size_t samples, wavelets, dimension;
    const double *x, *alpha, *beta;

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
        x = x_array.data();
        alpha = alpha_array.data();
        beta = beta_array.data();
    }

    /// u_j of wavelet i at sample k.
    [[nodiscard]] double scaled(std::size_t i, std::size_t k, std::size_t j) const noexcept {
        return alpha[i * dimension + j] * (x[k * dimension + j] - beta[i * dimension + j]);
    }

    /// The same for what a hat is multiplied by: far away it is zero whatever u is, even if it is infinite.
    [[nodiscard]] double clamped(std::size_t i, std::size_t k, std::size_t j) const noexcept {
        return std::clamp(scaled(i, k, j), -detail::hat_reach, detail::hat_reach);
    }

    /// Calls visit(k, psi) for every sample k with the radial hat of wavelet i there, a block at a time: the
    /// exponentials of a block are vectorised, and none is taken where the wavelet reaches no sample of it.
    template <class Visitor>
    void radial(std::size_t i, Visitor visit) const {
        constexpr std::size_t block = 64;
        // exp(-80) is 2e-35. Products of what lies farther out are denormal numbers, with which linear
        // algebra takes ten times as long.
        constexpr double nothing_is_left = 160.0;
        const auto d = static_cast<double>(dimension);
        std::array<double, block> square{};
        std::array<double, block> gaussian{};
        for (std::size_t first = 0; first < samples; first += block) {
            const std::size_t size = std::min(block, samples - first);
            double nearest = nothing_is_left;
            for (std::size_t k = 0; k < size; ++k) {
                double sum = 0.0;
                for (std::size_t j = 0; j < dimension; ++j) {
                    const double u = scaled(i, first + k, j);
                    sum += u * u;
                }
                square[k] = std::min(sum, detail::hat_reach * detail::hat_reach);
                nearest = std::min(nearest, square[k]);
            }
            if (nearest < nothing_is_left) {
                detail::hat_kernel().gaussians(square.data(), size, gaussian.data());
            }
            for (std::size_t k = 0; k < size; ++k) {
                gaussian[k] = square[k] < nothing_is_left ? gaussian[k] : 0.0;
                visit(first + k,
                      RadialMexicanHat{(square[k] - d) * gaussian[k], (d + 2.0 - square[k]) * gaussian[k]});
            }
        }
    }
};

/// An (n, N) array stored column by column, as linear algebra wants it.
using Columns = py::array_t<double, py::array::f_style>;

[[nodiscard]] Columns columns(std::size_t samples, std::size_t wavelets) {
    return Columns({static_cast<py::ssize_t>(samples), static_cast<py::ssize_t>(wavelets)});
}

Columns wavelet_columns(const Array& x, const Array& alpha, const Array& beta) {
    const Frame frame(x, alpha, beta);
    auto result = columns(frame.samples, frame.wavelets);
    double* out = result.mutable_data();
    const py::gil_scoped_release unlocked;
    for (std::size_t i = 0; i < frame.wavelets; ++i) {
        frame.radial(i, [&](std::size_t /*k*/, const RadialMexicanHat& psi) { *out++ = psi.value; });
    }
    return result;
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
            frame.radial(i, [&](std::size_t k, const RadialMexicanHat& psi) {
                const std::size_t at = i * frame.samples + k;
                value_out[at] = psi.value;
                for (std::size_t j = 0; j < frame.dimension; ++j) {
                    const double dilation = frame.alpha[i * frame.dimension + j];
                    const double u = frame.clamped(i, k, j);
                    const double by_u = psi.gradient_over_u * u;
                    alpha_out[j][at] = by_u * (u / dilation);
                    beta_out[j][at] = -dilation * by_u;
                }
            });
        }
    }
    return {std::move(value), std::move(by_alpha), std::move(by_beta)};
}

Columns wavelet_steps(const Array& x, const Array& alpha, const Array& beta) {
    const Frame frame(x, alpha, beta);
    auto result = columns(frame.samples, 2 * frame.dimension * frame.wavelets);
    double* out = result.mutable_data();
    const py::gil_scoped_release unlocked;
    const std::size_t input = frame.wavelets * frame.samples;
    double* by_shift = out + frame.dimension * input;
    for (std::size_t i = 0; i < frame.wavelets; ++i) {
        frame.radial(i, [&](std::size_t k, const RadialMexicanHat& psi) {
            std::size_t at = i * frame.samples + k;
            for (std::size_t j = 0; j < frame.dimension; ++j, at += input) {
                const double u = frame.clamped(i, k, j);
                const double by_u = psi.gradient_over_u * u;
                out[at] = by_u * u;
                by_shift[at] = -by_u;
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
        frame.radial(i, [&](std::size_t k, const RadialMexicanHat& psi) {
            for (std::size_t j = 0; j < frame.dimension; ++j) {
                const double dilation = frame.alpha[i * frame.dimension + j];
                const double u = frame.clamped(i, k, j);
                *out[j]++ = dilation * dilation * psi.curvature(u);
            }
        });
    }
    return result;
}

Columns wavelet_slope_columns(const Array& x, const Array& alpha, const Array& beta) {
    const Frame frame(x, alpha, beta);
    if (frame.dimension != 1) {
        throw std::invalid_argument("x has shape " + shape_of(x) + ", must be (n,): this is for one input");
    }
    auto result = columns(frame.samples, frame.wavelets);
    double* out = result.mutable_data();
    const py::gil_scoped_release unlocked;
    for (std::size_t i = 0; i < frame.wavelets; ++i) {
        frame.radial(i, [&](std::size_t k, const RadialMexicanHat& psi) {
            *out++ = frame.alpha[i] * (psi.gradient_over_u * frame.clamped(i, k, 0));
        });
    }
    return result;
}

}  // namespace

void bind_wavelet(py::module_& module) {
    module.attr("wavelet_slope_bound") = wavelet_slope_bound;
    module.attr("wavelet_curvature_bound") = wavelet_curvature_bound;
    module.attr("wavelet_jerk_bound") = wavelet_jerk_bound;

    module.def("mexican_hat", py::vectorize([](double u) { return mexican_hat(u).value; }), "u"_a,
               "The Mexican hat psi(u) = (u^2 - 1) exp(-u^2 / 2), element by element.");
    module.def("mexican_hat_slope", py::vectorize([](double u) { return mexican_hat(u).slope; }), "u"_a,
               "psi'(u) = (3u - u^3) exp(-u^2 / 2).");
    module.def("mexican_hat_curvature", py::vectorize([](double u) { return mexican_hat_curvature(u); }),
               "u"_a, "psi''(u) = (u^4 - 6u^2 + 3) exp(-u^2 / 2).");
    module.def("mexican_hat_jerk", py::vectorize([](double u) { return mexican_hat_jerk(u); }), "u"_a,
               "psi'''(u) = (-u^5 + 10u^3 - 15u) exp(-u^2 / 2).");
    module.def("mexican_hat_integral", py::vectorize([](double u) { return mexican_hat(u).integral; }), "u"_a,
               "An antiderivative of psi: -u exp(-u^2 / 2).");

    module.def(
        "wavelet_columns", &wavelet_columns, "x"_a, "alpha"_a, "beta"_a,
        "psi(alpha_i o (x_k - beta_i)) of the radial Mexican hat: (n, N), column by column in memory.\n\n"
        "x is (n, d), alpha and beta are (N, d); (n,) and (N,) mean d = 1.");
    module.def("wavelet_jacobian", &wavelet_jacobian, "x"_a, "alpha"_a, "beta"_a,
               "The wavelet columns and their derivatives by the dilations and the translations:\n"
               "(value, by_alpha, by_beta), value (n, N), the others lists of d arrays (n, N).");
    module.def("wavelet_steps", &wavelet_steps, "x"_a, "alpha"_a, "beta"_a,
               "Derivatives of the wavelet columns by steps without a unit, d log(alpha) and alpha d(beta):\n"
               "(n, 2 d N), ordered (quantity, input, wavelet), column by column in memory.");
    module.def("wavelet_curvature_columns", &wavelet_curvature_columns, "x"_a, "alpha"_a, "beta"_a,
               "Second derivatives of the wavelet columns along each input: a list of d arrays (n, N).");
    module.def("wavelet_slope_columns", &wavelet_slope_columns, "x"_a, "alpha"_a, "beta"_a,
               "d psi(alpha_i (x_k - beta_i)) / dx for one input: (n, N).");
}

}  // namespace palpate::bindings
