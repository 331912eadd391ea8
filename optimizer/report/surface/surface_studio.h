/* The file for the eye of a studio picture. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_STUDIO_H
#define SELVEDGE_OPTIMIZER_SURFACE_STUDIO_H

#include "optimizer/report/surface/surface_filter.h"

/* Writes pictures/on-<number>.png of the picture so far of the cloth alone: filtered, with the ground, by the tone
 * curve, a flat cloth with a scale bar. *filtered: whether it could be filtered. STATUS_NO_MEMORY, STATUS_IO,
 * STATUS_DISK_FULL. */
status surface_studio_write(struct report *report, size_t i, const struct surface_filter *filter,
                            const struct surface_ground *ground, const struct surface_passes *so_far, double exposure,
                            struct error *err);

#endif
