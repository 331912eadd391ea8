/* The light y of a path beyond the traced hits is compared with the sum X w of terms x_k times weights w_k, where x_0
 * is the deep light of the table. w makes the sum of (y - X w)^2 / x_0 least, so that the sum of y is kept, with a
 * penalty on what w has beside the factor 1. y is the difference of two traced radiances: of a whole path, and of one
 * that ends at the n_traced-th hit. */
#include "renderer/fast/deep_fit.h"
#include "base/small_matrix.h"
#include "renderer/fast/deep_shade.h"
#include "renderer/fast/fast_shade.h"
#include "renderer/transport/camera.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Deep light of the table is a mean of DRAWS draws of where it enters and of the point of the lamp. */
enum { N_ROW = 64, DRAWS = 4, N = DEEP_FACTOR, N_PENALTY = 6 };
static const double penalty[N_PENALTY] = {1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3};

/* Sums over paths, of each channel. */
struct sums {
    double square[3][N][N], product[3][N]; /* X' X / x_0, X' y / x_0 */
    double light, light2, table;           /* of all channels together: y, its square, and x_0 */
};

struct run {
    const struct progress *progress;
    struct fast_setting setting; /* whose paths end at the n_traced-th hit, without deep light */
    struct path_setting whole;
    struct camera camera;
    size_t n_path; /* of a row */
    uint64_t seed;
    struct sums *sums; /* N_ROW */
};

static void add_path(const struct run *r, struct scene_ray *ray, struct rng *rng, struct sums *to)
{
    struct scene_ray whole_ray = *ray, few_ray = *ray;
    struct scene_hit hit;
    struct path_result whole, few;
    float x[3][N] = {{0}};
    if (!scene_trace(r->whole.scene, ray, &hit)) return;
    for (int k = 0; k < DRAWS; k++) deep_shade_terms(&r->setting, &hit, ray, rng, x);
    path_trace(&r->whole, &whole_ray, rng, &whole, NULL);
    path_trace(&r->setting.path, &few_ray, rng, &few, NULL);
    double all = 0.0;
    for (int c = 0; c < 3; c++) {
        const double y = (double)whole.radiance[c] - (double)few.radiance[c], over = (double)x[c][0] / DRAWS;
        all += y;
        to->table += over;
        if (!(over > 0.0)) continue;
        for (int j = 0; j < N; j++) {
            const double xj = (double)x[c][j] / DRAWS;
            to->product[c][j] += xj * y / over;
            for (int k = 0; k <= j; k++) to->square[c][j][k] += xj * (double)x[c][k] / DRAWS / over;
        }
    }
    to->light += all;
    to->light2 += all * all;
}

static void run_row(void *context, size_t i_row, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    const struct rng_key key = {.seed = r->seed ^ 0x64656570666974u};
    for (size_t i = 0; i < r->n_path && !progress_cancelled(r->progress); i++) {
        struct rng rng;
        struct scene_ray ray;
        struct camera pinhole;
        double point[2], xy[2];
        rng_start(&rng, &key, (uint32_t)i_row, (uint32_t)i);
        for (int a = 0; a < 2; a++) point[a] = rng_double(&rng);
        camera_blur(&r->camera, point, &rng, xy);
        const struct camera *camera = camera_through_lens(&r->camera, &rng, &pinhole, xy);
        if (camera_ray(camera, r->whole.scene, xy, &ray)) add_path(r, &ray, &rng, &r->sums[i_row]);
    }
}

/* ---- weights ---- */

static void add_sums(const struct sums *from, struct sums *to)
{
    const double *a = (const double *)from;
    double *b = (double *)to;
    for (size_t i = 0; i < sizeof *to / sizeof *b; i++) b[i] += a[i];
}

