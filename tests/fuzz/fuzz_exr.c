#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/photograph.h"
#include "tests/fuzz/fuzz_input.h"

#include <math.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const uint8_t magic[4] = {0x76, 0x2f, 0x31, 0x01};
    const struct job_photograph p = {.scale = 1.0, .black_level = NAN, .crop_px = {1, 1, 6, 6}};
    struct photograph_mean mean;
    struct error err = {0};
    if (size < 4 || memcmp(data, magic, 4) != 0) return 0; /* all other input is a PNG or invalid */
    fuzz_check_error(photograph_measure(fuzz_file_as(".exr", data, size), &p, &mean, &err), &err);
    return 0;
}
