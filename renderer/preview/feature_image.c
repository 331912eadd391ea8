#include "renderer/preview/feature_image.h"
#include "renderer/scattering/fiber_direction.h"
#include "renderer/transport/camera.h"

#include <math.h>
#include <string.h>

enum { ITERATION = 65534, REPLICA = 15 }; /* other random numbers than render.c has */

struct run {
    const struct feature_request *q;
    const struct progress *progress;
    struct camera camera;
    double plane[4];  /* towards the camera, over the width of the crop: the plane of the crop */
    float axis[3][3]; /* unit: the camera's right, up and view */
    struct image *im;
};

/* The plane through the orbit center that the crop lies in. */
static void find_plane(struct run *r)
{
    const double *a = r->camera.right_mm, *b = r->camera.up_mm;
    double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]),
           width = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    for (int k = 0; k < 3; k++) {
        r->plane[k] = n[k] / length / width;
        r->axis[0][k] = (float)(a[k] / width);
        r->axis[1][k] = (float)(b[k] / sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]));
        r->axis[2][k] = (float)(n[k] / length);
    }
}

static void describe_tangent(const struct run *r, const float tangent[3], float feature[3])
{
    float t[3] = {0, 0, 0};
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < 3; k++) t[a] += r->axis[a][k] * tangent[k];
    feature[0] = t[0] * t[0] - t[1] * t[1];
    feature[1] = 2 * t[0] * t[1];
    feature[2] = t[2] * t[2];
}

static void albedo_of(const struct run *r, const struct scene_hit *hit, const float direction[3], float albedo[3])
{
    const struct dual_tables *t = r->q->averages;
    const float *u = hit->tangent;
    float along = -(u[0] * direction[0] + u[1] * direction[1] + u[2] * direction[2]);
    along = fminf(fmaxf(along, -1), 1);
    for (int c = 0; c < 3; c++) albedo[c] = 1;
    if (t == NULL) return;
    struct dual_average a;
    size_t i_set = scene_set_of(r->q->scene, hit->i_segment, t->n_set);
    dual_average_at(t, i_set, fiber_angle(along, sqrtf(1 - along * along)), &a);
    for (int c = 0; c < 3; c++) albedo[c] = a.forward[c] + a.backward[c];
}

/* feature: preset to 0. */
static void see(const struct run *r, const struct camera *camera, const double xy[2], float feature[N_FEATURE])
{
    struct scene_ray ray;
    struct scene_hit hit;
    if (!camera_ray(camera, r->q->scene, xy, &ray) || !scene_trace(r->q->scene, &ray, &hit)) return;
    albedo_of(r, &hit, ray.direction, feature + FEATURE_ALBEDO);
    describe_tangent(r, hit.tangent, feature + FEATURE_TANGENT);
    feature[FEATURE_SEEN] = 1;
    for (int a = 0; a < 3; a++) {
        double at = (double)hit.position_mm[a] + (a < 2 ? ray.offset_mm[a] : 0.0);
        feature[FEATURE_NORMAL + a] = hit.normal[a];
        feature[FEATURE_DISTANCE] += (float)(r->plane[a] * at);
    }
}

static void run_row(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    const struct feature_request *q = r->q;
    const struct rng_key key = {q->seed, ITERATION, REPLICA, 0};
    for (size_t x = 0; x < q->width && !progress_cancelled(r->progress); x++) {
        double sum[N_FEATURE] = {0}, square[N_FEATURE] = {0}, n = (double)q->n_sample;
        struct rng rng;
        struct camera pinhole;
        rng_start(&rng, &key, (uint32_t)(y * q->width + x), 0);
        for (size_t i = 0; i < q->n_sample; i++) {
            float feature[N_FEATURE] = {0};
            double point[2] = {((double)x + rng_double(&rng)) / (double)q->width,
                               ((double)y + rng_double(&rng)) / (double)q->height},
                   xy[2];
            camera_blur(&r->camera, point, &rng, xy);
            const struct camera *camera = camera_through_lens(&r->camera, &rng, &pinhole, xy);
            see(r, camera, xy, feature);
            for (size_t k = 0; k < N_FEATURE; k++) {
                sum[k] += (double)feature[k];
                square[k] += (double)feature[k] * (double)feature[k];
            }
        }
        float *out = r->im->pixel + (y * q->width + x) * r->im->n_channel;
        for (size_t k = 0; k < N_FEATURE; k++) {
            out[k] = (float)(sum[k] / n);
            out[N_FEATURE + k] = (float)(fmax(0, square[k] - sum[k] * sum[k] / n) / (n * (n - 1)));
        }
    }
}

status feature_image_render(const struct feature_request *q, struct thread_pool *pool, const struct progress *progress,
                            struct image *im, struct error *err)
{
    struct run r = {.q = q, .progress = progress, .im = im};
    memset(im, 0, sizeof *im);
    if (q->n_sample < 2 || q->width == 0 || q->height == 0 || q->width > 65536 || q->height > 65536)
        return error_set(err, STATUS_INVALID, "cannot render features of %zu x %zu pixels with %zu rays each", q->width,
                         q->height, q->n_sample);
    status s = configuration_check(q->configuration, 1, err);
    if (s == STATUS_OK) s = image_init(im, q->width, q->height, (size_t)2 * N_FEATURE, err);
    if (s != STATUS_OK) return s;
    camera_init(&r.camera, q->configuration);
    find_plane(&r);
    s = thread_pool_run(pool, q->height, run_row, &r, progress);
    if (s == STATUS_OK && progress_cancelled(progress)) s = STATUS_CANCELLED;
    if (s == STATUS_OK) return s;
    image_release(im);
    return error_set(err, s, "rendering features was cancelled");
}
