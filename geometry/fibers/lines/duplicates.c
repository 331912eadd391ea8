#include "geometry/fibers/lines/joining.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

/* Vertices to both sides from which a tangent is taken. */
enum { REACH = 2 };
enum { LINES = 32 }; /* lines in a task */

/* Line a has precedence over b: it is longer, or the earlier one of equals. */
static bool wins(const struct polyline_set *p, size_t a, size_t b)
{
    size_t na = polyline_length(p, a), nb = polyline_length(p, b);
    return na != nb ? na > nb : a < b;
}

/* Lines that run beside each other, by the cosine of their directions. */
static const float BESIDE = 0.85f;

/* Distance of the axes within which two lines are one fiber: inside of the thicker one, where no other axis can be, or
 * of lines beside each other `touching` times the sum of the radii. */
static float near_distance(const struct polyline_set *p, size_t a, size_t b, float usual, float touching)
{
    float ra = p->radius[a] > 0.0f ? p->radius[a] : usual, rb = p->radius[b] > 0.0f ? p->radius[b] : usual;
    return fmaxf(fmaxf(1.0f, touching * (ra + rb)), 0.9f * fmaxf(ra, rb) + 0.1f * fminf(ra, rb));
}

/* Data of the search for duplicates that all vertices share. */
struct duplicate_search {
    const struct polyline_set *p;
    struct vertex_grid grid;
    float usual, most, touching; /* radius where it is not known; largest near_distance; joining.h */
};

/* Returns whether vertex `other` of another line passes within near_distance of x, where `line` has tangent t. Most
 * vertices are too far away to ask for their tangent. */
static bool passes(const struct duplicate_search *s, size_t line, const float x[3], const float t[3], size_t other)
{
    size_t other_line = s->grid.line_of[other];
    const float widest = near_distance(s->p, other_line, line, s->usual, s->touching);
    float d[3], u[3], along = 0.0f, square = 0.0f, cosine = 0.0f;
    for (int a = 0; a < 3; a++) {
        d[a] = x[a] - s->p->vertex[other][a];
        square += d[a] * d[a];
    }
    if (square > widest * widest + 1.0f) return false;
    polyline_tangent(s->p, other_line, other, REACH, u);
    for (int a = 0; a < 3; a++) {
        along += d[a] * u[a];
        cosine += t[a] * u[a];
    }
    float near = near_distance(s->p, other_line, line, s->usual, fabsf(cosine) > BESIDE ? s->touching : 0.0f);
    return square <= near * near + 1.0f && square - along * along <= near * near;
}

/* Returns whether a line with precedence passes vertex i of `line` within near_distance. */
static bool is_duplicate(const struct duplicate_search *s, size_t line, size_t i)
{
    const struct vertex_grid *g = &s->grid;
    const float *x = s->p->vertex[i];
    float reach = sqrtf(s->most * s->most + 1.0f), t[3]; /* vertices are at most about 1.5 voxels apart */
    size_t from[3], to[3], c[3];
    polyline_tangent(s->p, line, i, REACH, t);
    vertex_grid_range(g, x, reach, from, to);
    for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
        for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
            for (c[0] = from[0]; c[0] <= to[0]; c[0]++) {
                size_t cell = (c[2] * g->n[1] + c[1]) * g->n[0] + c[0];
                for (size_t e = g->first[cell]; e < g->first[cell + 1]; e++) {
                    size_t other = g->vertex[e], other_line = g->line_of[other];
                    if (other_line != line && wins(s->p, other_line, line) && passes(s, line, x, t, other)) return true;
                }
            }
    return false;
}

struct mark_job {
    const struct duplicate_search *search;
    bool *mark;
};

static void mark_lines(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct mark_job *job = context;
    const struct polyline_set *p = job->search->p;
    for (size_t l = i_task * LINES; l < p->n_line && l < (i_task + 1) * LINES; l++)
        for (size_t i = p->first[l]; i < p->first[l + 1]; i++) job->mark[i] = is_duplicate(job->search, l, i);
}

status polylines_mark_duplicates(const struct polyline_set *lines, const struct duplicate_option *o, bool *mark,
                                 struct error *err)
{
    struct duplicate_search search = {
        .p = lines, .usual = (float)(0.5 * o->diameter_voxel), .touching = (float)o->touching};
    struct mark_job job = {&search, mark};
    search.most = fmaxf(1.0f, search.usual);
    for (size_t l = 0; l < lines->n_line; l++) search.most = fmaxf(search.most, lines->radius[l]);
    search.most *= fmaxf(1.0f, 2.0f * search.touching);
    status s = vertex_grid_init(&search.grid, lines, o->n_voxel, (float)fmax(3.0, o->diameter_voxel), err);
    if (s == STATUS_OK) s = thread_pool_run(o->pool, (lines->n_line + LINES - 1) / LINES, mark_lines, &job, NULL);
    vertex_grid_release(&search.grid);
    return s;
}

status polylines_remove_duplicates(const struct polyline_set *lines, const struct duplicate_option *o,
                                   size_t min_vertex, struct polyline_set *result, struct join_counts *counts,
                                   struct error *err)
{
    bool *mark = malloc((lines->n_vertex + 1) * sizeof *mark);
    if (mark == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look for duplicates of fibers: out of memory");
    status s = polylines_mark_duplicates(lines, o, mark, err);
    if (s == STATUS_OK) s = polylines_without(lines, mark, min_vertex, result, NULL, err);
    counts->n_duplicate = 0;
    for (size_t i = 0; i < lines->n_vertex && s == STATUS_OK; i++) counts->n_duplicate += mark[i];
    free(mark);
    return s;
}

bool polyline_is_overlapped(const struct polyline_set *p, const struct vertex_grid *g, size_t line, size_t i,
                            float share, float most)
{
    const float *x = p->vertex[i];
    size_t from[3], to[3], c[3];
    vertex_grid_range(g, x, share * (p->radius[line] + most) + 1.0f, from, to);
    for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
        for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
            for (c[0] = from[0]; c[0] <= to[0]; c[0]++) {
                size_t cell = (c[2] * g->n[1] + c[1]) * g->n[0] + c[0];
                for (size_t e = g->first[cell]; e < g->first[cell + 1]; e++) {
                    size_t other = g->vertex[e], other_line = g->line_of[other];
                    if (other_line == line) continue;
                    float near = share * (p->radius[line] + p->radius[other_line]);
                    float d[3], s[3], along = 0.0f, square = 0.0f;
                    for (int a = 0; a < 3; a++) {
                        d[a] = x[a] - p->vertex[other][a];
                        square += d[a] * d[a];
                    }
                    if (square > near * near + 1.01f) continue; /* too far, whatever the tangent is */
                    polyline_tangent(p, other_line, other, REACH, s);
                    for (int a = 0; a < 3; a++) along += d[a] * s[a];
                    if (along * along <= 1.0f && square - along * along < near * near) return true;
                }
            }
    return false;
}
