/* The shape and samples of a scan file: as its user declares them, and as its reader finds them. */
#ifndef SELVEDGE_GEOMETRY_VOLUME_INFO_H
#define SELVEDGE_GEOMETRY_VOLUME_INFO_H

#include "base/files/file_ledger.h"

#include <stdbool.h>
#include <stddef.h>

/* The content of a file without a header. n[0] == 0: nothing is declared, and the file has a header. */
struct volume_raw_declaration {
    size_t n[3];  /* columns, rows, slices; x runs fastest */
    char type[8]; /* "uint8", "int8", "uint16", "int16", "uint32", "int32", "float32", "float64" */
    bool big_endian;
    size_t header_bytes; /* bytes to skip at the start of the file */
};

struct volume_source_info {
    size_t n[3];               /* columns, rows, slices */
    double voxel_size_m[3];    /* NaN where the file does not state it */
    const char *sample;        /* "uint8", "uint16", "int16", "float32" */
    struct file_ledger ledger; /* every statement of the file beside its samples */
};

#endif
