/* Checks of a reader of scans: it must return the right values, or the right error. */
#ifndef SELVEDGE_TESTS_SCAN_EXPECTATION_H
#define SELVEDGE_TESTS_SCAN_EXPECTATION_H

#include "geometry/volume/format/volume_reader.h"

#include <stddef.h>
#include <stdint.h>

/* Writes a header and then the data to out. Returns the number of bytes. */
size_t scan_join_header(uint8_t *out, const char *header, const void *data, size_t n_data);
/* Compresses data as a .gz file into out. Returns the number of bytes. */
size_t scan_gzip(const uint8_t *data, size_t n, uint8_t *out, size_t n_out);
/* Opens path[0..n_path) and fails the test unless shape, spacing (millimetres; 0: unknown) and values are as
 * expected. */
void scan_expect_values(const char *const *path, size_t n_path, const struct volume_raw_declaration *raw,
                        const size_t n[3], const double spacing_mm[3], const float *want);
/* Opening or reading the file must fail with this code and field, and a text that contains `part`. */
void scan_expect_refused(const char *path, const struct volume_raw_declaration *raw, status code, const char *field,
                         const char *part);

#endif
