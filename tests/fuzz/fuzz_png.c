/* Corrects the checksums of chunks first, so that mutated input is not refused for them. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/photograph.h"
#include "tests/fuzz/fuzz_input.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

static void correct_checksums(uint8_t *png, size_t size)
{
    size_t at = 8;
    while (size >= 12 && at <= size - 12) {
        size_t n = (size_t)png[at] << 24 | (size_t)png[at + 1] << 16 | (size_t)png[at + 2] << 8 | png[at + 3];
        if (n > size - 12 - at) return;
        uLong crc = crc32(0, png + at + 4, (uInt)n + 4);
        for (size_t i = 0; i < 4; i++) png[at + 8 + n + i] = (uint8_t)(crc >> (24 - 8 * i));
        at += 12 + n;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const uint8_t magic[4] = {0x89, 'P', 'N', 'G'};
    const struct job_photograph p = photograph_plain(size % 2 == 1 ? JOB_TRANSFER_SRGB : JOB_TRANSFER_LINEAR);
    struct photograph_mean mean;
    struct error err = {0};
    if (size < 8 || memcmp(data, magic, 4) != 0) return 0;
    uint8_t *png = malloc(size);
    if (png == NULL) abort();
    memcpy(png, data, size);
    correct_checksums(png, size);
    fuzz_check_error(photograph_measure(fuzz_file_as(".png", png, size), &p, &mean, &err), &err);
    free(png);
    return 0;
}
