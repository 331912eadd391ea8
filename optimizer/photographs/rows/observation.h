/* Measurements: one mean rgb radiance with its standard error per configuration, from a table or from photographs.
 * Radiance unit: configuration.h (a perfect white diffuser facing the lamp has radiance 1). Ownership: init/release;
 * the array is malloc'ed and owned. */
#ifndef SELVEDGE_OPTIMIZER_OBSERVATION_H
#define SELVEDGE_OPTIMIZER_OBSERVATION_H

#include "base/status.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/photograph.h"
#include "renderer/scene/configuration.h"

#include <stdbool.h>

struct job_setup;

struct observation {
    char name[JOB_MAX_NAME_BYTES]; /* file name of the photograph, or "fit-03" for a row of a table */
    enum job_set set;
    struct configuration configuration;
    double mean_rgb[3];
    double se_rgb[3]; /* 0 when the source states none */
    double weight;    /* factor of the objective's weight of this observation; 1 */
    size_t n_cell;    /* parts along an edge of the crop, whose means make the contrast; 0: not measured */
    double contrast_rgb[3], contrast_se_rgb[3]; /* photograph_contrast.h */
    /* True: not a measurement, but a simpler model's expectation (expected_rows.h). Such rows weigh in a fit, and are
     * neither scored nor reported. left_out_rgb: their mean_rgb without the rows of each fold, 3 * FOLDS_MAX values, of
     * the maker; NULL for other rows. */
    bool expected;
    const double *left_out_rgb;
    struct job_column column;            /* of a cylinder; number 0: none */
    struct photograph_record photograph; /* how it was read; info.format is NULL for a row of a table */
};

struct observation_set {
    size_t n, capacity;
    struct observation *item;
};

void observation_set_init(struct observation_set *o);
void observation_set_release(struct observation_set *o);
status observation_set_append(struct observation_set *o, const struct observation *item, struct error *err);
size_t observation_set_count(const struct observation_set *o, enum job_set set);
/* Copies the observations of one set, in order, into `part` (initialised). */
status observation_set_select(const struct observation_set *o, enum job_set set, struct observation_set *part,
                              struct error *err);
/* Prepares a set for a fit: removes rows of weight 0, and divides the other weights by their mean, so that only their
 * ratios count. */
void observation_set_weigh(struct observation_set *o);

/* An observation of the contrast of a photograph, not of its mean radiance: mean_rgb and se_rgb hold the contrast and
 * its standard error, and estimates of its configuration are estimates of the contrast (contrast_blocks.h). */
bool observation_is_contrast(const struct observation *o);
/* Returns whether the row is a measured mean radiance: neither a contrast nor an expected row. */
bool observation_is_measured_mean(const struct observation *o);
/* Returns whether the contrast of all channels is known: its standard errors are below 1, which a black channel has
 * not. */
bool observation_contrast_known(const struct observation *o);
/* Makes that observation from one with n_cell > 0. weight: of contrasts beside means. */
struct observation observation_of_contrast(const struct observation *o, double weight);
/* Appends the contrasts of all observations of `from` to `to`. */
status observation_set_append_contrasts(const struct observation_set *from, double weight, struct observation_set *to,
                                        struct error *err);

/* Makes a configuration in SI units from angles and the document's set-up. */
struct configuration observation_configuration(const struct job_setup *setup, double light_theta_deg,
                                               double light_phi_deg, double camera_theta_deg, double camera_phi_deg,
                                               double cloth_rotation_deg);

#endif
