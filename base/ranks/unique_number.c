#include "base/ranks/unique_number.h"

#include <stdatomic.h>

uint64_t unique_number(void)
{
    static atomic_uint_fast64_t last;
    return atomic_fetch_add(&last, 1) + 1;
}
