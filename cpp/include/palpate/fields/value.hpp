// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace palpate {

struct NamedValue;
/// Named values of a report, in the order in which the report contains them.
using NamedValues = std::vector<NamedValue>;

/// One value of a report, which is converted to JSON or to a Python object. An empty value and a number that is not
/// finite become null in JSON and None in Python.
using Value = std::variant<std::monostate, bool, std::uint64_t, double, std::string, std::vector<double>,
                           std::vector<std::string>, NamedValues, std::vector<NamedValues>>;

/// One named value of a report.
struct NamedValue {
    std::string name;
    Value value;
};

/// Lines of a report for the terminal, each with a title and a text.
using Lines = std::vector<std::pair<std::string, std::string>>;

}  // namespace palpate
