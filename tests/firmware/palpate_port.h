/* SPDX-License-Identifier: Apache-2.0 */
/* Locks of the tests: each test program supplies the two functions. */
#ifndef PALPATE_PORT_H
#define PALPATE_PORT_H

#ifdef __cplusplus
extern "C" {
#endif

void test_lock(void);
void test_unlock(void);

#ifdef __cplusplus
}
#endif

#define PALPATE_LOCK() test_lock()
#define PALPATE_UNLOCK() test_unlock()

#endif
