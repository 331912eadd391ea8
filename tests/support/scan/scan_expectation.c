#include "tests/support/scan/scan_expectation.h"

#include "geometry/volume/format/volume_source.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include <cmocka.h>

size_t scan_join_header(uint8_t *out, const char *header, const void *data, size_t n_data)
{
    size_t n = strlen(header);
    memcpy(out, header, n);
    memcpy(out + n, data, n_data);
    return n + n_data;
}

size_t scan_gzip(const uint8_t *data, size_t n, uint8_t *out, size_t n_out)
{
    z_stream z = {0};
    assert_int_equal(deflateInit2(&z, 9, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
    z.next_in = (uint8_t *)(uintptr_t)data;
    z.avail_in = (uInt)n;
    z.next_out = out;
    z.avail_out = (uInt)n_out;
    assert_int_equal(deflate(&z, Z_FINISH), Z_STREAM_END);
    size_t used = z.total_out;
    deflateEnd(&z);
    return used;
}

void scan_expect_values(const char *const *path, size_t n_path, const struct volume_raw_declaration *raw,
                        const size_t n[3], const double spacing_mm[3], const float *want)
{
    struct volume_source *source;
    struct error err = {0};
    if (volume_source_open_declared(path, n_path, raw, NULL, &source, &err) != STATUS_OK) fail_msg("%s", err.text);
    const struct volume_source_info *info = volume_source_describe(source);
    size_t n_voxel = n[0] * n[1] * n[2], n_slice = n[0] * n[1];
    float *value = calloc(n_voxel, sizeof *value);
    for (int a = 0; a < 3; a++) {
        assert_int_equal(info->n[a], n[a]);
        if (spacing_mm[a] > 0.0)
            assert_true(fabs(info->voxel_size_m[a] - spacing_mm[a] * 1e-3) < 1e-12);
        else
            assert_true(isnan(info->voxel_size_m[a]));
    }
    for (int pass = 0; pass < 2; pass++) { /* first all slices at once, then single slices in reverse order */
        memset(value, 0, n_voxel * sizeof *value);
        for (size_t k = n[2]; k > 0 && pass == 1; k--)
            if (volume_source_read(source, k - 1, 1, value + (k - 1) * n_slice, &err) != STATUS_OK)
                fail_msg("%s", err.text);
        if (pass == 0 && volume_source_read(source, 0, n[2], value, &err) != STATUS_OK) fail_msg("%s", err.text);
        for (size_t i = 0; i < n_voxel; i++) assert_true(value[i] == want[i]);
    }
    free(value);
    volume_source_close(source);
}

void scan_expect_refused(const char *path, const struct volume_raw_declaration *raw, status code, const char *field,
                         const char *part)
{
    struct volume_source *source = NULL;
    struct error err = {0};
    status s = volume_source_open_declared(&path, 1, raw, NULL, &source, &err);
    float value[4096];
    if (s == STATUS_OK) { /* damage of compressed data is found only when it is read */
        const struct volume_source_info *info = volume_source_describe(source);
        for (size_t k = 0; k < info->n[2] && s == STATUS_OK && info->n[0] * info->n[1] <= 4096; k++)
            s = volume_source_read(source, k, 1, value, &err);
        volume_source_close(source);
    }
    if (s != code || strcmp(err.field, field) != 0 || strstr(err.text, part) == NULL)
        fail_msg("expected '%s', but got %s, field '%s': %s", part, status_name(s), err.field, err.text);
}
