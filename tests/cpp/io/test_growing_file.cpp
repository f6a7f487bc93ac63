// SPDX-License-Identifier: Apache-2.0
// Tests that a recording file is locked while rows are added to it, and that a new recording never replaces an existing
// file.
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <latch>
#include <string>
#include <thread>

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

TEST_F(GrowingFileTest, UsesAnEmptyPartWithoutAWriter) {
    put("a.csv.part", "");
    const std::ifstream created{file("a.csv.part")};  // as another run that has not locked the file yet
    struct stat before{};
    struct stat after{};
    ASSERT_EQ(stat(file("a.csv.part").c_str(), &before), 0);
    GrowingFile growing;
    ASSERT_EQ(growing.open(file("a.csv")), "");
    ASSERT_EQ(stat(file("a.csv.part").c_str(), &after), 0);
    EXPECT_EQ(before.st_ino, after.st_ino);
    EXPECT_EQ(growing.interrupted_name(), "");
    EXPECT_EQ(growing.finish(), "");
    EXPECT_FALSE(there("a.csv.1.part"));
}

TEST_F(GrowingFileTest, OfTwoRunsThatStartTogetherExactlyOneWrites) {
    for (int round = 0; round < 200; ++round) {
        std::array<GrowingFile, 2> runs;
        std::array<std::string, 2> reasons;
        std::latch both{2};
        {
            std::jthread other{[&] {
                both.arrive_and_wait();
                reasons[1] = runs[1].open(file("a.csv"));
            }};
            both.arrive_and_wait();
            reasons[0] = runs[0].open(file("a.csv"));
        }
        ASSERT_EQ((reasons[0].empty() ? 1 : 0) + (reasons[1].empty() ? 1 : 0), 1) << reasons[0] << reasons[1];
        GrowingFile& winner = runs[reasons[0].empty() ? 0 : 1];
        (void)winner.append("own\n");
        ASSERT_EQ(text("a.csv.part"), "own\n");
        winner.discard();
    }
}

TEST_F(GrowingFileTest, ReplacesARecordingWithForceAndKeepsItsMode) {
    put("a.csv", "old\n");
    ASSERT_EQ(chmod(file("a.csv").c_str(), 0600), 0);
    GrowingFile growing;
    ASSERT_EQ(growing.open(file("a.csv"), true), "");
    struct stat about{};
    ASSERT_EQ(stat(file("a.csv.part").c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 07777U, 0600U);
    EXPECT_EQ(growing.finish(), "");
}

TEST_F(GrowingFileTest, DoesNotFollowALinkOfAnotherUserInASharedFolder) {
    if (geteuid() != 0) {
        GTEST_SKIP() << "needs root, to create a link of another user";
    }
    std::filesystem::create_directory(file("shared"));
    ASSERT_EQ(chown(file("shared").c_str(), 1000, 1000), 0);
    ASSERT_EQ(chmod(file("shared").c_str(), 01777), 0);
    put("victim.csv", "precious\n");
    std::filesystem::create_symlink(file("victim.csv"), file("shared/a.csv"));
    ASSERT_EQ(lchown(file("shared/a.csv").c_str(), 1001, 1001), 0);
    GrowingFile refused;
    EXPECT_NE(refused.open(file("shared/a.csv"), true).find("link of another user in a shared folder"),
              std::string::npos);
    EXPECT_EQ(text("victim.csv"), "precious\n");
    ASSERT_EQ(lchown(file("shared/a.csv").c_str(), 0, 0), 0);
    GrowingFile own;
    EXPECT_EQ(own.open(file("shared/a.csv"), true), "");
    own.discard();
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
