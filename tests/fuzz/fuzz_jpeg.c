/* JPEG photographs. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/photograph.h"
#include "tests/fuzz/fuzz_input.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct job_photograph p = photograph_plain(size % 2 == 1 ? JOB_TRANSFER_SRGB : JOB_TRANSFER_LINEAR);
    struct photograph_mean mean;
    struct error err = {0};
    if (size < 16) return 0;
    fuzz_check_error(photograph_measure(fuzz_file_as(".jpg", data, size), &p, &mean, &err), &err);
    return 0;
}
