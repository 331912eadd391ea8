/* Files of goniometers in the style of ASTM E1392. */
#include "tests/fuzz/brdf/fuzz_brdf.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_brdf(&astm_brdf_reader, fuzz_file_as(".astm", data, size), (enum job_symmetry)(size % 3));
    return 0;
}
