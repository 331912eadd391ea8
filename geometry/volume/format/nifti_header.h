/* The header of NIfTI-1 and NIfTI-2: 348 or 540 bytes in the byte order of the program that wrote them.
 * Source: nifti1.h and nifti2.h (nifti.nimh.nih.gov). */
#ifndef SELVEDGE_GEOMETRY_NIFTI_HEADER_H
#define SELVEDGE_GEOMETRY_NIFTI_HEADER_H

#include "geometry/volume/format/volume_header.h"

#include <stdint.h>

enum { NIFTI_1_BYTES = 348, NIFTI_2_BYTES = 540 };

struct nifti_header {
    bool is_single_file; /* header and voxels are in one file */
    bool has_extension;  /* further data follows the header */
    size_t header_bytes; /* NIFTI_1_BYTES or NIFTI_2_BYTES */
    bool swap;           /* the byte order is opposite to the machine's */
    size_t n;            /* dimensions, 1 .. 7 */
    size_t size[7];
    int datatype;
    double pixdim[8]; /* [0]: the sign of the third axis for the quaternion; [1 .. 3]: edges of a voxel */
    double vox_offset, scl_slope, scl_inter, cal_min, cal_max, slice_duration, toffset;
    int xyzt_units, intent_code, slice_code, qform_code, sform_code;
    double quatern[3], qoffset[3], srow[3][4];
    char descrip[81], aux_file[25], intent_name[17];
};

/* Reads the first n bytes of a file. h: for errors. STATUS_FORMAT: no NIfTI, also for Analyze 7.5, whose axes have no
 * directions; or a size that is not possible. */
status nifti_header_parse(const uint8_t *byte, size_t n, const struct volume_header *h, struct nifti_header *header,
                          struct error *err);
/* Whether a file begins like a header, in either byte order. */
bool nifti_header_begins(const uint8_t first_byte[16]);

/* Writes where the axes of the file point in space, x to the right, y to the front of the head and z up, each with the
 * length of an edge. Returns the name of the fields, "sform" or "qform"; NULL: the header states no directions. */
const char *nifti_header_directions(const struct nifti_header *header, double direction[3][3]);

#endif
