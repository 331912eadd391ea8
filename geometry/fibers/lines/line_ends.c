#include "geometry/fibers/lines/line_ends.h"

#include <math.h>
#include <stdbool.h>

/* Mean density on the way from x over n_step steps of t. */
static double density_on_way(const struct volume *v, const float x[3], const float t[3], double n_step)
{
    double sum = 0.0;
    int n = 1 + (int)n_step;
    for (int k = 0; k < n; k++) {
        size_t i[3];
        for (int a = 0; a < 3; a++) {
            double c = floor((double)x[a] + n_step * (k + 0.5) / n * (double)t[a]);
            i[a] = c <= 0.0 ? 0 : c >= (double)v->n[a] - 1.0 ? v->n[a] - 1 : (size_t)c;
        }
        sum += (double)v->density[volume_index(v->n, i[0], i[1], i[2])];
    }
    return sum / n;
}

/* The last vertex of a line, or the first one; t: step beyond it, of about a voxel. */
static float *end_of_line(const struct polyline_set *p, size_t line, bool last, float t[3])
{
    const size_t m = polyline_length(p, line), back = m < 5 ? m - 1 : 4;
    float *x = p->vertex[last ? p->first[line + 1] - 1 : p->first[line]];
    const float *y = p->vertex[last ? p->first[line + 1] - 1 - back : p->first[line] + back];
    for (int a = 0; a < 3; a++) t[a] = (x[a] - y[a]) / (float)back;
    return x;
}

/* Extends a line that ends shortly before a face to that face, if there is material on the rest of the way. `last`:
 * the last vertex instead of the first. */
static void reach_face(struct polyline_set *p, size_t line, bool last, const struct volume *v, double eps_d,
                       double max_voxel)
{
    float t[3], nearest = INFINITY, *x = end_of_line(p, line, last, t);
    for (int a = 0; a < 3; a++) { /* number of steps of t until a face is reached */
        float room = t[a] > 0.0f ? (float)v->n[a] - x[a] : x[a], speed = fabsf(t[a]);
        if (speed > 0.2f && room / speed < nearest) nearest = room / speed;
    }
    if (!(nearest > 0.0f && (double)nearest <= fmax(1.5, max_voxel))) return;
    if (nearest > 1.5f && density_on_way(v, x, t, (double)nearest) < eps_d) return;
    for (int a = 0; a < 3; a++) x[a] += nearest * t[a];
}

void polylines_reach_faces(struct polyline_set *lines, const struct volume *v, double eps_d, double max_voxel)
{
    for (size_t l = 0; l < lines->n_line; l++) {
        reach_face(lines, l, false, v, eps_d, max_voxel);
        reach_face(lines, l, true, v, eps_d, max_voxel);
    }
}

static bool is_inside(const size_t n_voxel[3], const float x[3])
{
    for (int a = 0; a < 3; a++)
        if (!(x[a] >= 0.0f && x[a] <= (float)n_voxel[a])) return false;
    return true;
}

size_t polylines_count_lost_ends(const struct polyline_set *lines, const struct volume *v, double eps_d, double ahead)
{
    size_t n_lost = 0;
    for (size_t e = 0; e < 2 * lines->n_line; e++) {
        float t[3], beyond[3];
        if (polyline_length(lines, e / 2) < 2) continue;
        const float *x = end_of_line(lines, e / 2, e % 2 != 0, t);
        for (int a = 0; a < 3; a++) beyond[a] = x[a] + (float)ahead * t[a];
        n_lost += is_inside(v->n, beyond) && density_on_way(v, x, t, ahead) >= eps_d;
    }
    return n_lost;
}

status polylines_keep_inside(const struct polyline_set *in, const size_t n_voxel[3], size_t min_vertex,
                             struct polyline_set *out, size_t n_dropped[3], struct error *err)
{
    status s = STATUS_OK;
    for (size_t l = 0; l < in->n_line && s == STATUS_OK; l++) {
        size_t from = in->first[l], to = in->first[l + 1];
        while (from < to && !is_inside(n_voxel, in->vertex[from])) from++;
        while (to > from && !is_inside(n_voxel, in->vertex[to - 1])) to--;
        if (to - from < min_vertex) {
            n_dropped[in->axis[l]]++;
            continue;
        }
        s = polyline_add_part(out, in, l, from, to, err);
    }
    return s;
}
