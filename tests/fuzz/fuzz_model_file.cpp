// SPDX-License-Identifier: Apache-2.0
// A model file is read or refused with one sentence. An accepted model has the same fingerprint after its network was
// written again, and a force that the force limit can bound at every position.
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "fuzzing.hpp"
#include "palpate/guard/limits.hpp"
#include "palpate/io/parse_model.hpp"
#include "palpate/model/environment.hpp"
#include "palpate/model/fingerprint.hpp"

namespace palpate::fuzz {
namespace {

Json rows_of(const std::vector<double>& numbers, std::size_t width) {
    Json rows = Json::array();
    for (std::size_t k = 0; k < numbers.size(); k += width) {
        rows.push_back(std::vector<double>{numbers.begin() + static_cast<std::ptrdiff_t>(k),
                                           numbers.begin() + static_cast<std::ptrdiff_t>(k + width)});
    }
    return rows;
}

/// Returns the content of the file with the network of the model that was read from it.
Json written_again(Json content, const ForceModel& model) {
    const NetworkParameters& read = model.parameters();
    Json& network = content["network"];
    network["dimension"] = read.dimension;
    network["alpha"] = rows_of(read.alpha, read.dimension);
    network["beta"] = rows_of(read.beta, read.dimension);
    network["weight"] = read.weight;
    network["linear"] = read.linear;
    network["bias"] = read.bias;
    if (const HysteresisNetwork* both = model.hysteresis()) {
        const NetworkParameters& hysteresis = both->hysteresis_force().parameters();
        network["weight_hysteresis"] = hysteresis.weight;
        network["linear_hysteresis"] = hysteresis.linear;
        network["bias_hysteresis"] = hysteresis.bias;
    }
    return content;
}

void check_force(const ForceModel& model) {
    const double lower = model.domain().lower[0];
    const double upper = model.domain().upper[0];
    constexpr double infinite = std::numeric_limits<double>::infinity();
    for (const double position : {lower, 0.5 * lower + 0.5 * upper, upper, 2.0 * lower - upper, 0.0, -1e300,
                                  infinite, std::numeric_limits<double>::quiet_NaN()}) {
        std::visit(
            [position]<class Kind>(const Kind& kind) {
                if constexpr (Environment<Kind>) {
                    double force = kind.at(position, kind.start(position)).force;
                    (void)ForceLimit{2.0}.apply(force);
                    require(std::abs(force) <= 2.0, "the force is limited");
                }
            },
            model.kind());
    }
}

}  // namespace
}  // namespace palpate::fuzz

FUZZ_TARGET(model_file) {
    using namespace palpate;
    fuzz::Input input{data, size};
    try {
        const Json content = parse_json(input.take_text());
        const ModelFile read = parse_model(content);
        fuzz::check_force(read.model);
        fuzz::check_force(read.planned());
        const std::string again = fuzz::written_again(content, read.model).dump();
        fuzz::require(fingerprint(parse_model(parse_json(again)).model) == fingerprint(read.model),
                      "a model has the same fingerprint after it was written again");
    } catch (const std::invalid_argument& error) {
        fuzz::require(std::string_view{error.what()}.find('\n') == std::string_view::npos,
                      "a file is refused with one sentence");
    }
    return 0;
}
