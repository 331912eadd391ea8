#include "renderer/preview/ground_shadow.h"
#include "renderer/preview/ground_plane.h"
#include "renderer/scene/scene_ray.h"

#include <math.h>
#include <string.h>

struct run {
    const struct ground_plane *g;
    const struct progress *progress;
    struct image *im;
};

/* Radiance of one ray of a pixel; the plane is grey, and the lamp white. */
static float ray_radiance(const struct ground_plane *g, const double point[2], struct rng *rng)
{
    double xy[2], p[3], d[3];
    float direction[3];
    struct scene_ray ray;
    camera_blur(&g->camera, point, rng, xy);
    const float u[2] = {(float)rng_double(rng), (float)rng_double(rng)};
    if (!ground_plane_seen(g, xy, p)) return 0;
    float radiance = ground_plane_lit(g, p, u, direction);
    for (int a = 0; a < 3; a++) d[a] = (double)direction[a];
    if (radiance > 0 && scene_ray_enter(g->q->scene, p, d, &ray) && scene_occluded(g->q->scene, &ray)) return 0;
    return radiance;
}

static void run_row(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    const struct ground_request *q = r->g->q;
    for (size_t x = 0; x < q->width && !progress_cancelled(r->progress); x++) {
        double sum = 0, square = 0, n = (double)q->n_sample;
        struct rng rng;
        ground_plane_random(r->g, y * q->width + x, false, &rng);
        for (size_t i = 0; i < q->n_sample; i++) {
            double point[2] = {((double)x + rng_double(&rng)) / (double)q->width,
                               ((double)y + rng_double(&rng)) / (double)q->height};
            double v = (double)ray_radiance(r->g, point, &rng);
            sum += v;
            square += v * v;
        }
        float *out = r->im->pixel + (y * q->width + x) * r->im->n_channel;
        for (int c = 0; c < 3; c++) {
            out[c] = (float)(sum / n);
            out[3 + c] = (float)(fmax(0, square - sum * sum / n) / (n * (n - 1)));
        }
    }
}

status ground_render(const struct ground_request *q, struct thread_pool *pool, const struct progress *progress,
                     struct image *im, struct error *err)
{
    struct ground_plane g;
    struct run r = {&g, progress, im};
    memset(im, 0, sizeof *im);
    status s = ground_plane_init(&g, q, err);
    if (s == STATUS_OK) s = image_init(im, q->width, q->height, 6, err);
    if (s != STATUS_OK) return s;
    s = thread_pool_run(pool, q->height, run_row, &r, progress);
    if (s == STATUS_OK && progress_cancelled(progress)) s = STATUS_CANCELLED;
    if (s == STATUS_OK) return s;
    image_release(im);
    return error_set(err, s, "rendering the ground was cancelled");
}
