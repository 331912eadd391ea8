#include "optimizer/photographs/profile/fiber_profile.h"
#include "base/angle.h"
#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/job/checks/job_consistency.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/photographs/rows/number_table.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum column {
    COLUMN_THETA_O,
    COLUMN_PHI,
    COLUMN_N_REQUIRED,
    COLUMN_THETA_I = COLUMN_N_REQUIRED,
    COLUMN_PHI_I,
    COLUMN_GREY,
    COLUMN_R,
    COLUMN_GREY_SE = COLUMN_R + 3,
    COLUMN_R_SE
};

static const char *const column_name[] = {
    "theta_o_deg", "phi_deg",     "theta_i_deg",   "phi_i_deg",     "radiance",      "radiance_r", "radiance_g",
    "radiance_b",  "radiance_se", "radiance_r_se", "radiance_g_se", "radiance_b_se", NULL};

enum { MAX_TABLE_BYTES = 16 << 20 };
static const double most_theta_deg = 89.9, most_phi_deg = 360.0, most_radiance = 1e12, least_brightest = 1e-12,
                    most_negative = 5.0; /* standard errors */

struct reader {
    struct fiber_profile *profile;
    double theta_i_deg;
    size_t n_space;
    struct angle_span span; /* of the angles in the table */
    double brightest;
};

static status missing_column(const struct number_table *t, size_t column, const char *besides, struct error *err)
{
    return number_table_error(t, STATUS_FORMAT, "column '%s' is missing%s", t->file, t->line, column_name[column],
                              besides);
}

static status both_given(const struct number_table *t, const char *first, const char *second, struct error *err)
{
    return number_table_error(t, STATUS_FORMAT, "column '%s' is given, and so is %s: one of them counts", t->file,
                              t->line, first, second);
}

/* Which columns the table has: one radiance or three, standard errors of all or of none. */
static status check_header(void *context, struct number_table *t, struct error *err)
{
    struct reader *r = context;
    bool grey = number_table_has(t, COLUMN_GREY), colored = false, stated = !isnan(r->theta_i_deg);
    for (size_t c = 0; c < 3; c++)
        colored = colored || number_table_has(t, COLUMN_R + c) || number_table_has(t, COLUMN_R_SE + c);
    if (grey && colored) return both_given(t, "radiance", "one of a single channel", err);
    if (!grey && !colored)
        return missing_column(t, COLUMN_GREY, " (or 'radiance_r', 'radiance_g' and 'radiance_b')", err);
    if (!stated && !number_table_has(t, COLUMN_THETA_I))
        return missing_column(t, COLUMN_THETA_I, ", and the job states no angle of the light for all rows", err);
    if (stated && number_table_has(t, COLUMN_THETA_I)) return both_given(t, "theta_i_deg", "the job's", err);
    r->profile->n_channel = grey ? 1 : 3;
    r->profile->has_phi_i = number_table_has(t, COLUMN_PHI_I);
    const size_t first = grey ? COLUMN_GREY : COLUMN_R, first_se = grey ? COLUMN_GREY_SE : COLUMN_R_SE;
    size_t n_se = 0;
    for (size_t c = 0; c < r->profile->n_channel; c++) {
        if (!number_table_has(t, first + c)) return missing_column(t, first + c, "", err);
        n_se += number_table_has(t, first_se + c);
    }
    if (colored && number_table_has(t, COLUMN_GREY_SE)) return both_given(t, "radiance_se", "radiance_r", err);
    for (size_t c = 0; c < r->profile->n_channel && n_se > 0; c++)
        if (!number_table_has(t, first_se + c)) return missing_column(t, first_se + c, "", err);
    r->profile->has_se = n_se > 0;
    return STATUS_OK;
}

