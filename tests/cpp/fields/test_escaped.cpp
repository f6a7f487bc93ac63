// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gtest/gtest.h>

#include "palpate/fields/escaped.hpp"

namespace palpate {
namespace {

TEST(Escaped, VisibleTextOfAnyLanguageIsUnchanged) {
    for (const char* text : {"", "EMU-1", "Müller & Söhne", "новый № 7", "\xF0\x9D\x84\x9E", "a\\b"}) {
        EXPECT_EQ(escaped(text), text);
    }
}

TEST(Escaped, CharactersThatControlATerminalAreEscaped) {
    EXPECT_EQ(escaped("a\x1b[31mb\n"), "a\\x1b[31mb\\x0a");
    EXPECT_EQ(escaped(std::string("\0\x7F", 2)), "\\x00\\x7f");
    EXPECT_EQ(escaped("\xC2\x9B"), "\\x9b");  // control sequence introducer of one character
    EXPECT_EQ(escaped("\xE2\x80\xAE"
                      "gpj"),
              "\\u202egpj");  // right-to-left override
    EXPECT_EQ(escaped("a\xE2\x80\xA8"
                      "b"),
              "a\\u2028b");  // line separator
    EXPECT_EQ(escaped("\xEF\xBB\xBF\xEE\x80\x80"), "\\ufeff\\ue000");
    EXPECT_EQ(escaped("\xF3\xA0\x81\x81"), "\\U000e0041");  // invisible letter
}

TEST(Escaped, InvalidBytesAreEscapedOneByOne) {
    EXPECT_EQ(escaped("\x9B"
                      "1m"),
              "\\x9b1m");
    EXPECT_EQ(escaped("\xC0\x8A"), "\\xc0\\x8a");  // a line feed in two bytes
    EXPECT_EQ(escaped("\xE0\x80\x9B"), "\\xe0\\x80\\x9b");
    EXPECT_EQ(escaped("\xED\xA0\x80"), "\\xed\\xa0\\x80");           // half a pair of UTF-16
    EXPECT_EQ(escaped("\xF4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // above U+10FFFF
    EXPECT_EQ(escaped("\xC3"), "\\xc3");
    EXPECT_EQ(escaped("\xC3("), "\\xc3(");
    EXPECT_EQ(escaped("\xFF"), "\\xff");
}

}  // namespace
}  // namespace palpate
