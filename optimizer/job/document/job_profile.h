/* The section "profile" of a job document: light that a single fiber scatters, as a table or as photographs of a
 * bowl. */
#ifndef SELVEDGE_OPTIMIZER_JOB_PROFILE_H
#define SELVEDGE_OPTIMIZER_JOB_PROFILE_H

#include "optimizer/job/document/job_limits.h"

#include <stdbool.h>
#include <stddef.h>

struct job_bowl_photograph;

/* A place on the bowl of a single fiber, and where the photographs show it. */
struct job_bowl_mark {
    double at_mm[3], px[2];
};

/* A bowl into which a single fiber scatters (option_rows_profile.c). */
struct job_bowl {
    bool given, is_rgb;
    double radius_mm, height_mm, reflectance[3], fiber_mm[3]; /* height NaN: not given; see job_check_bowl */
    double focal_px, center_px[2];                            /* NaN: not given */
    double rim_deg, fiber_mask_mm, cell_deg;
    char mask[JOB_MAX_NAME_BYTES]; /* "": none */
    size_t n_mark, n_photograph;
    struct job_bowl_mark *mark;
    struct job_bowl_photograph *photograph;
};

struct job_profile {
    char file[JOB_MAX_NAME_BYTES]; /* "" for a job with a cloth or a bowl */
    double theta_i_deg, scale;     /* NaN: a column of the profile; fitted */
    double turn_deg;               /* of the section; NaN: fitted */
    char mode[8];                  /* "all", or the one that the profile shows */
    struct job_bowl bowl;          /* in place of file */
};

/* Whether the document has the section. */
bool job_profile_given(const struct job_profile *profile);
/* The file that messages name the profile by: its table, or the first photograph of the bowl. */
const char *job_profile_name(const struct job_profile *profile);
/* The mode that the profile shows alone; NULL: all of them. */
const char *job_profile_mode(const struct job_profile *profile);

#endif
