#include "geometry/fibers/seam/seam_warp.h"

#include <math.h>
#include <stdlib.h>

/* In mean radii of the ends at the seam: edge of the field's cells, widths of its Gaussians, reach of partners. */
static const double CELL_RADII = 3.0, REACH_RADII = 6.0, WIDTH_RADII[] = {24.0, 16.0, 12.0, 8.0};
enum { N_WIDTH = sizeof WIDTH_RADII / sizeof *WIDTH_RADII };
/* Distance in radii within which ends continue each other, for the decision whether a warp helps, and the share of the
 * ends that must do so in addition. */
static const double CONTINUED_RADII = 1.0, LEAST_GAIN = 0.02;
/* Least depth of the margin in radii, and over the largest offset: the turn of a fiber is at most
 * 1.5 / 2 / MARGIN_OFFSETS. */
static const double MARGIN_RADII = 24.0, MARGIN_OFFSETS = 12.0;

static double mean_radius(const struct seam_ends *s)
{
    double sum = 0.0;
    for (int side = 0; side < 2; side++)
        for (size_t i = 0; i < s->n[side]; i++) sum += s->end[side][i].radius;
    return sum / (double)(s->n[0] + s->n[1]);
}

static void height_range(const struct seam_ends *s, double z_m[2])
{
    z_m[0] = INFINITY;
    z_m[1] = -INFINITY;
    for (int side = 0; side < 2; side++)
        for (size_t i = 0; i < s->n[side]; i++) {
            z_m[0] = fmin(z_m[0], s->end[side][i].at[1]);
            z_m[1] = fmax(z_m[1], s->end[side][i].at[1]);
        }
}

static status fit_field(struct seam_ends *s, struct seam_field *field, double radius, struct error *err)
{
    struct seam_sample *sample = malloc((s->n[0] + 1) * sizeof *sample);
    status st = STATUS_OK;
    if (sample == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot match the seams: out of memory");
    for (int i = 0; i < N_WIDTH && st == STATUS_OK; i++) {
        size_t n = 0;
        st = seam_ends_match(s, SEAM_BY_SHAPE, REACH_RADII, field, err);
        for (size_t low = 0; low < s->n[0] && st == STATUS_OK; low++) {
            if (s->partner[low] == SIZE_MAX) continue;
            struct seam_sample *to = &sample[n++];
            seam_ends_offset(s, low, to->offset);
            for (int a = 0; a < 2; a++) to->at[a] = s->end[0][low].at[a];
        }
        if (st == STATUS_OK) st = seam_field_fit(field, sample, n, WIDTH_RADII[i] * radius, err);
    }
    free(sample);
    return st;
}

/* Number of pairs that continue each other after the field's offsets. */
static status count_continued(struct seam_ends *s, const struct seam_field *field, size_t *n, struct error *err)
{
    const status st = seam_ends_match(s, SEAM_BY_DISTANCE, CONTINUED_RADII, field, err);
    *n = s->n_pair;
    return st;
}

status seam_warp_find(struct seam_ends *s, struct seam_warp *w, struct error *err)
{
    double z_m[2], offset_m[2];
    size_t before = 0, after = 0;
    *w = (struct seam_warp){.axis = s->axis, .tile_m = s->f->tile_size_m[s->axis]};
    if (s->n[0] == 0 || s->n[1] == 0) return STATUS_OK;
    const double radius = mean_radius(s), period_m = s->f->tile_size_m[1 - s->axis];
    height_range(s, z_m);
    status st = seam_ends_common_offset(s, offset_m, err);
    if (st == STATUS_OK) st = seam_field_init(&w->field, period_m, z_m, CELL_RADII * radius, offset_m, err);
    if (st == STATUS_OK) st = fit_field(s, &w->field, radius, err);
    if (st == STATUS_OK) st = count_continued(s, NULL, &before, err);
    if (st == STATUS_OK) st = count_continued(s, &w->field, &after, err);
    const double gain = ((double)after - (double)before) / (double)(s->n[0] < s->n[1] ? s->n[0] : s->n[1]);
    if (st != STATUS_OK || gain < LEAST_GAIN) {
        seam_field_release(&w->field);
        return st;
    }
    w->margin_m = fmin(0.5 * w->tile_m, fmax(MARGIN_RADII * radius, MARGIN_OFFSETS * seam_field_largest(&w->field)));
    return STATUS_OK;
}

void seam_warp_release(struct seam_warp *w)
{
    if (w == NULL) return;
    seam_field_release(&w->field);
    *w = (struct seam_warp){0};
}

void seam_warp_move(const struct seam_warp *w, double p[3])
{
    if (w->field.offset == NULL) return;
    const bool low = p[w->axis] < 0.5 * w->tile_m;
    const double depth = fmax(0.0, low ? p[w->axis] : w->tile_m - p[w->axis]) / w->margin_m;
    if (depth >= 1.0) return;
    const double at[2] = {p[1 - w->axis], p[2]}, share = 0.5 * (1.0 - depth * depth * (3.0 - 2.0 * depth));
    double offset_m[2];
    seam_field_at(&w->field, at, offset_m);
    p[1 - w->axis] += low ? share * offset_m[0] : -share * offset_m[0];
    p[2] += low ? share * offset_m[1] : -share * offset_m[1];
}

double seam_warp_rms(const struct seam_warp *w)
{
    return w->field.offset != NULL ? 0.5 * seam_field_rms(&w->field) : 0.0;
}