/* What the weights have beside a factor of 1. False: the sums say nothing. */
static bool solve(const struct sums *s, int c, double share, double change[N])
{
    double m[N * N];
    if (!(s->square[c][0][0] > 0.0)) return false;
    for (int j = 0; j < N; j++) {
        change[j] = s->product[c][j] - s->square[c][j][0];
        for (int k = 0; k <= j; k++) m[j * N + k] = m[k * N + j] = s->square[c][j][k];
        m[j * N + j] *= 1.0 + (j > 0 ? share : 0.0);
        m[j * N + j] += 1e-9 * s->square[c][0][0];
    }
    if (!small_factor(m, N, 0.0)) return false;
    small_solve(m, N, change, 1);
    return true;
}

/* By how much the change lowers the sum of squares of other paths. */
static double gain(const struct sums *s, int c, const double change[N])
{
    double sum = 0.0;
    for (int j = 0; j < N; j++) {
        sum += 2.0 * change[j] * (s->product[c][j] - s->square[c][j][0]);
        for (int k = 0; k < N; k++) sum -= change[j] * change[k] * s->square[c][j > k ? j : k][j > k ? k : j];
    }
    return sum;
}

/* Sets the weights of a channel. half: sums of each half of the paths; all: of both. Returns whether they make another
 * factor than 1. */
static bool choose(const struct sums half[2], const struct sums *all, int c, float weight[N])
{
    double best = 0.0, change[N];
    int at = -1;
    weight[0] = 1;
    for (int i = 0; i < N_PENALTY; i++) {
        double of[2] = {0.0, 0.0};
        for (int h = 0; h < 2; h++)
            if (solve(&half[h], c, penalty[i], change)) of[h] = gain(&half[1 - h], c, change);
        if (of[0] <= 0.0 || of[1] <= 0.0 || of[0] + of[1] <= best) continue;
        best = of[0] + of[1];
        at = i;
    }
    if (at < 0 || !solve(all, c, penalty[at], change)) return false;
    for (int k = 0; k < N; k++) weight[k] = (float)(change[k] + (k == 0 ? 1.0 : 0.0));
    return true;
}

static void finish(const struct run *r, struct deep_fit *fit)
{
    static const struct sums none;
    struct sums half[2] = {none, none}, all;
    for (size_t i = 0; i < N_ROW; i++) add_sums(&r->sums[i], &half[i % 2]);
    all = half[0];
    add_sums(&half[1], &all);
    memset(fit, 0, sizeof *fit);
    for (int c = 0; c < 3; c++) fit->used |= choose(half, &all, c, fit->factor.weight[c]);
    fit->difference = all.table > 0.0 ? all.light / all.table - 1.0 : 0.0;
    fit->error = all.table > 0.0 ? sqrt(all.light2) / all.table : 0.0;
}

/* ---- preparation ---- */

status deep_fit_make(const struct radiance_input *in, const struct configuration *c, size_t n_path, uint64_t seed,
                     struct thread_pool *pool, const struct progress *progress, struct deep_fit *fit, struct error *err)
{
    struct run r = {.progress = progress, .n_path = n_path / N_ROW + 1, .seed = seed};
    struct fast_option plain = *in->fast;
    struct parameter_sets sets;
    plain.factor = NULL;
    status s = parameter_sets_init(&sets, in->scene.fibers, in->model->surface, in->param, in->n_set, err);
    if (s == STATUS_OK) {
        path_setting_init_sets(&r.setting.path, in->scene.fibers, &sets, c, false);
        r.whole = r.setting.path;
        path_setting_choose(&r.whole);
        s = fast_setting_init(&r.setting, &plain, err);
        r.setting.path.begin = NULL;
    }
    camera_init(&r.camera, c);
    r.sums = calloc(N_ROW, sizeof *r.sums);
    if (s == STATUS_OK && r.sums == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot fit deep light: out of memory");
    if (s == STATUS_OK) s = thread_pool_run(pool, N_ROW, run_row, &r, progress);
    if (s == STATUS_OK && progress_cancelled(progress)) s = STATUS_CANCELLED;
    if (s == STATUS_CANCELLED) error_set(err, s, "fitting deep light was cancelled");
    if (s == STATUS_OK) finish(&r, fit);
    fast_setting_release(&r.setting);
    parameter_sets_release(&sets);
    free(r.sums);
    return s;
}
