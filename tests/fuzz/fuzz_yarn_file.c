#include "geometry/phantom/phantom.h"
#include "tests/fuzz/fuzz_input.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct phantom_yarn_law yarn;
    struct error err = {0};
    fuzz_check_error(phantom_yarn_read(fuzz_file(data, size), &yarn, &err), &err);
    return 0;
}
