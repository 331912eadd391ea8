/* The ground with a filtered shadow: a grid of its places along the lamp's edges is sampled and filtered, and the
 * picture looks its places up there. */
#include "renderer/preview/ground_plane.h"
#include "renderer/preview/ground_shadow.h"
#include "renderer/preview/pixels/ray_filter.h"
#include "renderer/scene/scene_ray.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Most rays of a pixel, and places on the lamp along an edge by which the light without a shadow is summed. */
enum { PIXEL_SAMPLES = 64, LAMP_PLACES = 2, MAX_GRID = 2048, OUTLINE = 16 };

struct run {
    const struct ground_plane *g;
    const struct progress *progress;
    struct ray_field field; /* of places of the plane in place of pixels */
    double low[2], cell[2]; /* x of the first receiver, and its change to the next one */
    float *visibility;
    struct image *im;
};

/* Returns the distance of a point from the lamp's plane. x: its coordinates along the lamp's edges, divided by this
 * distance. */
static double lamp_coordinates(const struct lamp *l, const double p_mm[3], double x[2])
{
    double to[3], depth = 0;
    for (int a = 0; a < 3; a++) to[a] = p_mm[a] - (double)l->centre_mm[a];
    for (int a = 0; a < 3; a++) depth += to[a] * (double)l->normal[a];
    for (int e = 0; e < 2; e++) {
        x[e] = 0;
        for (int a = 0; a < 3; a++) x[e] += to[a] * (double)l->edge[e][a] / depth;
    }
    return depth;
}

/* Finds the point of the plane with these lamp_coordinates. Returns false if there is none. */
static bool point_at(const struct ground_plane *g, const double x[2], double p_mm[3])
{
    const struct lamp *l = &g->lamp;
    double d[3];
    for (int a = 0; a < 3; a++)
        d[a] = (double)l->normal[a] + x[0] * (double)l->edge[0][a] + x[1] * (double)l->edge[1][a];
    double depth = (g->q->z_mm - (double)l->centre_mm[2]) / d[2];
    if (!(depth > 0) || !isfinite(depth)) return false;
    for (int a = 0; a < 3; a++) p_mm[a] = (double)l->centre_mm[a] + depth * d[a];
    return true;
}

/* Lays the grid over what the picture shows of the plane, with the filter's reach around. False: it shows nothing. */
static bool lay_grid(struct run *r, size_t n[2])
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (size_t i = 0; i <= OUTLINE; i++)
        for (size_t k = 0; k <= OUTLINE; k++) {
            double xy[2] = {(double)i / OUTLINE, (double)k / OUTLINE}, p[3], x[2];
            if (!ground_plane_meet(r->g, xy, p) || !(lamp_coordinates(&r->g->lamp, p, x) > 0)) continue;
            for (int e = 0; e < 2; e++) low[e] = fmin(low[e], x[e]), high[e] = fmax(high[e], x[e]);
        }
    const size_t wanted[2] = {r->g->q->width, r->g->q->height};
    for (int e = 0; e < 2; e++) {
        size_t inner = wanted[e] < MAX_GRID ? wanted[e] : MAX_GRID;
        if (!(high[e] > low[e])) return false;
        r->cell[e] = (high[e] - low[e]) / (double)inner;
        r->low[e] = low[e] + (0.5 - RAY_REACH) * r->cell[e];
        n[e] = inner + 2 * RAY_REACH;
    }
    return true;
}

/* Whether anything lies between two points, and counts the first occluder from `from` with its slope. */
static bool look(struct run *r, size_t i, const double from[3], const double to[3], double receiver_depth)
{
    const struct scene *scene = r->g->q->scene;
    struct scene_ray ray;
    struct scene_hit hit;
    double d[3], length = 0, x[2];
    for (int a = 0; a < 3; a++) d[a] = to[a] - from[a], length += d[a] * d[a];
    for (int a = 0; a < 3; a++) d[a] /= sqrt(length);
    if (!scene_ray_enter(scene, from, d, &ray)) return false;
    if (!scene_trace(scene, &ray, &hit)) return scene_sheet_met(scene, &ray);
    const double p[3] = {(double)hit.position_mm[0] + ray.offset_mm[0], (double)hit.position_mm[1] + ray.offset_mm[1],
                         (double)hit.position_mm[2]};
    double depth = lamp_coordinates(&r->g->lamp, p, x);
    const double slope = 1 / depth - 1 / receiver_depth;
    if (depth > 0 && slope > 0) ray_pixel_meet(&r->field.pixel[i], (float)slope);
    return true;
}

static void sample_receiver(struct run *r, size_t i)
{
    struct ray_field *f = &r->field;
    struct ray_pixel *to = &f->pixel[i];
    const struct lamp *l = &r->g->lamp;
    const double cell[2] = {(double)(i % f->width) * r->cell[0], (double)(i / f->width) * r->cell[1]},
                 x[2] = {r->low[0] + cell[0], r->low[1] + cell[1]};
    double p[3], on_lamp[3], unused[2];
    struct rng rng;
    ground_plane_random(r->g, i, true, &rng);
    to->used = true;
    for (int e = 0; e < 2; e++) {
        to->x[e] = (float)cell[e];
        to->step[e][e] = 1;
        to->cell[e] = (float)r->cell[e];
        to->jitter[e] = (float)rng_double(&rng);
    }
    const bool on_plane = point_at(r->g, x, p);
    const double depth = on_plane ? lamp_coordinates(l, p, unused) : 0;
    for (size_t j = 0; j < f->n_side * f->n_side; j++) {
        const double y[2] = {(double)ray_field_y(f, to, 0, j % f->n_side),
                             (double)ray_field_y(f, to, 1, j / f->n_side)};
        for (int a = 0; a < 3; a++)
            on_lamp[a] = (double)l->centre_mm[a] + y[0] * (double)l->edge[0][a] + y[1] * (double)l->edge[1][a];
        const bool hidden = on_plane && look(r, i, p, on_lamp, depth);
        *ray_field_value(f, i, j % f->n_side, j / f->n_side) = hidden ? 0 : 1;
        if (hidden) look(r, i, on_lamp, p, depth); /* for the occluder that is nearest to the lamp */
    }
}

