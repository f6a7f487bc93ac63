// SPDX-License-Identifier: Apache-2.0
#pragma once

// Large functions are defined in separate headers. A program of one file includes them and does nothing else. A
// program of several files defines PALPATE_COMPILED and compiles the files of cpp/compiled, so that each of these
// functions is compiled once.
#ifdef PALPATE_COMPILED
#define PALPATE_INLINE
#else
#define PALPATE_INLINE inline
#endif
