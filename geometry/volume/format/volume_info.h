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

/* The part of a scan that has several channels or times. Both count from 1; 0: the document does not say. */
struct volume_part {
    size_t channel, time;
    char dataset[128]; /* name of the data set, in formats that have several; "": the document does not say */
};

struct volume_source_info {
    size_t n[3];            /* columns, rows, slices */
    double voxel_size_m[3]; /* NaN where the file does not state it */
    /* The voxel size is one that programs also write without a meaning, as a resolution for prints or one pixel per
     * unit: the document's replaces it. */
    bool is_weak_size;
    char axes[8];              /* directions of the file's axes, as option OPTION_AXES; "": not stated, or oblique */
    bool is_oblique;           /* the file's axes are no turn and no mirror image of the axes of space */
    double oblique[9];         /* the matrix that then straightens them, as option OPTION_MATRIX */
    double padding;            /* value of voxels without a measurement; NaN: not stated */
    const char *sample;        /* "uint8", "uint16", "int16", "float32" */
    struct file_ledger ledger; /* every statement of the file beside its samples */
};

/* Returns an info that states nothing yet. */
static inline struct volume_source_info volume_source_info_empty(void)
{
    const double unknown = __builtin_nan("");
    return (struct volume_source_info){.voxel_size_m = {unknown, unknown, unknown}, .padding = unknown};
}

#endif
