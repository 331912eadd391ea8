/* Slips of a job document that are allowed values and still wrong: angles in radians, files of another kind than the
 * option asks for. */
#ifndef SELVEDGE_OPTIMIZER_JOB_SLIPS_H
#define SELVEDGE_OPTIMIZER_JOB_SLIPS_H

#include "optimizer/job/document/job_document.h"

/* Largest angle from the normal and around it that a set of views in radians can have. */
#define JOB_RADIANS_THETA 3.2
#define JOB_RADIANS_PHI 6.3

/* The angles of several views: whether they look like radians where degrees are asked for. All angles are then below
 * those above, and one from the normal is at least 0.2: a set of two or more views in degrees has none so small. */
struct angle_span {
    size_t n_view;
    double theta, phi; /* largest magnitudes */
};
void angle_span_add(struct angle_span *span, double light_theta, double light_phi, double camera_theta,
                    double camera_phi, double rotation);
bool angle_span_in_radians(const struct angle_span *span);

/* Calls `found` with the status STATUS_INVALID and a filled error for every slip of the document, in its order. */
void job_find_slips(const struct job_document *doc, void (*found)(void *context, const struct error *slip),
                    void *context);

#endif
