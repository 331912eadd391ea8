/* One DICOM file of a scan: what its header states about its frames, which are not compressed.
 * Source: DICOM PS3.5 (data elements, transfer syntaxes) and PS3.3 (C.7.6, image plane and pixel). */
#ifndef SELVEDGE_GEOMETRY_DICOM_FILE_H
#define SELVEDGE_GEOMETRY_DICOM_FILE_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Numbers that a file does not state are NaN. */
struct dicom_file {
    char syntax[68], series[68], photometric[20], description[68];
    bool big, is_implicit; /* of the data set: byte order, no types of values */
    size_t columns, rows, n_frame, samples_per_pixel, bits_allocated, bits_stored, high_bit;
    bool is_signed;
    double spacing_mm[2]; /* between rows, between columns */
    double between_slices_mm, thickness_mm, slope, inter, padding, padding_limit, instance;
    double detector_mm[2], window_center, window_width; /* pixels of the detector; range of display */
    char modality[20];
    bool is_lossy, has_table, has_times; /* a table gives the values; the frames are times of one slice */
    double direction[6];                 /* in which columns, then rows, count up */
    double (*position)[3];               /* of each frame: millimetres */
    size_t n_position;
    long long pixel_offset; /* of the samples in the file; 0: none */
    uint64_t pixel_bytes;
};

/* Reads the header of the file at path. name: for errors. Release it in every case. STATUS_FORMAT: damaged, or frames
 * that are no densities; STATUS_UNSUPPORTED: a compressed transfer syntax; STATUS_IO, STATUS_NO_MEMORY. */
status dicom_file_read(struct dicom_file *f, const char *path, const char *name, struct error *err);
void dicom_file_release(struct dicom_file *f);
/* Whether the bytes at the start of the file, or those after its preamble, are DICOM's. */
bool dicom_file_begins(const uint8_t first_byte[16], const char *path);

#endif
