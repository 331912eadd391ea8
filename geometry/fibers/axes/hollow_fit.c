#include "geometry/fibers/axes/hollow_fit.h"

#include <stdlib.h>

enum { N_ROUND = 12 };
static const float START_AREA = 0.1f; /* a lumen of 0.32 of the width */
static const double START_DAMPING = 0.03;

static void start(const struct polyline_set *lines, struct fiber_section *section, float *area)
{
    fiber_sections_start(lines, section);
    for (size_t l = 0; l < lines->n_line; l++) {
        area[l] = START_AREA;
        for (size_t i = lines->first[l]; i < lines->first[l + 1]; i++) {
            float t[3];
            polyline_tangent(lines, l, i, 1, t);
            fiber_section_take_shape(&lines->shape[i], t, &section[i]);
        }
    }
}

status polylines_fit_hollow(struct polyline_set *lines, const struct hollow_fit *f, struct axis_profile *profile,
                            struct shape_measure *measure, struct error *err)
{
    status s = STATUS_OK;
    profile->section = malloc((lines->n_vertex + 1) * sizeof *profile->section);
    profile->lumen = malloc((lines->n_line + 1) * sizeof *profile->lumen);
    profile->measure = measure;
    profile->damping = START_DAMPING;
    if (profile->section == NULL || profile->lumen == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot fit the lumens of fibers: out of memory");
    else
        start(lines, profile->section, profile->lumen);
    if (s == STATUS_OK) s = polylines_fit(lines, f->v, f->diameter_voxel, N_ROUND, profile, f->pool, f->progress, err);
    if (s == STATUS_OK && measure->n_varying > 0) /* at the varied radii, as in flat_fit.c */
        s = polylines_fit(lines, f->v, f->diameter_voxel, 1, profile, f->pool, f->progress, err);
    free(profile->section);
    free(profile->lumen);
    profile->section = NULL;
    profile->lumen = NULL;
    profile->measure = NULL;
    return s;
}
