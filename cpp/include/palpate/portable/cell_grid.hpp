// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "palpate/fields/field_table.hpp"
#include "palpate/fields/readable.hpp"
#include "palpate/model/parameters.hpp"

namespace palpate {

/// Number type of an exported model.
enum class Precision : std::uint8_t {
    Single,  ///< float, and 32-bit integers for the position
    Double,
};

template <>
inline constexpr auto words_of<Precision> = std::array<std::string_view, 2>{"single", "double"};

/// Returns half the distance from 1 to the next number of the precision: the largest relative rounding error.
[[nodiscard]] constexpr double unit_roundoff(Precision precision) noexcept {
    return precision == Precision::Single ? 0x1p-24 : 0x1p-53;
}

/// Positions of an exported table. 2^`bits` coarse cells of equal width follow each other; each coarse cell is split
/// into 2^k equal cells.
///
/// In single precision the position is a phase: an integer of 32 bits whose highest `bits` bits are the number of the
/// coarse cell. The next k bits are the number of the cell in it, and the others give the place in the cell. Without a
/// period the phase is (count - `origin`) 2^`shift`; with a period P it is count / P in units of 2^-32, modulo 1. So the
/// position has no rounding error, however far the encoder counts. In double precision the position is a number.
struct CellGrid {
    double encoder_step = 0.0;  ///< Delta, position for each count [m or rad]
    bool periodic = false;
    double lower = 0.0;         ///< lower end of the domain [m]
    double upper = 0.0;         ///< upper end of the domain [m]
    unsigned bits = 6;          ///< number of the coarse cells as a power of two
    double start = 0.0;         ///< position of the start of the first coarse cell [m]
    double coarse_width = 0.0;  ///< width of a coarse cell [m]

    // Single precision
    std::int32_t first_count = 0;   ///< lowest count inside the domain
    std::int32_t last_count = 0;    ///< highest count inside the domain
    std::int32_t origin = 0;        ///< count with the phase 0
    unsigned shift = 0;             ///< phase for each count as a power of two; without a period
    std::uint32_t phase_lower = 0;  ///< phase of `lower`, rounded down; without a period
    std::uint32_t phase_upper = 0;  ///< phase of `upper`, rounded down; without a period
    std::uint64_t phase_step = 0;   ///< phase for each count in units of 2^-64 of a period; with a period
    std::uint64_t phase_start = 0;  ///< phase of count 0 in units of 2^-64 of a period; with a period

    /// Counts beyond this distance from zero are not supported for the ends of a domain.
    static constexpr double farthest_count = 0x1p24;
    /// Fewest counts in a domain or a period; with fewer, a table has no use.
    static constexpr double fewest_counts = 8.0;

    /// Makes the grid of the domain [lower, upper]. `fractions` is true if positions between two counts occur.
    CellGrid(double step, double lowest, double highest, bool repeats, bool fractions, Precision precision,
             unsigned coarse_bits)
        : encoder_step{step}, periodic{repeats}, lower{lowest}, upper{highest}, bits{coarse_bits} {
        const double counts = (upper - lower) / step;
        detail::require(counts >= fewest_counts,
                        "the encoder step is " + readable(step) + ": must be at most " +
                            readable((upper - lower) / fewest_counts) + ", an eighth of the model's domain");
        detail::require(std::max(std::abs(lower), std::abs(upper)) <= farthest_count * step,
                        "the encoder step is " + readable(step) + ": must be at least " +
                            readable(std::max(std::abs(lower), std::abs(upper)) / farthest_count) +
                            ", so that the domain lies within 2^24 counts of zero");
        first_count = static_cast<std::int32_t>(std::ceil(lower / step));
        last_count = static_cast<std::int32_t>(std::floor(upper / step));
        if (precision == Precision::Double || periodic) {
            start = lower;
            coarse_width = std::ldexp(upper - lower, -static_cast<int>(bits));
            place_period(counts);
        } else {
            place_counts(fractions);
        }
    }

    /// Returns the width of the cells of a coarse cell that is split into 2^k [m].
    [[nodiscard]] double width(unsigned k) const noexcept {
        return std::ldexp(coarse_width, -static_cast<int>(k));
    }
    /// Returns the number of coarse cells that the domain needs.
    [[nodiscard]] std::size_t coarse_cells() const noexcept {
        const std::size_t all = std::size_t{1} << bits;
        return shift == 0 ? all : (std::size_t{phase_upper} >> (32U - bits)) + 1;
    }
    /// Returns the phase for each count; in double precision 0.
    [[nodiscard]] double phase_per_count() const noexcept {
        return periodic ? 0x1p32 * encoder_step / (upper - lower) : std::ldexp(1.0, static_cast<int>(shift));
    }
    /// Returns a bound of the error of the place in a cell that is caused by rounding of the position [m].
    [[nodiscard]] double position_error(Precision precision, bool fractions) const noexcept {
        const double reach = std::max(std::abs(lower), std::abs(upper));
        if (precision == Precision::Double) {
            return 8.0 * unit_roundoff(precision) * (reach + (upper - lower));
        }
        // A fraction of a count has two roundings as a float, then it is cut to a whole phase. The phase of a periodic
        // position has an error below 2, because the rounding of `phase_step` is multiplied by at most 2^31 counts.
        const double phase = encoder_step / phase_per_count();
        return (periodic ? 2.0 * phase : 0.0) + (fractions ? 0x1p-22 * encoder_step + 2.0 * phase : 0.0) +
               8.0 * unit_roundoff(Precision::Double) * (reach + (upper - lower));
    }

  private:
    void place_counts(bool fractions) noexcept {
        // A fraction can reach the count before the first one and after the last one
        origin = fractions ? first_count - 2 : first_count;
        const double counts = static_cast<double>(last_count - origin) + (fractions ? 3.0 : 1.0);
        shift = 0;
        while (shift < 31U && std::ldexp(counts, static_cast<int>(shift) + 1) <= 0x1p32) {
            ++shift;
        }
        const auto phase = [this](double x) {
            return static_cast<std::uint32_t>(
                std::floor(std::ldexp(x / encoder_step - origin, static_cast<int>(shift))));
        };
        phase_lower = fractions ? phase(lower) : 0U;
        phase_upper = fractions ? phase(upper) : static_cast<std::uint32_t>(last_count - origin) << shift;
        start = origin * encoder_step;
        coarse_width = std::ldexp(encoder_step, 32 - static_cast<int>(bits + shift));
    }

    /// Computes the phase of a count from the number of counts in a period, `counts`.
    void place_period(double counts) noexcept {
        if (periodic) {
            // 64 bits need a long double or two doubles; the remainder of the division gives the second one
            const double high = std::floor(0x1p32 / counts);
            const double rest = std::fma(-high, counts, 0x1p32);
            phase_step = (static_cast<std::uint64_t>(high) << 32U) +
                         static_cast<std::uint64_t>(std::llround(rest / counts * 0x1p32));
            const double turns = lower / (upper - lower);
            const double along = std::floor(turns) - turns;  // from -1 to 0: minus the phase of position 0
            phase_start = static_cast<std::uint64_t>((along + 1.0) * 0x1p63) << 1U;
        }
    }
};

}  // namespace palpate
