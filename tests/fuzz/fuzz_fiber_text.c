#include "geometry/fibers/fiber_set.h"
#include "tests/fuzz/fuzz_input.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fiber_set f;
    struct error err = {0};
    fiber_set_init(&f);
    status s = fiber_set_read_text(&f, fuzz_file(data, size), &err);
    fuzz_check_error(s, &err);
    if (s == STATUS_OK) fiber_set_validate(&f, &err);
    fiber_set_release(&f);
    return 0;
}
