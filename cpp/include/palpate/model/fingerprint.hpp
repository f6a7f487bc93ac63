// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "palpate/fields/field_table.hpp"
#include "palpate/model/force_model.hpp"

namespace palpate {

namespace detail {

/// Computes the FNV-1a hash of the bits of numbers and texts. If one number changes, the hash almost certainly changes.
class NumberHash {
  public:
    /// Adds the 64 bits of a number to the hash.
    void add(std::uint64_t bits) noexcept {
        for (unsigned byte = 0; byte < 8U; ++byte) {
            value_ = (value_ ^ ((bits >> (8U * byte)) & 0xFFU)) * 0x100000001B3U;
        }
    }
    void add(double number) noexcept { add(std::bit_cast<std::uint64_t>(number)); }
    void add(const std::vector<double>& numbers) noexcept {
        add(static_cast<std::uint64_t>(numbers.size()));
        for (const double number : numbers) {
            add(number);
        }
    }
    void add(std::string_view text) noexcept {
        add(static_cast<std::uint64_t>(text.size()));
        for (const char letter : text) {
            add(static_cast<std::uint64_t>(static_cast<unsigned char>(letter)));
        }
    }
    /// Returns the 64 bits of the hash.
    [[nodiscard]] std::uint64_t bits() const noexcept { return value_; }
    /// Returns the hash as 16 hexadecimal digits.
    [[nodiscard]] std::string text() const {
        constexpr std::string_view digits{"0123456789abcdef"};
        std::string text;
        for (unsigned digit = 16; digit-- > 0;) {
            text += digits[(value_ >> (4U * digit)) & 0xFU];
        }
        return text;
    }

  private:
    std::uint64_t value_ = 0xCBF29CE484222325U;
};

/// Adds a value to a hash: each stored field of a struct, each item of a list.
template <class T>
void hash_value(NumberHash& hash, const T& value) {
    if constexpr (HasFields<T>) {
        for_each_field<T>([&](const auto& field) {
            const auto& part = field.of(value);
            if constexpr (is_optional<std::remove_cvref_t<decltype(part)>>) {
                // An empty optional field does not change the hash, so fingerprints computed before this field existed
                // remain valid
                if (part) {
                    hash.add(std::string_view{field.name});
                    hash_value(hash, *part);
                }
            } else if (field.stored) {
                hash_value(hash, part);
            }
        });
    } else if constexpr (std::is_enum_v<T>) {
        hash.add(static_cast<std::uint64_t>(value));
    } else if constexpr (std::is_arithmetic_v<T>) {
        hash.add(static_cast<double>(value));
    } else if constexpr (std::is_same_v<T, std::string>) {
        hash.add(std::string_view{value});
    } else {
        for (const auto& item : value) {
            hash_value(hash, item);
        }
    }
}

}  // namespace detail

/// Returns 16 hexadecimal digits that change with every number of a model's force (network, domain, continuation, play
/// radius, memory) and with its units. The digits distinguish an edited model from the certified model; they are not a
/// signature.
[[nodiscard]] inline std::string fingerprint(const ForceModel& model) {
    detail::NumberHash hash;
    const NetworkParameters& network = model.parameters();
    hash.add(static_cast<std::uint64_t>(network.dimension));
    hash.add(network.alpha);
    hash.add(network.beta);
    hash.add(network.weight);
    hash.add(network.linear);
    hash.add(network.bias);
    if (network.harmonics > 0) {
        hash.add(static_cast<std::uint64_t>(network.harmonics));
    }
    if (const HysteresisNetwork* pair = model.hysteresis()) {
        const NetworkParameters& hysteresis = pair->hysteresis_force().parameters();
        hash.add(hysteresis.weight);
        hash.add(hysteresis.linear);
        hash.add(hysteresis.bias);
    }
    const Domain& domain = model.domain();
    hash.add(domain.lower);
    hash.add(domain.upper);
    hash.add(static_cast<std::uint64_t>(domain.below));
    hash.add(static_cast<std::uint64_t>(domain.above));
    hash.add(domain.period.value_or(0.0));
    hash.add(model.play_radius().value_or(0.0));
    if (model.velocity() != nullptr) {
        // A model of position and velocity gets another hash than a model of two positions with the same parameters
        hash.add(std::uint64_t{1});
    }
    if (const MemoryNetwork* memory = model.memory()) {
        const MemoryParameters& parameters = memory->parameters();
        hash.add(parameters.ratio.alpha);
        hash.add(parameters.ratio.beta);
        hash.add(parameters.ratio.weight);
        hash.add(parameters.ratio.linear);
        hash.add(parameters.ratio.bias);
        hash.add(parameters.stiffness);
        hash.add(parameters.time_constant_s);
        if (!parameters.yield_stretch.empty()) {
            hash.add(parameters.yield_stretch);
        }
    }
    if (model.units() != ModelUnits{}) {
        hash.add(model.units().position);
        hash.add(model.units().force);
    }
    return hash.text();
}

}  // namespace palpate
