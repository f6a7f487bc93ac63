// SPDX-License-Identifier: Apache-2.0
#include "locks.hpp"

#include <mutex>

#include "palpate_port.h"

namespace palpate::test {
namespace {

std::mutex mutex;
thread_local int depth = 0;

}  // namespace

int lock_depth() {
    return depth;
}

}  // namespace palpate::test

void test_lock(void) {
    palpate::test::mutex.lock();
    ++palpate::test::depth;
}

void test_unlock(void) {
    --palpate::test::depth;
    palpate::test::mutex.unlock();
}
