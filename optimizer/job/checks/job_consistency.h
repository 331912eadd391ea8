/* Consistency checks of a job document: each value is allowed, and still they are wrong together. Angles are in
 * radians, or a file is of another kind than its option asks for. */
#ifndef SELVEDGE_OPTIMIZER_JOB_CONSISTENCY_H
#define SELVEDGE_OPTIMIZER_JOB_CONSISTENCY_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

struct job_sections;

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

/* Calls `found` for every inconsistency of the document, in its order, with STATUS_INVALID and a filled error. */
void job_consistency_check(const struct job_sections *section, void (*found)(void *context, const struct error *fault),
                           void *context);

#endif