static status append(struct reader *r, const struct profile_row *row, struct error *err)
{
    struct fiber_profile *p = r->profile;
    if (p->n == r->n_space) {
        size_t n_space = r->n_space == 0 ? 1024 : 2 * r->n_space;
        struct profile_row *more = realloc(p->row, n_space * sizeof *more);
        if (more == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read a profile: out of memory");
        p->row = more;
        r->n_space = n_space;
    }
    p->row[p->n++] = *row;
    return STATUS_OK;
}

static status read_radiance(struct reader *r, const struct number_table *t, struct profile_row *row, struct error *err)
{
    const size_t first = r->profile->n_channel == 1 ? COLUMN_GREY : COLUMN_R,
                 first_se = r->profile->n_channel == 1 ? COLUMN_GREY_SE : COLUMN_R_SE;
    status s = STATUS_OK;
    for (size_t c = 0; c < r->profile->n_channel && s == STATUS_OK; c++) {
        s = number_table_not_negative(t, first_se + c, 0.0, most_radiance, &row->se[c], err);
        if (s == STATUS_OK) s = number_table_number(t, first + c, 0.0, &row->radiance[c], err);
        if (s == STATUS_OK && !(row->radiance[c] >= -most_negative * row->se[c] && row->radiance[c] <= most_radiance))
            s = number_table_not_negative(t, first + c, 0.0, most_radiance, &row->radiance[c], err);
        if (s == STATUS_OK && r->profile->has_se && !(row->se[c] > 0.0))
            s = number_table_error(t, STATUS_INVALID, "column '%s' is 0: a standard error must be above it", t->file,
                                   t->line, column_name[first_se + c]);
        r->brightest = fmax(r->brightest, row->radiance[c]);
    }
    return s;
}

static status read_row(void *context, struct number_table *t, struct error *err)
{
    struct reader *r = context;
    struct profile_row row = {.theta_i_rad = 0.0};
    double theta_i = r->theta_i_deg, theta_o, phi, phi_i = 0.0;
    r->profile->last_line = t->line;
    if (r->profile->n >= PROFILE_MAX_ROW)
        return number_table_error(t, STATUS_TOO_LARGE, "more than %d rows", t->file, t->line, PROFILE_MAX_ROW);
    status s = number_table_angle(t, COLUMN_THETA_O, -most_theta_deg, most_theta_deg, &theta_o, err);
    if (s == STATUS_OK) s = number_table_angle(t, COLUMN_PHI, -most_phi_deg, most_phi_deg, &phi, err);
    if (s == STATUS_OK && number_table_has(t, COLUMN_THETA_I))
        s = number_table_angle(t, COLUMN_THETA_I, -most_theta_deg, most_theta_deg, &theta_i, err);
    if (s == STATUS_OK && r->profile->has_phi_i)
        s = number_table_angle(t, COLUMN_PHI_I, -most_phi_deg, most_phi_deg, &phi_i, err);
    if (s == STATUS_OK) s = read_radiance(r, t, &row, err);
    if (s != STATUS_OK) return s;
    angle_span_add(&r->span, number_table_has(t, COLUMN_THETA_I) ? theta_i : 0.0, phi_i, theta_o, phi, 0.0);
    row.theta_i_rad = theta_i * RAD_PER_DEG;
    row.theta_o_rad = theta_o * RAD_PER_DEG;
    row.phi_rad = phi * RAD_PER_DEG;
    row.phi_i_rad = phi_i * RAD_PER_DEG;
    return append(r, &row, err);
}

static status check_whole(const struct reader *r, const struct number_table *t, struct error *err)
{
    if (r->profile->n == 0) return number_table_error(t, STATUS_INVALID, "the table has no row", t->file, t->line);
    if (angle_span_in_radians(&r->span))
        return number_table_error(
            t, STATUS_INVALID,
            "up to this line the angles of the columns '%s' and '%s' look like radians: the largest "
            "are %.3g and %.3g; write degrees",
            t->file, t->line, column_name[COLUMN_THETA_O], column_name[COLUMN_PHI], r->span.theta, r->span.phi);
    if (!(r->brightest >= least_brightest))
        return number_table_error(t, STATUS_INVALID,
                                  "up to this line the largest '%s' is %g: it must be at least %g; choose another unit",
                                  t->file, t->line, column_name[r->profile->n_channel == 1 ? COLUMN_GREY : COLUMN_R],
                                  r->brightest, least_brightest);
    return STATUS_OK;
}

status fiber_profile_parse(struct fiber_profile *profile, const char *text, size_t n_bytes, const char *name,
                           double theta_i_deg, struct error *err)
{
    struct number_table t = {
        .file = name, .option = OPTION_PROFILE_FILE, .column_name = column_name, .n_required = COLUMN_N_REQUIRED};
    struct reader r = {.profile = profile, .theta_i_deg = theta_i_deg};
    *profile = (struct fiber_profile){0};
    status s = number_table_read(&t, text, n_bytes, check_header, read_row, &r, err);
    if (s == STATUS_OK) s = check_whole(&r, &t, err);
    if (s != STATUS_OK) fiber_profile_release(profile);
    return s;
}

status fiber_profile_load(struct fiber_profile *profile, const struct job_profile *asked, const char *folder,
                          struct error *err)
{
    char path[4096], *text = NULL;
    size_t n = 0;
    *profile = (struct fiber_profile){0};
    snprintf(path, sizeof path, "%s/%s", folder, asked->file);
    status s = file_read_all(path, MAX_TABLE_BYTES, &text, &n, err);
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_PROFILE_FILE);
    if (s == STATUS_OK) s = fiber_profile_parse(profile, text, n, asked->file, asked->theta_i_deg, err);
    free(text);
    if (s != STATUS_OK || isnan(asked->turn_deg) || profile->has_phi_i) return s;
    fiber_profile_release(profile);
    return error_set_field(err, STATUS_INVALID, OPTION_PROFILE_TURN,
                           "the turn of the section is given, but table '%s' has no column '%s' that it is counted in",
                           asked->file, column_name[COLUMN_PHI_I]);
}

void fiber_profile_print(const struct fiber_profile *profile, FILE *out)
{
    static const char *const channel[] = {"_r", "_g", "_b"};
    fprintf(out, "theta_i_deg,%stheta_o_deg,phi_deg", profile->has_phi_i ? "phi_i_deg," : "");
    for (size_t c = 0; c < profile->n_channel; c++) {
        const char *name = profile->n_channel == 1 ? "" : channel[c];
        fprintf(out, profile->has_se ? ",radiance%s,radiance%s_se" : ",radiance%s", name, name);
    }
    fputs("\n", out);
    for (size_t i = 0; i < profile->n; i++) {
        const struct profile_row *row = &profile->row[i];
        fprintf(out, "%.6g,", angle_to_deg(row->theta_i_rad));
        if (profile->has_phi_i) fprintf(out, "%.6g,", angle_to_deg(row->phi_i_rad));
        fprintf(out, "%.6g,%.6g", angle_to_deg(row->theta_o_rad), angle_to_deg(row->phi_rad));
        for (size_t c = 0; c < profile->n_channel; c++) {
            fprintf(out, ",%.7g", row->radiance[c]);
            if (profile->has_se) fprintf(out, ",%.4g", row->se[c]);
        }
        fputs("\n", out);
    }
}

void fiber_profile_release(struct fiber_profile *profile)
{
    free(profile->row);
    profile->row = NULL;
    profile->n = 0;
}
