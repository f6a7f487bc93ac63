// SPDX-License-Identifier: Apache-2.0
// Mutants of the headers: tests/mutation/mutants.py calls these functions in a copy of the sources. The environment
// variable PALPATE_MUTANT selects one mutant. PALPATE_MUTANT_TRACE is a file for the numbers of the executed mutants.
#pragma once

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <type_traits>

namespace palpate_mutant {

inline constexpr int most = 100'000;

/// The selected mutant, and the mutants that were executed.
struct State {
    int selected = -1;
    const char* trace = std::getenv("PALPATE_MUTANT_TRACE");
    std::array<bool, most> executed{};

    State() {
        if (const char* number = std::getenv("PALPATE_MUTANT")) {
            selected = std::atoi(number);
        }
    }
    State(const State&) = delete;
    State& operator=(const State&) = delete;
    ~State() {
        if (trace == nullptr) {
            return;
        }
        std::ofstream file(trace, std::ios::app);
        for (int k = 0; k < most; ++k) {
            if (executed[static_cast<std::size_t>(k)]) {
                file << k << '\n';
            }
        }
    }
};
inline State state;

/// Returns true if mutant k is selected. A constant expression is never changed.
constexpr bool active(int k) {
    if (std::is_constant_evaluated()) {
        return false;
    }
    if (state.trace != nullptr) {
        state.executed[static_cast<std::size_t>(k)] = true;
    }
    return state.selected == k;
}

/// Replaces an operator, unless only the right one exists, as for texts.
#define PALPATE_MUTANT_OPERATOR(name, right, wrong)    \
    template <class A, class B>                        \
    constexpr auto name(int k, A&& a, B&& b) {         \
        if constexpr (requires { a wrong b; }) {       \
            if (active(k)) {                           \
                return decltype(a right b)(a wrong b); \
            }                                          \
        }                                              \
        return a right b;                              \
    }
PALPATE_MUTANT_OPERATOR(plus, +, -)
PALPATE_MUTANT_OPERATOR(minus, -, +)
PALPATE_MUTANT_OPERATOR(times, *, /)
PALPATE_MUTANT_OPERATOR(divide, /, *)
PALPATE_MUTANT_OPERATOR(less, <, <=)
PALPATE_MUTANT_OPERATOR(less_equal, <=, <)
PALPATE_MUTANT_OPERATOR(greater, >, >=)
PALPATE_MUTANT_OPERATOR(greater_equal, >=, >)
PALPATE_MUTANT_OPERATOR(equal, ==, !=)
PALPATE_MUTANT_OPERATOR(unequal, !=, ==)
#undef PALPATE_MUTANT_OPERATOR

template <class A>
constexpr auto negative(int k, A&& a) {
    return active(k) ? static_cast<decltype(-a)>(a) : -a;
}
template <class A>
constexpr bool negated(int k, A&& a) {
    return active(k) ? static_cast<bool>(a) : !a;
}
constexpr bool flag(int k, bool value) {
    return active(k) != value;
}
/// 0 becomes 1, another number twice its value.
template <class A>
constexpr A number(int k, A value) {
    return active(k) ? (value == A{0} ? A{1} : static_cast<A>(value + value)) : value;
}

}  // namespace palpate_mutant
