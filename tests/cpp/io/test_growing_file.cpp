// SPDX-License-Identifier: Apache-2.0
// Tests that a recording file is locked while rows are added to it, and that a new recording never replaces an existing
// file.
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "palpate/io/growing_file.hpp"

namespace palpate {
namespace {

class GrowingFileTest : public testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = testing::TempDir() + "growing-XXXXXX";
        ASSERT_NE(mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }
    void put(const std::string& name, const std::string& text) const { std::ofstream{file(name)} << text; }
    [[nodiscard]] std::string text(const std::string& name) const {
        std::ifstream stream{file(name)};
        return {std::istreambuf_iterator<char>{stream}, {}};
    }
    [[nodiscard]] bool there(const std::string& name) const {
        return std::filesystem::exists(std::filesystem::symlink_status(file(name)));
    }

  private:
    std::filesystem::path folder_;
};

TEST_F(GrowingFileTest, IsRenamedAtTheEnd) {
    GrowingFile growing;
    ASSERT_EQ(growing.open(file("a.csv")), "");
    EXPECT_EQ(growing.append("one\n"), 4U);
    EXPECT_EQ(text("a.csv.part"), "one\n");
    EXPECT_EQ(growing.finish(), "");
    EXPECT_EQ(text("a.csv"), "one\n");
    EXPECT_FALSE(there("a.csv.part"));
}

TEST_F(GrowingFileTest, RefusesAnExistingRecordingAndReplacesItWithForce) {
    put("a.csv", "precious\n");
    GrowingFile refused;
    EXPECT_NE(refused.open(file("a.csv")).find("a.csv exists already"), std::string::npos);
    EXPECT_FALSE(there("a.csv.part"));
    EXPECT_EQ(text("a.csv"), "precious\n");
    GrowingFile forced;
    ASSERT_EQ(forced.open(file("a.csv"), true), "");
    (void)forced.append("new\n");
    EXPECT_EQ(text("a.csv"), "precious\n") << "until the end";
    EXPECT_EQ(forced.finish(), "");
    EXPECT_EQ(text("a.csv"), "new\n");
}

TEST_F(GrowingFileTest, RefusesASecondWriterWithAndWithoutForce) {
    GrowingFile first;
    ASSERT_EQ(first.open(file("a.csv")), "");
    (void)first.append("first\n");
    for (const bool force : {false, true}) {
        GrowingFile second;
        EXPECT_NE(second.open(file("a.csv"), force).find("is being written by another run"),
                  std::string::npos);
    }
    EXPECT_EQ(first.finish(), "");
    EXPECT_EQ(text("a.csv"), "first\n");
}

TEST_F(GrowingFileTest, DoesNotReplaceAFileCreatedMeanwhile) {
    GrowingFile growing;
    ASSERT_EQ(growing.open(file("a.csv")), "");
    (void)growing.append("new\n");
    put("a.csv", "precious\n");
    const std::string reason = growing.finish();
    EXPECT_NE(reason.find("a.csv was created by another program meanwhile"), std::string::npos) << reason;
    EXPECT_NE(reason.find("a.csv.part"), std::string::npos) << reason;
    EXPECT_EQ(text("a.csv"), "precious\n");
    EXPECT_EQ(text("a.csv.part"), "new\n");
}

TEST_F(GrowingFileTest, RenamesOnlyItsOwnFile) {
    GrowingFile growing;
    ASSERT_EQ(growing.open(file("a.csv")), "");
    (void)growing.append("own\n");
    std::filesystem::rename(file("a.csv.part"), file("moved"));
    put("a.csv.part", "of another\n");
    EXPECT_NE(growing.finish().find("was moved or replaced by another program"), std::string::npos);
    EXPECT_FALSE(there("a.csv"));
    EXPECT_EQ(text("a.csv.part"), "of another\n");
    EXPECT_EQ(text("moved"), "own\n");
}

TEST_F(GrowingFileTest, DiscardsOnlyItsOwnFile) {
    GrowingFile growing;
    ASSERT_EQ(growing.open(file("a.csv")), "");
    std::filesystem::remove(file("a.csv.part"));
    put("a.csv.part", "of another\n");
    growing.discard();
    EXPECT_EQ(text("a.csv.part"), "of another\n");
}

TEST_F(GrowingFileTest, RenamesAnInterruptedRecordingAndNeverReplacesIt) {
    put("a.csv.part", "cut off\n");
    put("a.csv.1.part", "cut off before\n");
    GrowingFile growing;
    ASSERT_EQ(growing.open(file("a.csv"), true), "");
    EXPECT_EQ(growing.interrupted_name(), file("a.csv.2.part"));
    EXPECT_EQ(growing.finish(), "");
    EXPECT_EQ(text("a.csv.1.part"), "cut off before\n");
    EXPECT_EQ(text("a.csv.2.part"), "cut off\n");
}

TEST_F(GrowingFileTest, KeepsAnInterruptedRecordingIfTheRunIsRefused) {
    put("a.csv", "precious\n");
    put("a.csv.part", "cut off\n");
    GrowingFile growing;
    EXPECT_NE(growing.open(file("a.csv")), "");
    EXPECT_EQ(text("a.csv.part"), "cut off\n");
}

TEST_F(GrowingFileTest, RefusesAnEmptyPartThatMayBelongToAStartingRun) {
    put("a.csv.part", "");
    GrowingFile growing;
    EXPECT_NE(growing.open(file("a.csv")).find("is empty and may belong to a run that is starting"),
              std::string::npos);
}

TEST_F(GrowingFileTest, KeepsASymbolicLinkAndReplacesItsTargetWithForce) {
    put("real.csv", "old\n");
    std::filesystem::create_symlink(file("real.csv"), file("link.csv"));
    GrowingFile refused;
    EXPECT_NE(refused.open(file("link.csv")), "");
    GrowingFile forced;
    ASSERT_EQ(forced.open(file("link.csv"), true), "");
    (void)forced.append("new\n");
    EXPECT_EQ(forced.finish(), "");
    EXPECT_TRUE(std::filesystem::is_symlink(file("link.csv")));
    EXPECT_EQ(text("real.csv"), "new\n");
}

TEST_F(GrowingFileTest, DoesNotFollowALinkAtThePart) {
    put("victim", "precious\n");
    std::filesystem::create_symlink(file("victim"), file("a.csv.part"));
    for (const bool force : {false, true}) {
        GrowingFile growing;
        EXPECT_NE(growing.open(file("a.csv"), force), "");
    }
    EXPECT_EQ(text("victim"), "precious\n");
}

TEST_F(GrowingFileTest, RefusesAPipeAndALinkToAMissingFile) {
    ASSERT_EQ(mkfifo(file("pipe").c_str(), 0600), 0);
    std::filesystem::create_symlink(file("nothing"), file("link"));
    for (const bool force : {false, true}) {
        for (const char* name : {"pipe", "link"}) {
            GrowingFile growing;
            EXPECT_NE(growing.open(file(name), force), "") << name;
        }
    }
    EXPECT_FALSE(there("nothing"));
}

}  // namespace
}  // namespace palpate
