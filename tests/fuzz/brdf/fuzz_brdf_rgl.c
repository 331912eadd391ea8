/* Measured BRDFs of RGL's format. */
#include "tests/fuzz/brdf/fuzz_brdf.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_brdf(&rgl_brdf_reader, fuzz_file_as(".bsdf", data, size), JOB_SYMMETRY_FILE);
    return 0;
}
