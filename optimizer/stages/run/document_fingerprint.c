#include "optimizer/stages/run/document_fingerprint.h"
#include "base/files/durable.h"

#include <stdlib.h>
#include <zlib.h>

enum { PROGRAM_MAX_BYTES = 256 << 20 };

/* Checksum of the running program, because another build may trace other numbers, which must not be mixed with the
 * numbers of an earlier run. 0 where the system does not show the program. */
static uint32_t program_sum(void)
{
    char *text = NULL;
    size_t n = 0;
    if (file_read_all("/proc/self/exe", PROGRAM_MAX_BYTES, &text, &n, NULL) != STATUS_OK) return 0;
    uint32_t sum = (uint32_t)crc32_z(0, (const void *)text, n);
    free(text);
    return sum;
}

uint64_t document_fingerprint(const char *document, size_t n_bytes)
{
    return crc32_z(program_sum(), (const void *)document, n_bytes);
}
