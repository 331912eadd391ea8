/* The types of samples in scan files: their names, their sizes, and their conversion to float. */
#ifndef SELVEDGE_GEOMETRY_SAMPLE_TYPE_H
#define SELVEDGE_GEOMETRY_SAMPLE_TYPE_H

#include <stdbool.h>
#include <stddef.h>

enum sample_type {
    SAMPLE_UINT8,
    SAMPLE_INT8,
    SAMPLE_UINT16,
    SAMPLE_INT16,
    SAMPLE_UINT32,
    SAMPLE_INT32,
    SAMPLE_FLOAT32,
    SAMPLE_FLOAT64,
    SAMPLE_COUNT
};

/* Bytes of one sample. */
size_t sample_bytes(enum sample_type t);
/* "uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64". */
const char *sample_name(enum sample_type t);
/* Converts n samples of type t at data, which need not be aligned, to value[n]. swap: they have the byte order
 * opposite to the machine's; their bytes are then reversed in place. */
void sample_to_float(enum sample_type t, bool swap, size_t n, void *data, float *value);

#endif
