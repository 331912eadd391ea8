/* Measured BRDFs of the MERL database. Files have one length only, 35 MB: every input is tried as it is, and those
 * of 32 bytes and more also repeated after a right header up to that length. */
#include "tests/fuzz/brdf/fuzz_brdf.h"

#include <string.h>

enum { SAMPLES = 3 * 90 * 90 * 180 };
static uint8_t whole[12 + 8 * SAMPLES];

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const int32_t edge[3] = {90, 90, 180};
    fuzz_brdf(&merl_brdf_reader, fuzz_file_as(".binary", data, size), JOB_SYMMETRY_FILE);
    if (size < 32) return 0;
    memcpy(whole, edge, sizeof edge);
    for (size_t at = sizeof edge; at < sizeof whole; at += size)
        memcpy(whole + at, data, at + size <= sizeof whole ? size : sizeof whole - at);
    fuzz_brdf(&merl_brdf_reader, fuzz_file_as(".binary", whole, sizeof whole), JOB_SYMMETRY_FILE);
    return 0;
}
