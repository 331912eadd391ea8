#include "geometry/fibers/axes/flat_fit.h"
#include "geometry/fibers/lines/joining.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    N_WITHOUT = 5, /* rounds of the fit without suspects */
    LEAST_PIECE = 2
};
/* Distance of the axes over the sum of the radii below which the shorter line is a suspect. */
static const double SUSPECT = 1.0;
/* Share of the way from an axis to its outline within which another line is a part of the same fiber. */
static const float INSIDE = 0.85f;
/* In place of FIBER_RATIO_FLAT where fibers are thin and voxels interpolated: touching round fibers of 4 voxels come
 * out as 1.06 to 1.28 in the mean of a cloth, flat ones with ratios up to 2.5 as 1.30 to 1.47 (geometry/NOTES.md). */
static const double RATIO_FLAT_THIN = 1.3;
static const float BESIDE = 0.85f; /* cosine of the directions of lines beside each other */

/* Lines, the suspects among their vertices, and the lines without them. */
struct flat_work {
    struct polyline_set *lines, rest;
    struct fiber_section *section, *rest_section;
    bool *suspect;     /* after the decision: removed */
    size_t *origin;    /* vertex of the lines that one of rest comes from */
    uint32_t *line_of; /* line of each vertex */
    bool *covers;      /* lines whose section extends over a suspect */
};

static bool flat_work_init(struct flat_work *w, struct polyline_set *lines)
{
    const size_t n = lines->n_vertex + 1;
    *w = (struct flat_work){.lines = lines,
                            .section = malloc(n * sizeof *w->section),
                            .rest_section = malloc(n * sizeof *w->rest_section),
                            .suspect = malloc(n * sizeof *w->suspect),
                            .origin = malloc(n * sizeof *w->origin),
                            .line_of = malloc(n * sizeof *w->line_of),
                            .covers = calloc(lines->n_line + 1, sizeof *w->covers)};
    polyline_set_init(&w->rest);
    if (w->section == NULL || w->rest_section == NULL || w->suspect == NULL || w->origin == NULL ||
        w->line_of == NULL || w->covers == NULL)
        return false;
    for (size_t l = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l]; i < lines->first[l + 1]; i++) w->line_of[i] = (uint32_t)l;
    fiber_sections_start(lines, w->section);
    return true;
}

static void flat_work_release(struct flat_work *w)
{
    polyline_set_release(&w->rest);
    free(w->section);
    free(w->rest_section);
    free(w->suspect);
    free(w->origin);
    free(w->line_of);
    free(w->covers);
}

/* Mean ratio of the axes of each line, by length, and the standard deviation between lines. */
static void measure_ratio(const struct flat_work *w, struct section_ratio *ratio)
{
    double sum = 0.0, square = 0.0, length = 0.0;
    for (size_t l = 0; l < w->lines->n_line; l++) {
        double line = 0.0, n = (double)polyline_length(w->lines, l);
        for (size_t i = w->lines->first[l]; i < w->lines->first[l + 1]; i++)
            line += (double)fiber_section_ratio(&w->section[i]) / n;
        sum += n * line;
        square += n * line * line;
        length += n;
    }
    ratio->mean = length > 0.0 ? sum / length : 1.0;
    ratio->sd = length > 0.0 ? sqrt(fmax(0.0, square / length - ratio->mean * ratio->mean)) : 0.0;
}

/* Makes the lines without suspects. */
static status find_rest(struct flat_work *w, const struct flat_fit *f, struct error *err)
{
    const struct polyline_set *lines = w->lines;
    const size_t *n = f->v->n;
    const struct duplicate_option o = {{n[0], n[1], n[2]}, f->diameter_voxel, SUSPECT, f->pool};
    status s = polylines_mark_duplicates(lines, &o, w->suspect, err);
    if (s == STATUS_OK) s = polylines_without(lines, w->suspect, LEAST_PIECE, &w->rest, w->origin, err);
    for (size_t k = 0; s == STATUS_OK && k < w->rest.n_vertex; k++) w->rest_section[k] = w->section[w->origin[k]];
    return s;
}

