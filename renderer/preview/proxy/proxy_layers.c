#include "renderer/preview/proxy/proxy_layers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Neighbours lie at most so many pixels' widths from the plane of a receiver. */
static const double near_pixels = 3.0;

struct run {
    const struct proxy_surface *s;
    const struct progress *progress;
    struct proxy_layers *l;
};

static void find_row(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    const struct proxy_request *q = r->s->q;
    for (size_t x = 0; x < q->width && !progress_cancelled(r->progress); x++) {
        const double xy[2] = {((double)x + 0.5) / (double)q->width, ((double)y + 0.5) / (double)q->height};
        struct proxy_place *p = &r->l->place[y * q->width + x];
        struct ray_pixel *to = &r->l->receiver[y * q->width + x];
        if (!proxy_surface_see(r->s, &r->s->camera, xy, p)) continue;
        to->used = true;
        to->depth_mm = (float)(near_pixels * r->s->pixel_mm);
        for (int a = 0; a < 3; a++) {
            to->place_mm[a] = (float)p->hit.position_mm[a];
            to->normal[a] = (float)p->facing[a];
        }
    }
}

status proxy_layers_init(const struct proxy_surface *s, struct thread_pool *pool, const struct progress *progress,
                         struct proxy_layers *l, struct error *err)
{
    const size_t n = s->q->width * s->q->height;
    struct run r = {s, progress, l};
    *l = (struct proxy_layers){.place = calloc(n, sizeof *l->place),
                               .receiver = calloc(n, sizeof *l->receiver),
                               .visible = calloc(3 * n, sizeof *l->visible),
                               .bounce = calloc(3 * n, sizeof *l->bounce)};
    if (l->place == NULL || l->receiver == NULL || l->visible == NULL || l->bounce == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot make a preview of %zu x %zu pixels: out of memory", s->q->width,
                         s->q->height);
    status st = thread_pool_run(pool, s->q->height, find_row, &r, progress);
    return st == STATUS_OK ? st : error_set(err, st, "making a preview was cancelled");
}

void proxy_layers_release(struct proxy_layers *l)
{
    free(l->place);
    free(l->receiver);
    free(l->visible);
    free(l->bounce);
    memset(l, 0, sizeof *l);
}

/* Where the ray through a point of the picture meets the plane of a place. */
static bool on_plane(const struct proxy_surface *s, const struct proxy_place *p, const double xy[2], double at[3])
{
    double d[3], o[3], rate = 0.0, height = 0.0;
    camera_direction(&s->camera, xy, d);
    camera_origin(&s->camera, xy, o);
    for (int a = 0; a < 3; a++) {
        rate += d[a] * p->facing[a];
        height += (p->hit.position_mm[a] - o[a]) * p->facing[a];
    }
    if (!(rate < -0.02)) return false;
    for (int a = 0; a < 3; a++) at[a] = o[a] + height / rate * d[a];
    return true;
}

bool proxy_layers_receiver(const struct proxy_surface *s, const struct proxy_place *p, size_t i_pixel, proxy_axes *at,
                           struct ray_pixel *r)
{
    const double size[2] = {(double)s->q->width, (double)s->q->height},
                 pixel[2] = {(double)(i_pixel % s->q->width) + 0.5, (double)(i_pixel / s->q->width) + 0.5};
    double x[2], rate[2][2]; /* [axis][pixel's x, y] */
    at(s, p, p->hit.position_mm, x);
    for (int k = 0; k < 2; k++) {
        double xy[2] = {pixel[0] / size[0], pixel[1] / size[1]}, point[3], beside[2];
        xy[k] += 1.0 / size[k];
        if (!on_plane(s, p, xy, point)) return false;
        at(s, p, point, beside);
        for (int e = 0; e < 2; e++) rate[e][k] = beside[e] - x[e];
    }
    const double det = rate[0][0] * rate[1][1] - rate[0][1] * rate[1][0],
                 size2 = rate[0][0] * rate[0][0] + rate[0][1] * rate[0][1] + rate[1][0] * rate[1][0] +
                         rate[1][1] * rate[1][1];
    if (!(fabs(det) > 1e-3 * size2)) return false;
    for (int e = 0; e < 2; e++) {
        /* the column of the inverse: x of the other axis stays */
        double way[2] = {rate[1 - e][1] / det, -rate[1 - e][0] / det};
        if (e == 1) way[0] = -way[0], way[1] = -way[1];
        const double longer = fmax(fabs(way[0]), fabs(way[1]));
        r->x[e] = (float)x[e];
        r->cell[e] = (float)(1.0 / longer);
        for (int k = 0; k < 2; k++) r->step[e][k] = (float)(way[k] / longer);
    }
    return true;
}

struct sampling {
    const struct proxy_rays *rays;
    const struct progress *progress;
};

static void sample_row(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct sampling *s = context;
    const struct proxy_rays *rays = s->rays;
    const size_t width = rays->field->width;
    for (size_t x = 0; x < width && !progress_cancelled(s->progress); x++) rays->sample(rays->context, y * width + x);
}

status proxy_rays_filter(const struct proxy_rays *rays, struct thread_pool *pool, const struct progress *progress,
                         float *mean, struct error *err)
{
    struct sampling sampling = {rays, progress};
    struct progress_part part[2] = {{progress, 0.0, 0.6}, {progress, 0.6, 0.4}};
    struct progress inner[2] = {progress_of_part(&part[0]), progress_of_part(&part[1])};
    status st = thread_pool_run(pool, rays->field->height, sample_row, &sampling, &inner[0]);
    if (st != STATUS_OK) return error_set(err, st, "making a preview was cancelled");
    st = ray_field_smooth_slopes(rays->field, err);
    return st == STATUS_OK ? ray_filter(rays->field, rays->way, pool, &inner[1], mean, err) : st;
}
