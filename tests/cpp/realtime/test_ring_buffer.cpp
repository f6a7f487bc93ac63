// SPDX-License-Identifier: Apache-2.0
#include "palpate/realtime/ring_buffer.hpp"

#include <cstdint>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace palpate {
namespace {

TEST(RingBuffer, ReturnsElementsInOrder) {
    RingBuffer<int> ring{4};
    std::vector<int> out(10);
    for (int round = 0; round < 5; ++round) {
        EXPECT_TRUE(ring.push(2 * round));
        EXPECT_TRUE(ring.push(2 * round + 1));
        ASSERT_EQ(ring.pop(out), 2U);
        EXPECT_EQ(out[0], 2 * round);
        EXPECT_EQ(out[1], 2 * round + 1);
    }
    EXPECT_EQ(ring.pop(out), 0U);
}

TEST(RingBuffer, RefusesElementsWhenFullAndKeepsThoseItAccepted) {
    RingBuffer<int> ring{4};
    for (int k = 0; k < 4; ++k) {
        EXPECT_TRUE(ring.push(k));
    }
    EXPECT_FALSE(ring.push(4));
    std::vector<int> out(3);
    EXPECT_EQ(ring.pop(out), 3U);
    EXPECT_EQ(out, (std::vector<int>{0, 1, 2}));
    EXPECT_EQ(ring.pop(out), 1U);
    EXPECT_EQ(out[0], 3);
}

/// A record of two numbers, the second with all bits of the first inverted: the test detects a record that is read
/// while only one number is written.
struct Pair {
    std::uint64_t value = 0;
    std::uint64_t inverse = ~std::uint64_t{0};
};

TEST(RingBuffer, PassesCompleteElementsBetweenTwoThreads) {
    const auto total = static_cast<std::uint64_t>(test::cases(100'000));
    RingBuffer<Pair> ring{64};
    std::thread writer{[&] {
        for (std::uint64_t k = 0; k < total;) {
            if (ring.push({k, ~k})) {
                ++k;
            } else {
                std::this_thread::yield();
            }
        }
    }};
    std::vector<Pair> out(50);
    std::uint64_t next = 0;
    bool whole = true;
    while (next < total) {
        const std::size_t count = ring.pop(out);
        for (std::size_t k = 0; k < count; ++k, ++next) {
            whole = whole && out[k].value == next && out[k].inverse == ~next;
        }
        if (count == 0) {
            std::this_thread::yield();
        }
    }
    writer.join();
    EXPECT_TRUE(whole);
}

}  // namespace
}  // namespace palpate
