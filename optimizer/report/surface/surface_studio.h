/* The file for the eye of a studio picture. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_STUDIO_H
#define SELVEDGE_OPTIMIZER_SURFACE_STUDIO_H

#include "optimizer/report/surface/surface_filter.h"

struct surface_shown {
    double exposure;
    double error; /* of a pixel after the filter, as of joint_filter; NaN: it was not filtered */
};

/* Writes pictures/on-<number>.png of the picture so far of the cloth alone: filtered where it can be, with the ground,
 * by the tone curve, a flat cloth with a scale bar. Sets how->error. STATUS_NO_MEMORY, STATUS_IO, STATUS_DISK_FULL. */
status surface_studio_write(struct report *report, size_t i, const struct surface_filter *filter,
                            const struct surface_ground *ground, const struct surface_passes *so_far,
                            struct surface_shown *how, struct error *err);
/* What the entry of a studio picture says besides; its noise is what the filter leaves. */
void surface_studio_put(json_t *entry, const struct job_surface_picture *p, const struct surface_filter *filter,
                        const struct surface_shown *how);

#endif