/* Whether x, on a line with tangent t, lies inside the section at vertex k of the rest. */
static bool lies_inside(const struct flat_work *w, const float x[3], const float t[3], size_t k, size_t line)
{
    const float origin[3] = {0.0f, 0.0f, 0.0f};
    float u[3], offset[3], along = 0.0f, cosine = 0.0f;
    polyline_tangent(&w->rest, line, k, 1, u);
    for (int a = 0; a < 3; a++) {
        offset[a] = x[a] - w->rest.vertex[k][a];
        along += offset[a] * u[a];
        cosine += t[a] * u[a];
    }
    if (fabsf(along) > 1.0f || fabsf(cosine) < BESIDE) return false;
    for (int a = 0; a < 3; a++) offset[a] -= along * u[a];
    const struct section_view view = fiber_section_view(&w->rest_section[k], &w->rest_section[k], origin, u);
    return !(fiber_section_place(&view, w->rest.radius[line], offset).share > INSIDE);
}

/* The line of the rest whose section has vertex i of the lines in it; SIZE_MAX: none. */
static size_t line_around(const struct flat_work *w, const struct vertex_grid *g, size_t i, float reach)
{
    const float *x = w->lines->vertex[i];
    size_t from[3], to[3], c[3];
    float t[3];
    polyline_tangent(w->lines, w->line_of[i], i, 1, t);
    vertex_grid_range(g, x, reach, from, to);
    for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
        for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
            for (c[0] = from[0]; c[0] <= to[0]; c[0]++) {
                size_t cell = (c[2] * g->n[1] + c[1]) * g->n[0] + c[0];
                for (size_t e = g->first[cell]; e < g->first[cell + 1]; e++)
                    if (lies_inside(w, x, t, g->vertex[e], g->line_of[g->vertex[e]]))
                        return w->line_of[w->origin[g->vertex[e]]];
            }
    return SIZE_MAX;
}

/* Decides about the run of suspects from .. to - 1: it is removed if more than half of it lies in other sections. */
static size_t decide_run(struct flat_work *w, const struct vertex_grid *g, size_t from, size_t to, float reach)
{
    size_t inside = 0;
    for (size_t i = from; i < to; i++) inside += line_around(w, g, i, reach) != SIZE_MAX;
    const bool remove = 2 * inside > to - from;
    for (size_t i = from; i < to; i++) {
        size_t line = remove ? line_around(w, g, i, reach) : SIZE_MAX;
        if (line != SIZE_MAX) w->covers[line] = true;
        w->suspect[i] = remove;
    }
    return remove ? to - from : 0;
}

static status decide(struct flat_work *w, const size_t n_voxel[3], size_t *n_removed, struct error *err)
{
    struct vertex_grid g = {0};
    float reach = 1.0f;
    for (size_t l = 0; l < w->rest.n_line; l++)
        for (size_t i = w->rest.first[l]; i < w->rest.first[l + 1]; i++)
            reach = fmaxf(reach, sqrtf(fiber_section_ratio(&w->rest_section[i])) * w->rest.radius[l] + 1.0f);
    status s = vertex_grid_init(&g, &w->rest, n_voxel, fmaxf(3.0f, reach), err);
    *n_removed = 0;
    for (size_t l = 0; l < w->lines->n_line && s == STATUS_OK; l++)
        for (size_t i = w->lines->first[l], run = i; i <= w->lines->first[l + 1]; i++) {
            if (i < w->lines->first[l + 1] && w->suspect[i]) continue;
            *n_removed += decide_run(w, &g, run, i, reach);
            run = i + 1;
        }
    vertex_grid_release(&g);
    return s;
}

/* Moves the lines that cover suspects to where they were fitted without them, with radius and sections found there. */
static void take_rest(struct flat_work *w)
{
    for (size_t l = 0; l < w->rest.n_line; l++) {
        size_t first = w->rest.first[l], line = w->line_of[w->origin[first]];
        if (!w->covers[line]) continue;
        if (2 * polyline_length(&w->rest, l) > polyline_length(w->lines, line))
            w->lines->radius[line] = w->rest.radius[l];
        for (size_t i = first; i < w->rest.first[l + 1]; i++) {
            memcpy(w->lines->vertex[w->origin[i]], w->rest.vertex[i], sizeof *w->rest.vertex);
            w->section[w->origin[i]] = w->rest_section[i];
        }
    }
}

