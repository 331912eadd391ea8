#include "geometry/fibers/lines/joining.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

/* Tangent at vertex i of a line, by central difference. */
static void tangent_at(const struct polyline_set *p, size_t line, size_t i, float t[3])
{
    size_t a = i > p->first[line] + 1 ? i - 2 : p->first[line],
           b = i + 2 < p->first[line + 1] ? i + 2 : p->first[line + 1] - 1;
    float norm = 0.0f;
    for (int c = 0; c < 3; c++) {
        t[c] = p->vertex[b][c] - p->vertex[a][c];
        norm += t[c] * t[c];
    }
    norm = norm > 0.0f ? 1.0f / sqrtf(norm) : 0.0f;
    for (int c = 0; c < 3; c++) t[c] *= norm;
}

/* Line a has precedence over b: it is longer, or the earlier one of equals. */
static bool wins(const struct polyline_set *p, size_t a, size_t b)
{
    size_t na = polyline_length(p, a), nb = polyline_length(p, b);
    return na != nb ? na > nb : a < b;
}

/* Distance of the axes within which two lines are one fiber: inside of the thicker one, where no other axis can be. */
static float near_distance(const struct polyline_set *p, size_t a, size_t b, float usual)
{
    float ra = p->radius[a] > 0.0f ? p->radius[a] : usual, rb = p->radius[b] > 0.0f ? p->radius[b] : usual;
    return fmaxf(1.0f, 0.9f * fmaxf(ra, rb) + 0.1f * fminf(ra, rb));
}

/* Returns whether a line with precedence passes vertex i of `line` within near_distance, which is at most `most`. */
static bool is_duplicate(const struct polyline_set *p, const struct vertex_grid *g, size_t line, size_t i, float usual,
                         float most)
{
    const float *x = p->vertex[i];
    float reach = sqrtf(most * most + 1.0f); /* vertices are at most about 1.5 voxels apart */
    size_t from[3], to[3], c[3];
    vertex_grid_range(g, x, reach, from, to);
    for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
        for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
            for (c[0] = from[0]; c[0] <= to[0]; c[0]++) {
                size_t cell = (c[2] * g->n[1] + c[1]) * g->n[0] + c[0];
                for (size_t e = g->first[cell]; e < g->first[cell + 1]; e++) {
                    size_t other = g->vertex[e], other_line = g->line_of[other];
                    if (other_line == line || !wins(p, other_line, line)) continue;
                    float near = near_distance(p, other_line, line, usual);
                    float d[3], s[3], along = 0.0f, square = 0.0f;
                    tangent_at(p, other_line, other, s);
                    for (int a = 0; a < 3; a++) {
                        d[a] = x[a] - p->vertex[other][a];
                        along += d[a] * s[a];
                        square += d[a] * d[a];
                    }
                    if (square <= near * near + 1.0f && square - along * along <= near * near) return true;
                }
            }
    return false;
}

status polylines_remove_duplicates(const struct polyline_set *lines, const size_t n_voxel[3], double diameter_voxel,
                                   size_t min_vertex, struct polyline_set *result, struct join_counts *counts,
                                   struct error *err)
{
    struct vertex_grid g = {0};
    float usual = (float)(0.5 * diameter_voxel), most = fmaxf(1.0f, usual);
    for (size_t l = 0; l < lines->n_line; l++) most = fmaxf(most, lines->radius[l]);
    status s = vertex_grid_init(&g, lines, n_voxel, (float)fmax(3.0, diameter_voxel), err);
    counts->n_duplicate = 0;
    for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++) {
        size_t run = lines->first[l];
        for (size_t i = lines->first[l]; i <= lines->first[l + 1] && s == STATUS_OK; i++) {
            bool cut = i == lines->first[l + 1] || is_duplicate(lines, &g, l, i, usual, most);
            if (!cut) continue;
            if (i - run >= min_vertex) s = polyline_add_part(result, lines, l, run, i, err);
            counts->n_duplicate += i < lines->first[l + 1];
            run = i + 1;
        }
    }
    vertex_grid_release(&g);
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
                    float s[3], along = 0.0f, square = 0.0f;
                    tangent_at(p, other_line, other, s);
                    for (int a = 0; a < 3; a++) {
                        float d = x[a] - p->vertex[other][a];
                        along += d * s[a];
                        square += d * d;
                    }
                    if (along * along <= 1.0f && square - along * along < near * near) return true;
                }
            }
    return false;
}
