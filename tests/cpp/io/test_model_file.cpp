// SPDX-License-Identifier: Apache-2.0
// Tests the model-file reader with the valid and invalid files in tests/models.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/io/parse_model.hpp"
#include "support.hpp"

namespace palpate {
namespace {

const std::string corpus = PALPATE_SOURCE_DIR "/tests/models/";

Json listed(const std::string& list) {
    std::ifstream file{corpus + list};
    return Json::parse(file);
}

/// Returns the bytes of a text in which each character represents one byte.
std::string bytes(const std::string& text) {
    std::string result;
    for (std::size_t k = 0; k < text.size(); ++k) {
        const auto lead = static_cast<unsigned char>(text[k]);
        const bool two = lead >= 0x80U;
        result +=
            two ? static_cast<char>(((lead & 3U) << 6U) | (static_cast<unsigned char>(text[k + 1]) & 63U))
                : text[k];
        k += two ? 1 : 0;
    }
    return result;
}

/// Returns the content of the invalid model file that an entry of the list describes.
std::string text_of(const Json& entry) {
    if (entry.contains("text")) {
        return entry["text"];
    }
    std::ifstream file{corpus + "good/" + entry["base"].get<std::string>() + ".json"};
    std::string text{std::istreambuf_iterator<char>{file}, {}};
    if (entry.contains("patch")) {
        return Json::parse(text).patch(entry["patch"]).dump();
    }
    std::string by = bytes(entry["by"]);
    if (const std::size_t at = by.find('@'); entry.contains("times") && at != std::string::npos) {
        by.replace(at, 1,
                   std::string(entry["times"].get<std::size_t>(), entry["repeat"].get<std::string>()[0]));
    }
    const auto replaced = bytes(entry["replace"]);
    return text.replace(text.find(replaced), replaced.size(), by);
}

TEST(ModelFile, LoadsEveryGoodFile) {
    ASSERT_GT(listed("good.json").size(), 5U);
    for (const auto& entry : listed("good.json")) {
        const std::string file = corpus + entry.at("file").get<std::string>();
        EXPECT_NO_THROW((void)load_model_file(file)) << file;
    }
}

TEST(ModelFile, RefusesEveryBadFileWithItsField) {
    ASSERT_GT(listed("bad.json").size(), 50U);
    for (const auto& entry : listed("bad.json")) {
        const std::string name = entry["name"];
        try {
            (void)parse_model(parse_json(text_of(entry)));
            ADD_FAILURE() << name << " was not refused";
        } catch (const std::invalid_argument& error) {
            const std::string sentence = error.what();
            EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
            if (const auto& field = entry["field"]; !field.is_null() && !field.get<std::string>().empty()) {
                EXPECT_EQ(sentence.rfind(field.get<std::string>() + " ", 0), 0U) << name << ": " << sentence;
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

/// Returns the content of a good model file with n equal wavelets.
Json with_wavelets(const std::string& file, std::size_t n) {
    Json content = listed("good/" + file + ".json");
    for (const char* name : {"alpha", "beta", "weight", "weight_hysteresis"}) {
        if (Json& values = content["network"][name]; values.is_array()) {
            values = Json::array_t(n, Json(values[0]));
        }
    }
    content["fit"]["n_wavelets"] = n;
    content["slope_bounds"] = nullptr;
    return content;
}

TEST(ModelFile, KeepsTheVerdictOfTheIdentificationAndIgnoresOtherNotes) {
    Json file = Json::parse(std::ifstream{corpus + "good/position.json"});
    file["notes"]["verdict"] = Json::parse(
        R"([{"level": "usable", "sentence": "two rows are odd"}, 3, {"level": "no"}, {"level": "good", "sentence": "a"},
            {"level": "no", "sentence": "19 % are explained"}, {"level": 5, "sentence": "b"}])");
    const ModelFile read = parse_model(file);
    const std::vector<std::string> expected{
        "two rows are odd", "accepted although it is no: ", "accepted although it is no: 19 % are explained"};
    EXPECT_EQ(read.findings, expected);
    EXPECT_EQ(read.refusal, "");
    for (const char* other : {"3", "{}", "[]", "\"no\"", "null"}) {
        file["notes"]["verdict"] = Json::parse(other);
        EXPECT_EQ(parse_model(file).refusal, std::nullopt) << other;
        EXPECT_TRUE(parse_model(file).findings.empty()) << other;
    }
}

TEST(ModelFile, RefusesMoreWaveletsThanATickCanEvaluate) {
    for (const char* file : {"position", "hysteresis"}) {
        EXPECT_EQ(parse_model(with_wavelets(file, most_wavelets)).model.parameters().weight.size(), 1000U);
        try {
            (void)parse_model(with_wavelets(file, most_wavelets + 1));
            ADD_FAILURE() << file << " was not refused";
        } catch (const std::invalid_argument& error) {
            EXPECT_STREQ(error.what(),
                         "network.alpha has 1001 values: must have at most 1000, which a tick of 1 "
                         "ms can evaluate");
        }
    }
}

TEST(ModelFile, CountsAHarmonicAsTwoWaveletsOfATick) {
    Json content = with_wavelets("harmonics", 900);
    for (Json& alpha : content["network"]["alpha"]) {
        alpha[0] = 40.0 * std::numbers::pi;
    }
    content["network"]["harmonics"] = 100;
    EXPECT_NO_THROW((void)parse_model(content));
    content["network"]["harmonics"] = 101;
    EXPECT_EQ(
        test::refusal([&] { (void)parse_model(content); }),
        "network.harmonics is 101: must be at most 100, because a harmonic takes as long as two wavelets "
        "and a tick of 1 ms can evaluate 1000");
}

TEST(ModelFile, AcceptsManyWaveletsOfAForceThatIsNotRendered) {
    EXPECT_NO_THROW((void)parse_model(with_wavelets("two_inputs", 3000)));
}

TEST(ModelFile, ReportsAMissingFile) {
    EXPECT_THROW((void)load_model_file(corpus + "nothing.json"), std::invalid_argument);
}

/// Returns the error message of reading a file with this content, in a new file because tests run at the same time.
std::string refusal(const std::string& content) {
    const std::string path =
        testing::TempDir() + "refused-" + std::to_string(std::random_device{}()) + ".json";
    std::ofstream{path} << content;
    std::string message;
    try {
        (void)read_json(path);
    } catch (const std::invalid_argument& error) {
        message = std::string(error.what()).substr(path.size());
    }
    std::filesystem::remove(path);
    return message;
}

TEST(ModelFile, RefusesALargeFileBeforeItIsRead) {
    EXPECT_EQ(refusal("[]" + std::string(largest_json_bytes - 2, ' ')), "");
    EXPECT_EQ(
        refusal("[]" + std::string(largest_json_bytes - 1, ' ')),
        ": the file has 8388609 bytes: must have at most 8388608; remove notes, or identify the model with "
        "fewer wavelets");
}

TEST(ModelFile, RefusesAnObjectWithManyKeys) {
    std::string keys;
    for (std::size_t k = 0; k < most_json_keys; ++k) {
        keys += "\"" + std::to_string(k) + "\": 1, ";
    }
    const std::string last = R"("a": 1)";
    EXPECT_EQ(refusal("{" + keys.substr(0, keys.size() - 2) + "}"), "");
    EXPECT_EQ(refusal("{" + keys + last + "}"),
              ": an object has more than 1000 keys: store its values in lists");
}

}  // namespace
}  // namespace palpate