/* Fits the lines without suspects, and removes the suspects that lie inside them. */
static status remove_parts(struct flat_work *w, const struct flat_fit *f, const struct axis_profile *profile,
                           size_t *n_removed, struct error *err)
{
    struct axis_profile trial = *profile;
    struct polyline_set kept;
    polyline_set_init(&kept);
    trial.section = w->rest_section;
    status s = find_rest(w, f, err);
    if (s != STATUS_OK || w->rest.n_vertex == w->lines->n_vertex) return s; /* there are no suspects */
    s = polylines_fit(&w->rest, f->v, f->diameter_voxel, N_WITHOUT, &trial, f->pool, f->progress, err);
    if (s == STATUS_OK) s = decide(w, f->v->n, n_removed, err);
    if (s == STATUS_OK) {
        take_rest(w);
        s = polylines_without(w->lines, w->suspect, f->min_vertex, &kept, w->origin, err);
    }
    if (s == STATUS_OK) {
        for (size_t i = 0; i < kept.n_vertex; i++) w->section[i] = w->section[w->origin[i]]; /* origins rise */
        polyline_set_release(w->lines);
        *w->lines = kept;
        polyline_set_init(&kept);
    }
    polyline_set_release(&kept);
    return s;
}

/* Leaves the sections with their errors in the lines: a radius that varies is nearly a linear change of the model, so
 * one round at the varied radii is enough. again: lines have changed since the last measurement. */
static status measure_shapes(struct flat_work *w, const struct flat_fit *f, struct axis_profile *profile, bool again,
                             struct error *err)
{
    status s = STATUS_OK;
    profile->section = w->section;
    profile->measure = f->measure;
    if (again) s = polylines_fit(w->lines, f->v, f->diameter_voxel, 1, profile, f->pool, f->progress, err);
    if (s == STATUS_OK && f->measure->n_varying > 0)
        s = polylines_fit(w->lines, f->v, f->diameter_voxel, 1, profile, f->pool, f->progress, err);
    profile->section = NULL;
    profile->measure = NULL;
    return s;
}

/* Leaves the sections in the lines. */
static status keep_sections(const struct flat_work *w, struct error *err)
{
    struct polyline_set *lines = w->lines;
    status s = polyline_shapes_init(lines, err);
    for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++)
        for (size_t i = lines->first[l]; i < lines->first[l + 1]; i++) {
            float t[3];
            polyline_tangent(lines, l, i, 1, t);
            fiber_section_to_shape(&w->section[i], t, &lines->shape[i]);
        }
    return s;
}

status polylines_fit_flat(struct polyline_set *lines, const struct flat_fit *f, struct axis_profile *profile,
                          struct section_ratio *ratio, struct error *err)
{
    struct flat_work w;
    status s = STATUS_OK;
    *ratio = (struct section_ratio){1.0, 0.0, 0};
    if (!flat_work_init(&w, lines))
        s = error_set(err, STATUS_NO_MEMORY, "cannot fit the sections of fibers: out of memory");
    profile->section = w.section;
    profile->measure = f->measure;
    if (s == STATUS_OK)
        s = polylines_fit(lines, f->v, f->diameter_voxel, f->n_round, profile, f->pool, f->progress, err);
    profile->section = NULL;
    profile->measure = NULL;
    if (s == STATUS_OK) measure_ratio(&w, ratio);
    const bool flat = ratio->mean > (f->interpolated ? RATIO_FLAT_THIN : FIBER_RATIO_FLAT);
    if (s == STATUS_OK && flat) s = remove_parts(&w, f, profile, &ratio->n_removed, err);
    if (s == STATUS_OK && flat && f->measure == NULL) s = keep_sections(&w, err);
    if (s == STATUS_OK && f->measure != NULL) s = measure_shapes(&w, f, profile, ratio->n_removed > 0, err);
    flat_work_release(&w);
    return s;
}
