#include "geometry/weave/weave_wif.h"
#include "tests/fuzz/fuzz_input.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct weave_wif w;
    struct file_ledger ledger = {0};
    struct error err = {0};
    fuzz_check_error(weave_wif_read(fuzz_file(data, size), &w, &ledger, &err), &err);
    return 0;
}
