/* The first six bytes are the declaration, and the rest is the file. */
#include "geometry/volume/format/raw_source.h"
#include "geometry/volume/format/sample_type.h"
#include "tests/fuzz/fuzz_input.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const volume_reader reader = {.id = "raw.v1", .read = raw_source_read, .close = raw_source_close};
    if (size < 6) return 0;
    struct volume_raw_declaration raw = {
        .n = {data[0], data[1], data[2]}, .big_endian = (data[3] & 1) != 0, .header_bytes = data[5]};
    snprintf(raw.type, sizeof raw.type, "%s", data[4] < SAMPLE_COUNT ? sample_name(data[4]) : "bits");
    if (data[3] & 2) raw.header_bytes <<= 56;
    if (data[3] & 4) raw.n[data[4] % 3] <<= 52;
    const char *path = fuzz_file(data + 6, size - 6);
    struct volume_source_info info = {0};
    struct error err = {0};
    void *handle = NULL;
    status s = raw_source_open(&path, 1, &raw, &handle, &info, &err);
    fuzz_check_error(s, &err);
    if (s == STATUS_OK) fuzz_read_slices(&reader, handle, &info);
    return 0;
}
