/* A phantom for tests. */
#ifndef SELVEDGE_TESTS_MAKE_PHANTOM_H
#define SELVEDGE_TESTS_MAKE_PHANTOM_H

#include "geometry/phantom/phantom.h"

/* Makes the fibers f and the report r of the phantom o describes. n_thread 0: without a thread pool. Fails the test
 * when that fails. The caller releases f. */
void make_phantom(const struct phantom_option *o, size_t n_thread, struct fiber_set *f, struct phantom_report *r);

#endif
