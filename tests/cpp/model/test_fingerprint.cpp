// SPDX-License-Identifier: Apache-2.0
#include "palpate/model/fingerprint.hpp"

#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

using detail::NumberHash;

/// Returns the FNV-1a hash of bytes. The prime is 2^40 + 435.
std::uint64_t fnv1a(std::string_view bytes) {
    std::uint64_t hash = 14695981039346656037U;
    for (const char byte : bytes) {
        hash ^= static_cast<unsigned char>(byte);
        hash = (hash << 40U) + 435U * hash;
    }
    return hash;
}

/// Returns the eight bytes of a number, the least significant byte first.
std::string bytes_of(std::uint64_t number) {
    std::string bytes;
    for (int k = 0; k < 8; ++k, number >>= 8U) {
        bytes += static_cast<char>(number & 0xFFU);
    }
    return bytes;
}
std::string bytes_of(double number) {
    return bytes_of(std::bit_cast<std::uint64_t>(number));
}

template <class Added>
std::uint64_t hash_of(const Added& added) {
    NumberHash hash;
    hash.add(added);
    return hash.bits();
}

// The two values are test vectors of the authors of FNV-1a (draft-eastlake-fnv).
TEST(NumberHash, IsFnv1aOfTheBytes) {
    EXPECT_EQ(fnv1a("a"), 0xAF63DC4C8601EC8CU);
    EXPECT_EQ(fnv1a("foobar"), 0x85944171F73967E8U);
    EXPECT_EQ(NumberHash{}.bits(), fnv1a(""));
    for (const std::uint64_t number :
         std::array<std::uint64_t, 4>{0x0123456789ABCDEFU, 0xFFFFFFFFFFFFFFFFU, 0, 1}) {
        EXPECT_EQ(hash_of(number), fnv1a(bytes_of(number)));
    }
    EXPECT_EQ(hash_of(-1.75), fnv1a(bytes_of(-1.75)));
    EXPECT_NE(hash_of(0.0), hash_of(-0.0));
}

// The size comes first, so that two vectors cannot be mistaken for one.
TEST(NumberHash, AddsTheSizeOfVectorsAndTexts) {
    EXPECT_EQ(hash_of(std::vector{1.5, -2.0}),
              fnv1a(bytes_of(std::uint64_t{2}) + bytes_of(1.5) + bytes_of(-2.0)));
    EXPECT_EQ(hash_of(std::vector<double>{}), fnv1a(bytes_of(std::uint64_t{0})));
    EXPECT_EQ(hash_of(std::string_view{"A\xFF"}),
              fnv1a(bytes_of(std::uint64_t{2}) + bytes_of(std::uint64_t{65}) + bytes_of(std::uint64_t{255})));
}

TEST(NumberHash, TextHasSixteenDigits) {
    NumberHash hash;
    for (std::uint64_t k = 0; k < 300; ++k) {
        std::array<char, 17> digits{};
        (void)std::snprintf(digits.data(), digits.size(), "%016llx",
                            static_cast<unsigned long long>(hash.bits()));
        EXPECT_EQ(hash.text(), digits.data());
        hash.add(k);
    }
}

// Each model differs from the first one by one number. None may have the fingerprint of another.
TEST(Fingerprint, DistinguishesEveryNumberOfAModel) {
    NetworkParameters network{1, {5.0, 7.0}, {0.2, 0.6}, {0.5, -1.0}, {2.0}, 0.1};
    HysteresisParameters hysteresis{{0.1, 0.2}, 0.3, 0.4};
    Domain domain = test::unit_domain();
    std::optional<double> play_radius;
    MemoryParameters memory{{1, {3.0}, {0.4}, {0.5}, {0.2}, 1.0}, {2.0}, {0.1}};
    std::set<std::string> seen;
    std::size_t models = 0;
    const auto add = [&](const ForceModel& model, const std::string& what) {
        ++models;
        const std::string text = fingerprint(model);
        EXPECT_EQ(text, fingerprint(model));
        EXPECT_EQ(text.size(), 16U);
        EXPECT_TRUE(seen.insert(text).second) << what;
    };
    const auto add_all = [&](const std::string& what) {
        add(ForceModel{network, domain}, what);
        add(ForceModel{network, domain}.with_memory(memory), what + ", with memory");
        add(ForceModel{network, hysteresis, domain, play_radius}, what + ", with hysteresis");
    };
    add_all("first model");
    const auto with = [&](auto& field, auto value, const std::string& what) {
        const auto before = field;
        field = value;
        add_all(what);
        field = before;
    };
    with(network.alpha[1], 7.5, "alpha");
    with(network.beta[1], 0.7, "beta");
    with(network.weight[0], 0.6, "weight");
    with(network.linear[0], 2.1, "linear");
    with(network.bias, 0.2, "bias");
    with(domain.lower[0], -0.1, "lower");
    with(domain.upper[0], 1.1, "upper");
    with(domain.below, Continuation::Free, "below");
    with(domain.above, Continuation::Free, "above");
    const auto with_memory = [&](auto& field, auto value, const std::string& what) {
        const auto before = field;
        field = value;
        add(ForceModel{network, domain}.with_memory(memory), what);
        field = before;
    };
    with_memory(memory.ratio.alpha[0], 3.1, "alpha of the ratio");
    with_memory(memory.ratio.beta[0], 0.5, "beta of the ratio");
    with_memory(memory.ratio.weight[0], 0.6, "weight of the ratio");
    with_memory(memory.ratio.linear[0], 0.3, "linear of the ratio");
    with_memory(memory.ratio.bias, 1.1, "bias of the ratio");
    with_memory(memory.stiffness[0], 2.1, "stiffness");
    with_memory(memory.time_constant_s[0], 0.2, "time constant");
    const auto with_hysteresis = [&](auto& field, auto value, const std::string& what) {
        const auto before = field;
        field = value;
        add(ForceModel{network, hysteresis, domain, play_radius}, what);
        field = before;
    };
    with_hysteresis(hysteresis.weight[1], 0.3, "weight of the hysteresis");
    with_hysteresis(hysteresis.linear, 0.4, "linear of the hysteresis");
    with_hysteresis(hysteresis.bias, 0.5, "bias of the hysteresis");
    with_hysteresis(play_radius, std::optional{0.05}, "play radius");
    with_hysteresis(play_radius, std::optional{1.0}, "play radius 1");
    EXPECT_EQ(seen.size(), models);
}

