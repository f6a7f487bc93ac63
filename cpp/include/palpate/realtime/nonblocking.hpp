// SPDX-License-Identifier: Apache-2.0
#pragma once

// Marks a function of the real-time path. The real-time sanitizer of clang ends the program if such a function
// allocates, locks or makes a system call; in other builds the mark is empty.
#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#define PALPATE_NONBLOCKING [[clang::nonblocking]]
#endif
#endif
#ifndef PALPATE_NONBLOCKING
#define PALPATE_NONBLOCKING
#endif
