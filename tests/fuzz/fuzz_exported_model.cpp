// SPDX-License-Identifier: Apache-2.0
// The C functions of exported models of every kind, with any sequence of counts. The force of a tick is finite and within
// the force limit of the device, and the torque is its rounded value. With doubles, a position that is not finite has
// no undefined behaviour, and after a new start all forces are finite again.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iterator>

#include "all.h"
#include "fuzzing.hpp"

namespace palpate::fuzz {
namespace {

constexpr double force_limit = 2.5;  // exports.py

/// Runs one model: `Model` has its functions under common names.
template <class Model>
void run(Input& input) {
    typename Model::State state{};
    auto count = input.take<std::int32_t>();
    Model::start(&state, count);
    while (!input.empty()) {
        const auto event = input.take<std::uint8_t>();
        // Mostly small steps, as those of a hand; sometimes any count.
        const auto step =
            event % 16 == 0 ? input.take<std::int32_t>() : input.take<std::int8_t>() * (1 << event / 32);
        count =
            static_cast<std::int32_t>(static_cast<std::uint32_t>(count) + static_cast<std::uint32_t>(step));
        if constexpr (Model::has_positions) {
            if (event % 16 == 1) {
                Model::at_position(&state, input.take<double>());
                Model::start(&state, count);
            }
        }
        typename Model::Real slope{};
        require(std::isfinite(Model::force(&state, count)), "the force is finite");
        require(std::isfinite(Model::force_slope(&state, count, &slope)) && std::isfinite(slope),
                "the slope is finite");
        require(std::isfinite(Model::energy(&state, count)), "the energy is finite");
        typename Model::State same = state;
        const double force = Model::step(&state, count);
        require(std::abs(force) <= force_limit, "the force of a tick is within the force limit");
        const double torque_uNm = Model::torque_uNm(&same, count);
        require(std::abs(torque_uNm + 1e6 * force) <= 1.0, "the torque is the rounded force");
        if (event == 255) {
            Model::start(&state, count);
        }
    }
}

// NOLINTBEGIN(bugprone-macro-parentheses): names of functions
#define COMMON(name)                                                           \
    using State = name##_state;                                                \
    using Real = name##_real;                                                  \
    static void start(State* s, std::int32_t count) {                          \
        name##_start(s, count);                                                \
    }                                                                          \
    static Real force(const State* s, std::int32_t count) {                    \
        return name##_force(s, count);                                         \
    }                                                                          \
    static Real force_slope(const State* s, std::int32_t count, Real* slope) { \
        return name##_force_slope(s, count, slope);                            \
    }                                                                          \
    static Real energy(const State* s, std::int32_t count) {                   \
        return name##_energy(s, count);                                        \
    }                                                                          \
    static Real step(State* s, std::int32_t count) {                           \
        return name##_step(s, count);                                          \
    }                                                                          \
    static std::int32_t torque_uNm(State* s, std::int32_t count) {             \
        return name##_torque_uNm(s, count);                                    \
    }

#define DEFINE_SINGLE(name)                          \
    struct name {                                    \
        static constexpr bool has_positions = false; \
        COMMON(name)                                 \
    };

#define DEFINE_DOUBLE(name)                                   \
    struct name {                                             \
        static constexpr bool has_positions = true;           \
        COMMON(name)                                          \
        static void at_position(State* s, double position) {  \
            double slope = 0.0;                               \
            (void)name##_force_at(s, position);               \
            (void)name##_force_slope_at(s, position, &slope); \
            (void)name##_energy_at(s, position);              \
            name##_advance_at(s, position);                   \
            name##_start_at(s, position);                     \
            (void)name##_force_at(s, position);               \
        }                                                     \
    };

ALL_MODELS(DEFINE_SINGLE, DEFINE_DOUBLE)

#define RUN(name) run<name>,
constexpr void (*models[])(Input&){ALL_MODELS(RUN, RUN)};
// NOLINTEND(bugprone-macro-parentheses)

}  // namespace
}  // namespace palpate::fuzz

FUZZ_TARGET(exported_model) {
    palpate::fuzz::Input input{data, size};
    palpate::fuzz::models[input.take<std::uint8_t>() % std::size(palpate::fuzz::models)](input);
    return 0;
}
