#include "tests/support/cloth/make_phantom.h"

#include "base/thread_pool.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

void make_phantom(const struct phantom_option *o, size_t n_thread, struct fiber_set *f, struct phantom_report *r)
{
    struct thread_pool *pool = NULL;
    struct error err = {0};
    if (n_thread > 0) assert_int_equal(thread_pool_new(n_thread, &pool, NULL), STATUS_OK);
    fiber_set_init(f);
    if (phantom_generate(o, pool, NULL, f, r, &err) != STATUS_OK) fail_msg("%s", err.text);
    thread_pool_free(pool);
}