TEST(Fingerprint, DistinguishesTheUnits) {
    const NetworkParameters network{1, {5.0}, {0.25}, {0.5}, {2.0}, 0.125};
    const ForceModel single{network, test::unit_domain()};
    const ForceModel both{network, {{0.25}, 0.5, 1.0}, test::unit_domain(), 0.125};
    for (const ForceModel& model :
         {single, single.with_memory({{1, {}, {}, {}, {0.0}, 1.0}, {2.0}, {0.5}}), both}) {
        std::set<std::string> seen;
        for (const char* position : {"", "rad", "m", "count"}) {
            for (const char* force : {"", "N*m", "N", "A"}) {
                seen.insert(fingerprint(model.with_units({position, force})));
            }
        }
        EXPECT_EQ(seen.size(), 16U);
        EXPECT_TRUE(seen.contains(fingerprint(model)));
    }
    const ForceModel in_units = both.with_units({"rad", "N*m"});
    EXPECT_EQ(fingerprint(in_units.with_play_radius(0.125)), fingerprint(in_units));
}

TEST(Fingerprint, DistinguishesAPeriodicForce) {
    const NetworkParameters constant{1, {}, {}, {}, {0.0}, 0.5};
    Domain domain = test::unit_domain();
    const std::string once = fingerprint(ForceModel{constant, domain});
    domain.period = 1.0;
    EXPECT_NE(fingerprint(ForceModel{constant, domain}), once);
}

TEST(Fingerprint, DistinguishesAHarmonicFromAWavelet) {
    NetworkParameters network{1, {40.0 * std::numbers::pi}, {0.5}, {0.5}, {0.0}, 0.5};  // 0 at both ends
    Domain domain = test::unit_domain();
    domain.period = 1.0;
    const std::string wavelet = fingerprint(ForceModel{network, domain});
    network.harmonics = 1;
    EXPECT_NE(fingerprint(ForceModel{network, domain}), wavelet);
}

TEST(Fingerprint, DistinguishesVelocityFromASecondPosition) {
    const NetworkParameters network{2, {}, {}, {}, {2.0, 0.5}, 0.1};
    const Domain box{{0.0, -1.0}, {1.0, 1.0}, {}, {}, std::nullopt};
    EXPECT_NE(fingerprint(ForceModel{network, box}), fingerprint(ForceModel::of_velocity(network, box)));
}

// Stored plans contain the fingerprint of their model: if one of these texts changes, a release refuses the plans of the
// releases before it.
TEST(Fingerprint, StaysTheSameForStoredPlans) {
    const NetworkParameters network{1, {5.0}, {0.25}, {0.5}, {2.0}, 0.125};
    const NetworkParameters plane{2, {}, {}, {}, {2.0, 0.5}, 0.125};
    const Domain box{{0.0, -1.0}, {1.0, 1.0}, {}, {}, std::nullopt};
    const ForceModel one{network, test::unit_domain()};
    EXPECT_EQ(fingerprint(one), "5f5b49fa096de810");
    EXPECT_EQ(fingerprint(one.with_units({"rad", "N*m"})), "cf5b04612975810e");
    EXPECT_EQ(fingerprint(one.with_memory({{1, {}, {}, {}, {0.0}, 1.0}, {2.0}, {0.5}})), "95b2bde19fbd6981");
    EXPECT_EQ(fingerprint(ForceModel{network, {{0.25}, 0.5, 1.0}, test::unit_domain(), 0.125}),
              "f5c203b8f58c9f50");
    EXPECT_EQ(fingerprint(ForceModel{plane, box}), "49b34bce238a1ed4");
    EXPECT_EQ(fingerprint(ForceModel::of_velocity(plane, box)), "d6b1977c9c928b75");
}

}  // namespace
}  // namespace palpate
