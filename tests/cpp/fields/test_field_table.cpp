// SPDX-License-Identifier: Apache-2.0
#include "palpate/fields/field_table.hpp"

#include <optional>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "palpate/io/json_field.hpp"
#include "palpate/model/fingerprint.hpp"
#include "palpate/stability/certificate_check.hpp"
#include "support.hpp"

namespace palpate {

namespace {

struct Motor {
    double inertia = 1.0;
    std::optional<double> time_constant_s;
};

}  // namespace

template <>
inline constexpr auto fields_of<Motor> =
    FieldTable{Field<&Motor::inertia>{"inertia", "[kg*m^2]", Rule::Positive},
               Field<&Motor::time_constant_s>{"time_constant_s", "[s]", Rule::NotNegative}};

namespace {

Motor read(const std::string& text) {
    const Json content = parse_json(text);
    return detail::JsonField{content, "motor"}.as<Motor>();
}

std::string refusal(const std::string& text) {
    return test::refusal([&] { (void)read(text); });
}

std::string hash_of(const Motor& motor) {
    detail::NumberHash hash;
    detail::hash_value(hash, motor);
    return hash.text();
}

TEST(FieldTable, OptionalFieldIsCheckedOnlyIfItIsGiven) {
    EXPECT_NO_THROW(check_fields(Motor{}));
    EXPECT_NO_THROW(check_fields(Motor{1.0, 0.0}));
    try {
        check_fields(Motor{1.0, -1.0}, "motor: ");
        FAIL();
    } catch (const std::invalid_argument& error) {
        EXPECT_STREQ(error.what(), "motor: time_constant_s is -1, must be >= 0");
    }
}

TEST(FieldTable, SumOfTablesKeepsTheOrder) {
    constexpr auto table = fields_of<Motor> + FieldTable{Field<&Motor::inertia>{"again"}};
    static_assert(table.size == 3);
    EXPECT_EQ(table.apply([](const auto&... field) { return (std::string{} + ... + field.name); }),
              "inertiatime_constant_sagain");
    Motor motor{5.0, {}};
    EXPECT_EQ(table.get<2>().of(motor), 5.0);
}

TEST(FieldTable, OnlyOptionalFieldsMayBeMissingInAFile) {
    EXPECT_FALSE(read(R"({"inertia": 2})").time_constant_s);
    EXPECT_EQ(read(R"({"inertia": 2, "time_constant_s": 0.5})").time_constant_s, 0.5);
    EXPECT_EQ(refusal(R"({"time_constant_s": 0.5})"), "motor.inertia is missing");
    EXPECT_EQ(refusal(R"({"inertia": 2, "time_constant_s": -1})"),
              "motor.time_constant_s is -1: must be >= 0");
    EXPECT_EQ(refusal(R"({"inertia": 2, "time_constant_s": null})"),
              "motor.time_constant_s is null: must be a number");
}

TEST(FieldTable, OptionalFieldChangesAFingerprintOnlyIfItIsGiven) {
    detail::NumberHash before;
    before.add(1.0);
    EXPECT_EQ(hash_of({}), before.text());
    EXPECT_NE(hash_of({1.0, 0.0}), before.text());
    EXPECT_NE(hash_of({1.0, 0.5}), hash_of({1.0, 0.0}));
}

TEST(FieldTable, OptionalNumbersAgreeIfBothOrNeitherIsGiven) {
    const std::optional<double> none;
    EXPECT_TRUE(agree(none, none));
    EXPECT_FALSE(agree(none, std::optional{0.0}));
    EXPECT_TRUE(agree(std::optional{1.0}, std::optional{1.0 + 1e-12}));
    EXPECT_FALSE(agree(std::optional{1.0}, std::optional{1.1}));
    EXPECT_EQ(readable(none), "not given");
}

}  // namespace

}  // namespace palpate
