#include "geometry/cloth/film_obstacle.h"

#include <math.h>

/* The distance of strands of the radius r between which a fiber of the radius R sinks by r / 2: half of it is a leg of
 * the triangle of the hypotenuse R + r. */
static double spacing_m(const struct cloth_work *w, double r)
{
    double least_m = INFINITY;
    for (size_t k = 0; k < w->d->n_kind; k++)
        if (w->nominal[k].n_fiber > 0) least_m = fmin(least_m, w->nominal[k].radius_m);
    return 2.0 * sqrt(r * (least_m + 0.75 * r));
}

/* A point across the film at the share t of the way from node x to the next: u_m from its middle along the long axis.
 */
static void point_at(const struct film_node *x, double t, double u_m, double p[3])
{
    double axis[3], length2 = 0.0;
    const struct film_node *next = t > 0.0 ? x + 1 : x;
    for (int a = 0; a < 3; a++) {
        axis[a] = (1.0 - t) * (double)x->axis[a] + t * (double)next->axis[a];
        length2 += axis[a] * axis[a];
    }
    for (int a = 0; a < 3; a++) p[a] = (1.0 - t) * x->p[a] + t * next->p[a] + u_m * axis[a] / sqrt(length2);
}

/* The strands of a film of n nodes. */
static status add_film(struct cloth_work *w, const struct film_node *x, size_t n, struct error *err)
{
    const double r = (double)x->half_m[1], edge_m = (double)x->half_m[0] - r, apart_m = spacing_m(w, r);
    const size_t n_line = (size_t)ceil(2.0 * edge_m / apart_m) + 1, n_sub = (size_t)ceil((double)x->step_m / apart_m),
                 n_node = (n - 1) * n_sub + 1;
    const struct strand like = {.radius_m = r, .axis_class = x->axis_class, .fixed = true};
    status s = work_has_room(w, n_line * n_node, err);
    for (size_t i = 0; i < n_line && s == STATUS_OK; i++) {
        const double u_m = edge_m * (2.0 * (double)i / (double)(n_line - 1) - 1.0);
        double(*node)[3];
        s = strand_add(&w->set, &like, n_node, &node, err);
        for (size_t k = 0; k < n_node && s == STATUS_OK; k++)
            point_at(x + k / n_sub, (double)(k % n_sub) / (double)n_sub, u_m, node[k]);
    }
    return s;
}

status film_obstacles_add(struct cloth_work *w, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0, n; i < w->film.n && s == STATUS_OK; i += n) {
        for (n = 1; i + n < w->film.n && !w->film.node[i + n].is_first;) n++;
        s = add_film(w, w->film.node + i, n, err);
    }
    return s;
}
