/* A phantom for tests: its fibers and what was made of the request. */
#ifndef SELVEDGE_TESTS_MAKE_PHANTOM_H
#define SELVEDGE_TESTS_MAKE_PHANTOM_H

#include "geometry/phantom/phantom.h"

/* n_thread: 0 for none. Fails the test when the phantom cannot be made; f is the caller's to release. */
void make_phantom(const struct phantom_option *o, size_t n_thread, struct fiber_set *f, struct phantom_report *r);

#endif
