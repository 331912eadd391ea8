#include "optimizer/report/lobes/cloth_sphere.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_SIDE = 6, MOST_SIDE = 28, LEAST_PATHS = 256, REACH = 2 };
/* Grazing views and lights that are left out: there the means change faster than the places lie apart. */
static const double least_cosine = 0.03;

struct node {
    double rgb[3], var[3];
    bool seen; /* lies on the sphere */
};

/* Places on a square grid over the disk that the sphere shows: x to the right, y down, both from -1 to 1. */
struct grid {
    size_t side, n_lit;
    struct node *node;
    struct configuration *lit;
    size_t *place, *n_path; /* of lit */
    struct estimate *estimate;
};

static void release(struct grid *g)
{
    free(g->node);
    free(g->lit);
    free(g->place);
    free(g->n_path);
    free(g->estimate);
}

static status make(struct grid *g, size_t n_path, struct error *err)
{
    const double side = floor(sqrt((double)n_path / (M_PI_4 * LEAST_PATHS)));
    g->side = (size_t)fmin(fmax(side, LEAST_SIDE), MOST_SIDE);
    const size_t n = g->side * g->side;
    g->node = calloc(n, sizeof *g->node);
    g->lit = calloc(n, sizeof *g->lit);
    g->place = calloc(n, sizeof *g->place);
    g->n_path = calloc(n, sizeof *g->n_path);
    g->estimate = calloc(n, sizeof *g->estimate);
    if (g->node == NULL || g->lit == NULL || g->place == NULL || g->n_path == NULL || g->estimate == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot render a sphere: out of memory");
    return STATUS_OK;
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The direction as angles in a frame at a place with normal n: x across the picture, y up it. */
static void angles_at(const double n[3], const double d[3], double *theta_rad, double *phi_rad)
{
    const double length = hypot(n[0], n[2]), x[3] = {n[2] / length, 0.0, -n[0] / length},
                 y[3] = {n[1] * x[2] - n[2] * x[1], n[2] * x[0] - n[0] * x[2], n[0] * x[1] - n[1] * x[0]};
    *theta_rad = acos(fmin(fmax(dot(d, n), -1.0), 1.0));
    *phi_rad = atan2(dot(d, y), dot(d, x));
}

/* Adds the flat cloth at a place of the grid to those that are estimated, if light comes from there. */
static void add_place(struct grid *g, const struct sphere_request *q, size_t i)
{
    static const double view[3] = {0.0, 0.0, 1.0};
    const struct configuration *row = q->row;
    const double x = (2.0 * (double)(i % g->side) + 1.0) / (double)g->side - 1.0,
                 y = 1.0 - (2.0 * (double)(i / g->side) + 1.0) / (double)g->side, r2 = x * x + y * y;
    const double most = 1.0 - least_cosine * least_cosine, in = r2 > most ? sqrt(most / r2) : 1.0;
    const double n[3] = {in * x, in * y, sqrt(fmax(1.0 - in * in * r2, 0.0))};
    const double lamp[3] = {-sin(row->light_theta_rad), 0.0, cos(row->light_theta_rad)};
    g->node[i].seen = sqrt(r2) < 1.0 + 2.0 / (double)g->side;
    const double facing = dot(n, lamp);
    if (!g->node[i].seen || (q->black_sheet ? facing < least_cosine : fabs(facing) < least_cosine)) return;
    struct configuration *c = &g->lit[g->n_lit];
    *c = *row;
    angles_at(n, lamp, &c->light_theta_rad, &c->light_phi_rad);
    angles_at(n, view, &c->camera_theta_rad, &c->camera_phi_rad);
    c->light_phi_rad += row->light_phi_rad - M_PI; /* in the middle the lamp has its azimuth */
    c->camera_phi_rad += row->light_phi_rad - M_PI;
    if (row->n_rotation > 1) c->cloth_rotation_rad += 2.0 * M_PI * fmod(0.6180339887 * (double)i, 1.0);
    c->n_rotation = 0;
    c->contrast_cells = 0;
    g->place[g->n_lit++] = i;
}

static status estimate_places(struct grid *g, const struct sphere_request *q, struct thread_pool *pool,
                              const struct progress *progress, double *noise, struct error *err)
{
    double sum = 0.0, variance = 0.0;
    for (size_t i = 0; i < g->side * g->side; i++) add_place(g, q, i);
    *noise = NAN;
    if (g->n_lit == 0) return STATUS_OK;
    for (size_t k = 0; k < g->n_lit; k++) g->n_path[k] = q->n_path / g->n_lit + 1;
    const struct estimate_request e = {
        .input = q->input, .configuration = g->lit, .n_configuration = g->n_lit, .n_path = g->n_path, .seed = q->seed};
    status s = estimate_run(&e, pool, progress, g->estimate, err);
    for (size_t k = 0; s == STATUS_OK && k < g->n_lit; k++)
        for (size_t c = 0; c < 3; c++) {
            g->node[g->place[k]].rgb[c] = g->estimate[k].mean[c];
            g->node[g->place[k]].var[c] = g->estimate[k].var[c];
            sum += g->estimate[k].mean[c];
            variance += g->estimate[k].var[c];
        }
    if (s == STATUS_OK && sum > 0.0) *noise = sqrt(variance / (3.0 * (double)g->n_lit)) * 3.0 * (double)g->n_lit / sum;
    return s;
}

/* The value of a plane through the places around (x, y) in units of the grid, with weights that fall off within a place
 * or two; a mean where they lie on a line. */
static void value_at(const struct grid *g, double x, double y, double rgb[3])
{
    double m[3][3] = {{0}}, v[3][3] = {{0}};
    const long x0 = lround(x), y0 = lround(y), side = (long)g->side;
    for (long j = y0 - REACH; j <= y0 + REACH; j++)
        for (long i = x0 - REACH; i <= x0 + REACH; i++) {
            if (i < 0 || j < 0 || i >= side || j >= side || !g->node[j * side + i].seen) continue;
            const struct node *node = &g->node[j * side + i];
            const double d[3] = {1.0, (double)i - x, (double)j - y}, w = exp(-0.5 * (d[1] * d[1] + d[2] * d[2]));
            for (int a = 0; a < 3; a++) {
                for (int b = 0; b < 3; b++) m[a][b] += w * d[a] * d[b];
                for (int c = 0; c < 3; c++) v[a][c] += w * d[a] * node->rgb[c];
            }
        }
    /* the first row of the inverse of m, by cofactors */
    const double c0 = m[1][1] * m[2][2] - m[1][2] * m[2][1], c1 = m[1][2] * m[2][0] - m[1][0] * m[2][2],
                 c2 = m[1][0] * m[2][1] - m[1][1] * m[2][0], det = m[0][0] * c0 + m[0][1] * c1 + m[0][2] * c2;
    for (int c = 0; c < 3; c++) {
        const double mean = m[0][0] > 0.0 ? v[0][c] / m[0][0] : 0.0;
        rgb[c] = det > 1e-6 * pow(m[0][0], 3.0) ? (c0 * v[0][c] + c1 * v[1][c] + c2 * v[2][c]) / det : mean;
        rgb[c] = fmax(rgb[c], 0.0);
    }
}

static void draw(const struct grid *g, struct image *im)
{
    const double half = (double)im->width / 2.0, radius = half - 1.0;
    for (size_t j = 0; j < im->height; j++)
        for (size_t i = 0; i < im->width; i++) {
            const double x = ((double)i + 0.5 - half) / radius, y = ((double)j + 0.5 - half) / radius,
                         covered = fmin(fmax((1.0 - hypot(x, y)) * radius + 0.5, 0.0), 1.0);
            double rgb[3];
            if (covered == 0.0) continue;
            value_at(g, (x + 1.0) * (double)g->side / 2.0 - 0.5, (y + 1.0) * (double)g->side / 2.0 - 0.5, rgb);
            for (int c = 0; c < 3; c++) im->pixel[(j * im->width + i) * 3 + (size_t)c] = (float)(covered * rgb[c]);
        }
}

status cloth_sphere_render(const struct sphere_request *q, struct thread_pool *pool, const struct progress *progress,
                           struct image *im, double *noise, struct error *err)
{
    struct grid g = {0};
    memset(im, 0, sizeof *im);
    status s = make(&g, q->n_path, err);
    if (s == STATUS_OK) s = image_init(im, q->px, q->px, 3, err);
    if (s == STATUS_OK) s = estimate_places(&g, q, pool, progress, noise, err);
    if (s == STATUS_OK)
        draw(&g, im);
    else
        image_release(im);
    release(&g);
    return s;
}
