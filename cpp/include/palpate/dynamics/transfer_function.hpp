// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <stdexcept>

namespace palpate {

/// A discrete transfer function of order at most two, with its state s1, s2,
///
///     H(z) = (b0 z^2 + b1 z + b2) / (z^2 + a1 z + a2),
///
/// computed in transposed direct form II: y = b0 u + s1, s1 <- b1 u - a1 y + s2, s2 <- b2 u - a2 y. A first-order
/// function has a factor z in both polynomials.
class TransferFunction {
  public:
    constexpr TransferFunction(std::array<double, 3> numerator, std::array<double, 3> denominator)
        : numerator_{numerator}, denominator_{denominator} {
        if (denominator[0] != 1.0) {
            throw std::invalid_argument("the leading coefficient of the denominator must be 1");
        }
    }

    [[nodiscard]] constexpr const std::array<double, 3>& numerator() const noexcept { return numerator_; }
    [[nodiscard]] constexpr const std::array<double, 3>& denominator() const noexcept { return denominator_; }

    /// Updates the state with the next input u and returns the output y.
    [[nodiscard]] constexpr double step(double input) noexcept {
        const double output = numerator_[0] * input + state_[0];
        state_[0] = numerator_[1] * input - denominator_[1] * output + state_[1];
        state_[1] = numerator_[2] * input - denominator_[2] * output;
        return output;
    }

    constexpr void reset() noexcept { state_ = {}; }

    /// Returns the transfer function H(z) at any complex z, for example e^{j omega T} for the frequency omega.
    [[nodiscard]] std::complex<double> at(std::complex<double> z) const noexcept {
        return ((numerator_[0] * z + numerator_[1]) * z + numerator_[2]) /
               ((z + denominator_[1]) * z + denominator_[2]);
    }

    /// Returns the poles of the transfer function, that is the two roots of its denominator.
    [[nodiscard]] std::array<std::complex<double>, 2> poles() const noexcept {
        const double middle = -0.5 * denominator_[1];
        const std::complex<double> half = std::sqrt(std::complex<double>{middle * middle - denominator_[2]});
        return {middle + half, middle - half};
    }

  private:
    std::array<double, 3> numerator_;
    std::array<double, 3> denominator_;
    std::array<double, 2> state_{};
};

}  // namespace palpate
