#include "geometry/volume/format/sample_type.h"

#include <stdint.h>
#include <string.h>

static const struct {
    const char *name;
    size_t n_byte;
} sample[SAMPLE_COUNT] = {
    [SAMPLE_UINT8] = {"uint8", 1},     [SAMPLE_INT8] = {"int8", 1},       [SAMPLE_UINT16] = {"uint16", 2},
    [SAMPLE_INT16] = {"int16", 2},     [SAMPLE_UINT32] = {"uint32", 4},   [SAMPLE_INT32] = {"int32", 4},
    [SAMPLE_FLOAT32] = {"float32", 4}, [SAMPLE_FLOAT64] = {"float64", 8},
};

size_t sample_bytes(enum sample_type t) { return sample[t].n_byte; }
const char *sample_name(enum sample_type t) { return sample[t].name; }

static void swap_bytes(size_t n_byte, size_t n, uint8_t *data)
{
    for (size_t i = 0; i < n; i++, data += n_byte)
        for (size_t b = 0; b < n_byte / 2; b++) {
            uint8_t t = data[b];
            data[b] = data[n_byte - 1 - b];
            data[n_byte - 1 - b] = t;
        }
}

#define CONVERT(type)                                                                                                  \
    for (size_t i = 0; i < n; i++) {                                                                                   \
        type x;                                                                                                        \
        memcpy(&x, (const uint8_t *)data + i * sizeof x, sizeof x);                                                    \
        value[i] = (float)x;                                                                                           \
    }                                                                                                                  \
    break

void sample_to_float(enum sample_type t, bool swap, size_t n, void *data, float *value)
{
    if (swap) swap_bytes(sample_bytes(t), n, data);
    switch (t) {
    case SAMPLE_UINT8:
        CONVERT(uint8_t);
    case SAMPLE_INT8:
        CONVERT(int8_t);
    case SAMPLE_UINT16:
        CONVERT(uint16_t);
    case SAMPLE_INT16:
        CONVERT(int16_t);
    case SAMPLE_UINT32:
        CONVERT(uint32_t);
    case SAMPLE_INT32:
        CONVERT(int32_t);
    case SAMPLE_FLOAT32:
        CONVERT(float);
    case SAMPLE_FLOAT64:
        CONVERT(double);
    case SAMPLE_COUNT:
        break;
    }
}
