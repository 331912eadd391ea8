#include "geometry/fibers/fiber_import.h"
#include "tests/fuzz/fuzz_input.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fiber_set f;
    struct error err = {0};
    fiber_set_init(&f);
    status s = fiber_import(&f, fuzz_file(data, size),
                            &(struct fiber_file_terms){.radius_m = size % 2 == 0 ? NAN : 1e-5}, &err);
    fuzz_check_error(s, &err);
    if (s == STATUS_OK) fiber_set_validate(&f, &err);
    fiber_set_release(&f);
    return 0;
}