static void sample_row(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    struct run *r = context;
    for (size_t x = 0; x < r->field.width && !progress_cancelled(r->progress); x++)
        sample_receiver(r, y * r->field.width + x);
}

static float visibility_at(const struct run *r, const double p_mm[3])
{
    const struct ray_field *f = &r->field;
    const size_t n[2] = {f->width, f->height};
    double x[2], part[2];
    size_t at[2];
    if (!(lamp_coordinates(&r->g->lamp, p_mm, x) > 0)) return 1;
    for (int e = 0; e < 2; e++) {
        double u = fmin(fmax((x[e] - r->low[e]) / r->cell[e], 0), (double)(n[e] - 1));
        at[e] = (size_t)fmin(u, (double)(n[e] - 2));
        part[e] = u - (double)at[e];
    }
    const float *v = r->visibility + at[1] * f->width + at[0];
    double upper = (1 - part[0]) * (double)v[0] + part[0] * (double)v[1],
           lower = (1 - part[0]) * (double)v[f->width] + part[0] * (double)v[f->width + 1];
    return (float)((1 - part[1]) * upper + part[1] * lower);
}

static float light_at(const struct ground_plane *g, const double p_mm[3])
{
    float sum = 0, direction[3];
    for (int i = 0; i < LAMP_PLACES * LAMP_PLACES; i++) {
        const float u[2] = {((float)(i % LAMP_PLACES) + 0.5f) / LAMP_PLACES,
                            ((float)(i / LAMP_PLACES) + 0.5f) / LAMP_PLACES};
        sum += ground_plane_lit(g, p_mm, u, direction);
    }
    return sum / (LAMP_PLACES * LAMP_PLACES);
}

static void render_row(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    const struct ground_request *q = r->g->q;
    const size_t n = q->n_sample < PIXEL_SAMPLES ? q->n_sample : PIXEL_SAMPLES;
    for (size_t x = 0; x < q->width && !progress_cancelled(r->progress); x++) {
        float sum = 0;
        struct rng rng;
        ground_plane_random(r->g, y * q->width + x, false, &rng);
        for (size_t i = 0; i < n; i++) {
            double point[2] = {((double)x + rng_double(&rng)) / (double)q->width,
                               ((double)y + rng_double(&rng)) / (double)q->height},
                   xy[2], p[3];
            camera_blur(&r->g->camera, point, &rng, xy);
            if (ground_plane_seen(r->g, xy, p)) sum += light_at(r->g, p) * visibility_at(r, p);
        }
        float *out = r->im->pixel + (y * q->width + x) * r->im->n_channel;
        for (int c = 0; c < 3; c++) out[c] = sum / (float)n;
    }
}

static status make_visibility(struct run *r, const struct ground_filter *filter, struct thread_pool *pool,
                              struct error *err)
{
    struct progress_part part[2] = {{r->progress, 0.0, 0.6}, {r->progress, 0.6, 0.2}};
    struct progress inner[2] = {progress_of_part(&part[0]), progress_of_part(&part[1])};
    struct ray_field *f = &r->field;
    r->visibility = malloc(f->width * f->height * sizeof *r->visibility);
    if (r->visibility == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot filter a shadow: out of memory");
    status s = thread_pool_run(pool, f->height, sample_row, r, &inner[0]);
    if (s != STATUS_OK) return error_set(err, s, "sampling a shadow was cancelled");
    s = ray_field_smooth_slopes(f, err);
    if (s != STATUS_OK) return s;
    return ray_filter(f, filter->whole ? RAY_WHOLE : RAY_PASSES, pool, &inner[1], r->visibility, err);
}

status ground_render_filtered(const struct ground_request *q, const struct ground_filter *filter,
                              struct thread_pool *pool, const struct progress *progress, struct image *im,
                              struct error *err)
{
    struct ground_plane g;
    struct run r = {.g = &g, .progress = progress, .im = im};
    size_t n[2];
    memset(im, 0, sizeof *im);
    status s = ground_plane_init(&g, q, err);
    if (s == STATUS_OK && g.lamp.distant)
        s = error_set(err, STATUS_INVALID,
                      g.lamp.directional ? "cannot filter the shadow of a directional lamp: it is sharp"
                                         : "cannot filter the shadow of a Gaussian lamp, only that of a square one");
    if (s == STATUS_OK) s = image_init(im, q->width, q->height, 3, err);
    if (s != STATUS_OK || !lay_grid(&r, n)) return s;
    s = ray_field_init(&r.field, n[0], n[1], filter->n_side, 1, err);
    r.field.half = g.lamp.half_side_mm;
    if (s == STATUS_OK) s = make_visibility(&r, filter, pool, err);
    struct progress_part last = {progress, 0.8, 0.2};
    struct progress inner = progress_of_part(&last);
    if (s == STATUS_OK) s = thread_pool_run(pool, q->height, render_row, &r, &inner);
    if (s == STATUS_OK && progress_cancelled(progress)) s = STATUS_CANCELLED;
    if (s == STATUS_CANCELLED) error_set(err, s, "rendering the ground was cancelled");
    ray_field_release(&r.field);
    free(r.visibility);
    if (s != STATUS_OK) image_release(im);
    return s;
}
