// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "palpate/io/detail/plan_file.hpp"
#include "palpate/io/json_field.hpp"
#include "palpate/io/json_text.hpp"
#include "palpate/io/parse_model.hpp"
#include "palpate/model/force_model.hpp"

// Definitions of parse_model and load_model_file, which take seconds to compile.
namespace palpate {

namespace detail {

/// Reads a list of N lists of d numbers. Returns the N * d numbers row by row; with `positive` each must be > 0.
[[nodiscard]] inline std::vector<double> matrix(const JsonField& field, std::size_t d, bool positive) {
    std::vector<double> values;
    for (const JsonField& row : field.items()) {
        for (const JsonField& item : row.items()) {
            values.push_back(positive ? item.positive() : item.number());
        }
        row.require_length(d, "one for each dimension");
    }
    return values;
}

/// Checks the value of the key `fit` of a model file: how the model was identified.
inline void check_fit(const JsonField& fit, std::size_t wavelets) {
    fit.require_keys({"model_class", "stop_reason", "nrmse", "n_wavelets", "n_parameters", "path"});
    (void)fit["model_class"].string();
    (void)fit["stop_reason"].string();
    (void)fit["nrmse"].not_negative();
    (void)fit["n_parameters"].count(0);
    for (const JsonField& step : fit["path"].items()) {
        step.require_keys({"n_wavelets", "rmse", "criterion", "model_class"});
        (void)step["n_wavelets"].count(0);
        (void)step["rmse"].not_negative();
        (void)(step["criterion"].is_null() ? 0.0 : step["criterion"].number());
        (void)step["model_class"].string();
    }
    fit["n_wavelets"].require(fit["n_wavelets"].count(0) == wavelets,
                              std::to_string(wavelets) + ", the wavelets of the network");
}

/// Checks the value of the key `data` of a model file: the recording from which the model was identified.
inline void check_data(const JsonField& data) {
    data.require_keys({"sha256", "files", "rows", "columns"});
    (void)data["sha256"].string();
    (void)data["rows"].count(0);
    for (const JsonField& file : data["files"].items()) {
        (void)file.string();
    }
    data["columns"].require_object();
    for (const auto& column : data["columns"].value().items()) {
        (void)data["columns"][column.key()].string();
    }
}

/// Checks the value of the key `band` of a model file: the range of force of a further recording.
inline void check_band(const JsonField& band) {
    band.require_keys({"position", "repeat", "object", "recordings", "objects", "unseen_error", "coverage"});
    const std::vector<double> position = band["position"].numbers();
    const bool increases =
        std::adjacent_find(position.begin(), position.end(), std::greater_equal<>{}) == position.end();
    band["position"].require(!position.empty() && increases, "a list of increasing positions");
    const bool several = band["objects"].count(1) > 1;
    (void)band["recordings"].count(2);
    for (const char* name : {"repeat", "object"}) {
        const JsonField half = band[name];
        const bool needed = (name == std::string("object")) == several;
        half.require(!half.is_null() || !needed, "given in the band of this number of objects");
        if (half.is_null()) {
            continue;
        }
        half.require_length(position.size(), "one for each position");
        for (const JsonField& each : half.items()) {
            (void)each.positive();
        }
    }
    band["object"].require(several || band["object"].is_null(), "null in the band of one object");
    (void)band["unseen_error"].not_negative();
    if (const JsonField share = band["coverage"]; !share.is_null()) {
        share.require(share.not_negative() <= 1.0, "at most 1");
    }
}

/// Reads the domain of the model in a model file, and the continuation of the force outside the domain.
inline Domain read_domain(const JsonField& file, std::size_t d) {
    const JsonField domain = file["domain"];
    domain.require_keys({"lower", "upper"});
    const JsonField beyond = file["continuation"];
    beyond.require_keys({"below", "above", "period"});
    Domain read{domain["lower"].numbers(), domain["upper"].numbers(), beyond["below"].as<Continuation>(),
                beyond["above"].as<Continuation>(), std::nullopt};
    domain["lower"].require_length(d, "one for each dimension");
    domain["upper"].require_length(d, "one for each dimension");
    for (std::size_t k = 0; k < d; ++k) {
        domain["lower"].items()[k].require(
            read.lower[k] < read.upper[k],
            "below domain.upper[" + std::to_string(k) + "] = " + readable(read.upper[k]));
    }
    if (const JsonField period = beyond["period"]; !period.is_null()) {
        const double travel = read.upper[0] - read.lower[0];
        read.period = period.positive();
        period.require(d == 1, "null in a model of several inputs");
        period.require(std::abs(*read.period - travel) <= 1e-9 * travel, "domain.upper - domain.lower");
    }
    return read;
}

/// Reads the key `memory` of a model file: the ratio, a network of one input, and the branches. A branch without a time
/// constant (null) does not relax, and one without a yield stretch does not slip.
inline MemoryParameters read_memory(const JsonField& memory) {
    memory.require_keys(
        {"alpha", "beta", "weight", "linear", "bias", "stiffness", "time_constant_s", "yield_stretch"});
    MemoryParameters read;
    for (const JsonField& item : memory["alpha"].items()) {
        read.ratio.alpha.push_back(item.positive());
    }
    read.ratio.beta = memory["beta"].numbers();
    read.ratio.weight = memory["weight"].numbers();
    read.ratio.linear = {memory["linear"].number()};
    read.ratio.bias = memory["bias"].number();
    const std::size_t n = read.ratio.alpha.size();
    memory["beta"].require_length(n, "one for each wavelet of alpha");
    memory["weight"].require_length(n, "one for each wavelet of alpha");
    for (const JsonField& item : memory["stiffness"].items()) {
        read.stiffness.push_back(item.not_negative());
    }
    const std::size_t branches = read.stiffness.size();
    memory["stiffness"].require(branches >= 1 && branches <= most_branches,
                                "a list of 1 to " + std::to_string(most_branches) + " numbers");
    const auto positive_or_null = [&](const char* name) {
        std::vector<double> values;
        for (const JsonField& item : memory[name].items()) {
            values.push_back(item.is_null() ? std::numeric_limits<double>::infinity() : item.positive());
        }
        memory[name].require_length(branches, "one for each branch");
        return values;
    };
    read.time_constant_s = positive_or_null("time_constant_s");
    if (memory.value().contains("yield_stretch")) {
        read.yield_stretch = positive_or_null("yield_stretch");
    }
    return read;
}

/// Reads the key `units` of a model file.
inline ModelUnits read_units(const JsonField& file) {
    const JsonField units = file["units"];
    units.require_keys({"position", "force"});
    return {units["position"].one_of({"rad", "m", "count", ""}),
            units["force"].one_of({"N*m", "N", "A", ""})};
}

/// Returns the model with the wavelet network at `network`, which is the identified network or the network of the plan.
/// Domain and kind of the model are those in `file`.
inline ForceModel read_network(const JsonField& network, const JsonField& file) {
    network.require_keys({"dimension", "alpha", "beta", "weight", "weight_hysteresis", "linear", "bias",
                          "linear_hysteresis", "bias_hysteresis", "harmonics"});
    NetworkParameters read;
    read.dimension = network["dimension"].count(1);
    const std::size_t d = read.dimension;
    read.alpha = matrix(network["alpha"], d, true);
    read.beta = matrix(network["beta"], d, false);
    read.weight = network["weight"].numbers();
    read.linear = network["linear"].numbers();
    read.bias = network["bias"].number();
    const std::size_t n = network["alpha"].items().size();
    network["beta"].require_length(n, "one for each wavelet of alpha");
    network["weight"].require_length(n, "one for each wavelet of alpha");
    network["linear"].require_length(d, "one for each dimension");
    if (network.value().contains("harmonics")) {
        read.harmonics = network["harmonics"].count(1);
        network["harmonics"].require(read.harmonics <= n,
                                     "at most the number of wavelets, " + std::to_string(n));
    }
    const JsonField hysteresis = network["weight_hysteresis"];
    for (const char* name : {"linear_hysteresis", "bias_hysteresis"}) {
        network[name].require(network[name].is_null() == hysteresis.is_null(),
                              hysteresis.is_null() ? "null, because weight_hysteresis is null"
                                                   : "given, because weight_hysteresis is given");
    }
    const std::string kind =
        file["kind"].one_of({"position", "hysteresis", "memory", "position_velocity", "general"});
    file["kind"].require(kind != "hysteresis" || !hysteresis.is_null(),
                         "another kind: weight_hysteresis is null");
    file["kind"].require((kind != "position" && kind != "memory") || hysteresis.is_null(),
                         "hysteresis: weight_hysteresis is given");
    if (d == 1 || kind == "position_velocity") {
        network["alpha"].require_at_most(most_wavelets, "which a tick of 1 ms can evaluate");
    }
    const bool remembers = file.value().contains("memory");
    file["kind"].require((kind == "memory") == remembers,
                         remembers ? "memory: memory is given" : "another kind: memory is not given");
    network["dimension"].require(!remembers || d == 1, "1 in a model with memory");
    const JsonField radius = file["play_radius"];
    const std::optional<double> play_radius =
        radius.is_null() ? std::nullopt : std::optional{radius.positive()};
    radius.require(radius.is_null() || !hysteresis.is_null(), "null in a model without hysteresis");
    network["dimension"].require(hysteresis.is_null() || d == 1, "1 in a model with hysteresis");
    const Domain domain = read_domain(file, d);
    if (read.harmonics > 0) {
        network["harmonics"].require(domain.period.has_value(), "left out: continuation.period is null");
        network["harmonics"].require(
            n + read.harmonics <= most_wavelets,
            "at most " + std::to_string(most_wavelets - n) +
                ", because a harmonic takes as long as two wavelets and a tick of 1 ms can "
                "evaluate " +
                std::to_string(most_wavelets));
        const std::vector<JsonField> alpha = network["alpha"].items();
        for (std::size_t i = read.hats(); i < n; ++i) {
            alpha[i].require(is_harmonic(read.alpha[i], *domain.period),
                             "a whole multiple of 2 pi / period, as of a harmonic");
        }
    }
    const ModelUnits units = read_units(file);
    if (remembers) {
        file["continuation"]["period"].require(!domain.period, "null in a model with memory");
        return ForceModel{read, domain}.with_memory(read_memory(file["memory"])).with_units(units);
    }
    if (hysteresis.is_null()) {
        return (kind == "position_velocity" && d == 2 ? ForceModel::of_velocity(read, domain)
                                                      : ForceModel{read, domain})
            .with_units(units);
    }
    const std::vector<double> linear = network["linear_hysteresis"].numbers();
    hysteresis.require(hysteresis.value().is_array(), "a list");
    hysteresis.require_length(n, "one for each wavelet of alpha");
    network["linear_hysteresis"].require_length(d, "one for each dimension");
    return ForceModel{
        read, {hysteresis.numbers(), linear[0], network["bias_hysteresis"].number()}, domain, play_radius}
        .with_units(units);
}

/// Returns the model that a plan renders instead of the identified model; nothing without a plan, or if the plan
/// renders the identified model. Both models must have the same number of inputs, and both or neither must have
/// hysteresis.
inline std::optional<ForceModel> read_limited(const JsonField& file) {
    if (file["plan"].is_null() || file["plan"]["network"].is_null()) {
        return std::nullopt;
    }
    const JsonField network = file["plan"]["network"];
    const JsonField identified = file["network"];
    network["dimension"].require(
        network["dimension"].value() == identified["dimension"].value(),
        identified["dimension"].value().dump() + ", the dimension of the identified network");
    const bool hysteresis = !identified["weight_hysteresis"].is_null();
    network["weight_hysteresis"].require(!network["weight_hysteresis"].is_null() == hysteresis,
                                         hysteresis ? "given, because network.weight_hysteresis is given"
                                                    : "null, because network.weight_hysteresis is null");
    return read_network(network, file);
}

/// Reads the verdict of the identification. Other notes belong to the user, so an entry of another form is ignored.
inline void read_findings(const Json& notes, ModelFile& read) {
    for (const Json& finding : notes.value("verdict", Json::array())) {
        const auto text = [&](const char* key) {
            return finding.is_object() && finding.contains(key) && finding[key].is_string()
                       ? finding[key].template get<std::string>()
                       : std::string{};
        };
        const std::string level = text("level");
        if (level == "usable" || level == "no") {
            read.findings.push_back((level == "no" ? "accepted although it is no: " : "") + text("sentence"));
            if (level == "no" && !read.refusal) {
                read.refusal = text("sentence");
            }
        }
    }
}

}  // namespace detail

PALPATE_INLINE ModelFile parse_model(const Json& content) {
    const detail::JsonField file{content, ""};
    file.require_object();
    // The version is checked first, because in a file of another version every other field may differ.
    const detail::JsonField version = file["version"];
    version.require(version.value().is_number_integer() && version.number() == 1.0,
                    "1, the version that this palpate reads");
    file.require_keys(
        {"format", "version",     "created_by", "kind",    "units",       "inputs",       "network",
         "memory", "play_radius", "mass",       "damping", "domain",      "continuation", "slope_bounds",
         "data",   "fit",         "band",       "plan",    "certificate", "notes"},
        "; put keys of your own under notes");
    (void)file["format"].one_of({"palpate-model"});
    (void)file["created_by"].string();
    const ModelUnits units = detail::read_units(file);
    ModelFile read{detail::read_network(file["network"], file), units.position, units.force, {}, {}, {}, {}};
    for (const detail::JsonField& input : file["inputs"].items()) {
        read.inputs.push_back(input.string());
    }
    file["inputs"].require_length(read.model.parameters().dimension, "one for each dimension");
    for (const char* name : {"mass", "damping"}) {
        (void)(file[name].is_null() ? 0.0 : file[name].not_negative());
    }
    if (const detail::JsonField bounds = file["slope_bounds"]; !bounds.is_null()) {
        bounds.require_keys({"min", "max"});
        bounds["min"].require(bounds["min"].number() <= bounds["max"].number(), "at most slope_bounds.max");
        read.model.require_slopes_within({bounds["min"].number(), bounds["max"].number()});
    }
    detail::check_data(file["data"]);
    detail::check_fit(file["fit"], read.model.parameters().weight.size());
    if (content.contains("band")) {
        detail::check_band(file["band"]);
    }
    read.plan = detail::read_plan(file["plan"]);
    read.limited = detail::read_limited(file);
    read.certificate =
        detail::read_certificate(file["certificate"], read.plan, read.planned(), read.position_unit);
    if (content.contains("notes")) {
        file["notes"].require_object();
        file["notes"].require_finite();
        detail::read_findings(content["notes"], read);
    }
    return read;
}

PALPATE_INLINE ModelFile load_model_file(const std::string& path) {
    const Json content = read_json(path);
    try {
        return parse_model(content);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(path + ": " + error.what());
    }
}

}  // namespace palpate
