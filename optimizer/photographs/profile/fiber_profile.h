/* A measured profile of a single fiber: the radiance that leaves it, by the angles of light and view.
 *
 * The table (number_table.h) has the columns
 *   theta_o_deg   angle of the view from the normal plane of the fiber, -90..90
 *   phi_deg       azimuth of the view about the fiber, from the light's: 0 back to the light, 180 straight on
 *   radiance      any unit; or radiance_r, radiance_g, radiance_b for three channels
 *   theta_i_deg   angle of the light from the normal plane; not where the job states one angle for the whole table
 *   phi_i_deg     azimuth of the light about the fiber, in the sense of phi_deg, from any mark that turns with the
 *                 fiber; optional. The azimuth of the view from that mark is phi_i_deg + phi_deg
 *   radiance_se   standard error (also radiance_r_se ...); optional
 * as the goniometer of Yan et al. 2015 gives them: theta_i -40 degrees, theta_o 10 to 50 degrees in steps of 2, phi -20
 * to 200 in steps of 5. A view at theta_o = -theta_i sees the mirrored light. Angles here are radians.
 *
 * With phi_i_deg the table is the light of a section that is turned as it is, as the device of the fabric thesis gives
 * it by turning the fiber in its holder (section 4.7.3); without, the mean over all turns. */
#ifndef SELVEDGE_OPTIMIZER_FIBER_PROFILE_H
#define SELVEDGE_OPTIMIZER_FIBER_PROFILE_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

struct job_profile;

enum { PROFILE_MAX_ROW = 100000 };

struct profile_row {
    double theta_i_rad, theta_o_rad, phi_rad;
    double phi_i_rad;          /* 0 where the profile has none */
    double radiance[3], se[3]; /* se: 0 where the table states none */
};

struct fiber_profile {
    size_t n, n_channel; /* 1 or 3 */
    bool has_se, has_phi_i;
    size_t last_line; /* of the table, for errors */
    struct profile_row *row;
};

/* text: the table, NUL-terminated, n_bytes without the NUL; name: the table's name in errors. theta_i_deg: of the whole
 * table, or NaN. Errors: from number_table.h with the option OPTION_PROFILE_FILE: a column that is missing, or given
 * twice over (theta_i_deg in the table and in the job; radiance and radiance_r), angles out of range or in radians, a
 * radiance that is negative by more than five times its standard error, a standard error that is not above 0, no row,
 * or radiances that are all below 1e-12. STATUS_TOO_LARGE above PROFILE_MAX_ROW rows. */
status fiber_profile_parse(struct fiber_profile *profile, const char *text, size_t n_bytes, const char *name,
                           double theta_i_deg, struct error *err);
/* Reads the profile that a job document names from the folder of its files. Errors also of reading the file, and
 * STATUS_INVALID with the field OPTION_PROFILE_TURN for a stated turn of the section without the column phi_i_deg. */
status fiber_profile_load(struct fiber_profile *profile, const struct job_profile *asked, const char *folder,
                          struct error *err);
/* Writes the table, with the column theta_i_deg, and with phi_i_deg where the profile has it. */
void fiber_profile_print(const struct fiber_profile *profile, FILE *out);
void fiber_profile_release(struct fiber_profile *profile);

#endif
