/* Helpers of the fuzz harnesses: bytes as a file in memory, and a scan read through one reader. */
#ifndef SELVEDGE_TESTS_FUZZ_INPUT_H
#define SELVEDGE_TESTS_FUZZ_INPUT_H

#include "geometry/volume/format/volume_reader.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Returns the path of an anonymous file with these bytes, which the next call replaces. */
const char *fuzz_file(const uint8_t *data, size_t size);
/* The same under a path that ends in suffix (at most 8 characters, the same in every call of a process). */
const char *fuzz_file_as(const char *suffix, const uint8_t *data, size_t size);
/* Opens a file with the reader and reads up to 64 slices of at most 4 million voxels in order, then the first one
 * again. An error without a text aborts. */
void fuzz_volume(const volume_reader *reader, const uint8_t *data, size_t size);
/* The same for a scan that is already open; closes it. */
void fuzz_read_slices(const volume_reader *reader, void *handle, const struct volume_source_info *info);
/* Aborts if s and err contradict each other. */
void fuzz_check_error(status s, const struct error *err);

#endif
