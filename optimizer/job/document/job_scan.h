/* The sections "volume" and "geometry" of a job document: a scan of the cloth and how fibers are found in it.
 * Values that are not given are NaN. */
#ifndef SELVEDGE_OPTIMIZER_JOB_SCAN_H
#define SELVEDGE_OPTIMIZER_JOB_SCAN_H

#include "optimizer/job/document/job_limits.h"

#include <stdbool.h>
#include <stddef.h>

enum { JOB_MAX_VOLUME_FILE = 4096 };

struct job_scan {
    bool given; /* the job has a scan: its own, or the one of the job that geometry_job names */
    size_t n_file;
    char (*file)[JOB_MAX_NAME_BYTES];
    bool ignore_numbers; /* in the names of files */
    size_t raw_shape[3]; /* all 0: not given */
    char raw_type[8];
    bool raw_big_endian;
    size_t raw_header_bytes;
    size_t channel, time; /* of a scan that has several, from 1; 0: not given */
    char dataset[128];    /* "": not given */
    double voxel_size_um[3];
    char axes[8]; /* "": not given */
    double matrix[9];
    size_t crop_voxel[6];
    bool align, crop; /* true for "auto"; false where matrix or crop_voxel is given */
    double crop_keep;
    size_t tiles; /* blocks a side of the large tile; 1: none */
    bool join_seams, transfer_directions, three_subvolumes, unresolved_fibers, trial;
    int hollow_fibers;           /* 0, 1, or -1: decided from the scan */
    double fiber_diameter_voxel; /* NaN: measured */
    double density_low, density_high, filter_s, filter_t, filter_eps_d, filter_eps_j;
    size_t filter_h; /* 0: not given */
    double link_sigma_voxel, radius_um;
    size_t min_vertex;
    int radius_per_axis; /* 1: a radius for each axis class, 0: one for all, -1: the measurement decides */
    char geometry_job[JOB_MAX_ID_BYTES]; /* id of another job, whose geometry is taken over; "" when none is given */
};

#endif
