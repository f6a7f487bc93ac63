// SPDX-License-Identifier: Apache-2.0
// The corpus of tests/models: the same verdicts and field paths as Python's loader.
#include <fstream>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "palpate/io/model_file.hpp"

namespace palpate {
namespace {

const std::string corpus = PALPATE_SOURCE_DIR "/tests/models/";

nlohmann::json listed(const char* verdict) {
    std::ifstream manifest{corpus + "manifest.json"};
    return nlohmann::json::parse(manifest).at(verdict);
}

TEST(ModelFile, LoadsEveryGoodFile) {
    ASSERT_GT(listed("good").size(), 5U);
    for (const auto& entry : listed("good")) {
        const std::string file = corpus + entry.at("file").get<std::string>();
        EXPECT_NO_THROW((void)load_model_file(file)) << file;
    }
}

TEST(ModelFile, RefusesEveryBadFileWithTheFieldThatPythonNames) {
    ASSERT_GT(listed("bad").size(), 50U);
    for (const auto& entry : listed("bad")) {
        const std::string file = corpus + entry.at("file").get<std::string>();
        try {
            (void)load_model_file(file);
            ADD_FAILURE() << file << " was not refused";
        } catch (const std::invalid_argument& error) {
            const std::string sentence = error.what();
            EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
            ASSERT_EQ(sentence.rfind(file + ": ", 0), 0U) << sentence;
            if (const auto& field = entry.at("field");
                !field.is_null() && !field.get<std::string>().empty()) {
                EXPECT_EQ(sentence.substr(file.size() + 2).rfind(field.get<std::string>() + " ", 0), 0U)
                    << sentence;
            }
        }
    }
}

TEST(ModelFile, KeepsEveryNumberToTheLastBit) {
    const ModelFile file = load_model_file(corpus + "good/exact_numbers.json");
    EXPECT_EQ(file.model.parameters().weight, (std::vector<double>{0.30000000000000004, 5e-324}));
    EXPECT_EQ(file.model.parameters().bias, -1.7976931348623157e+308);
    EXPECT_EQ(file.position_unit, "rad");
    EXPECT_EQ(file.force_unit, "N*m");
}

TEST(ModelFile, GivesThePlanItsOwnNetworkAndKeepsTheIdentifiedOne) {
    const ModelFile file = load_model_file(corpus + "good/plan_network.json");
    EXPECT_EQ(file.model.parameters().weight, (std::vector<double>{0.8, -0.25}));
    EXPECT_EQ(file.planned().parameters().weight, (std::vector<double>{0.4}));
    ASSERT_TRUE(file.certificate);
    EXPECT_EQ(file.certificate->model, fingerprint(file.planned()));
    const ModelFile plain = load_model_file(corpus + "good/plan_and_certificate.json");
    EXPECT_EQ(&plain.planned(), &plain.model);
}

TEST(ModelFile, SaysThatAFileIsNotThere) {
    EXPECT_THROW((void)load_model_file(corpus + "nothing.json"), std::invalid_argument);
}

}  // namespace
}  // namespace palpate
