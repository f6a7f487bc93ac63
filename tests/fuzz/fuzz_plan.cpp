// SPDX-License-Identifier: Apache-2.0
// The stored plan and certificate of a model file are read or refused with one sentence. The input is a JSON object
// that replaces keys of a model file that has both. An accepted certificate is never `refused`, holds for a period that
// is not shorter than that of its device, and is accepted again after it was written.
#include <stdexcept>
#include <string>
#include <string_view>

#include "fuzzing.hpp"
#include "palpate/io/parse_model.hpp"

namespace palpate::fuzz {
namespace {

/// Returns the content of the model file whose plan and certificate an input replaces.
const Json& planned_model() {
    static const Json content = read_json(PALPATE_SOURCE_DIR "/tests/models/good/plan_and_certificate.json");
    return content;
}

void check_plan(const ModelFile& read, const Json& content) {
    require(!read.certificate || read.plan.has_value(), "a certificate has a plan");
    if (read.certificate) {
        const Certificate& certificate = *read.certificate;
        require(certificate.verdict != Verdict::Refused, "a stored certificate is not refused");
        require(certificate.scheme.structure == read.plan->structure, "the certificate is that of the plan");
        require(certificate.longest_period_s >= 0.0, "the longest period is not negative");
    }
    const ModelFile again = parse_model(parse_json(content.dump()));
    require(again.certificate.has_value() == read.certificate.has_value() &&
                (!read.certificate || again.certificate->fingerprint == read.certificate->fingerprint),
            "a certificate is accepted again after it was written");
}

}  // namespace
}  // namespace palpate::fuzz

FUZZ_TARGET(plan) {
    using namespace palpate;
    fuzz::Input input{data, size};
    try {
        const Json changes = parse_json(input.take_text());
        if (!changes.is_object()) {
            return -1;
        }
        Json content = fuzz::planned_model();
        for (const auto& item : changes.items()) {
            if (item.key() == "plan" || item.key() == "certificate" || item.key() == "units") {
                content[item.key()] = item.value();
            }
        }
        fuzz::check_plan(parse_model(content), content);
    } catch (const std::invalid_argument& error) {
        fuzz::require(std::string_view{error.what()}.find('\n') == std::string_view::npos,
                      "a plan is refused with one sentence");
    }
    return 0;
}
