#include "renderer/quick/diffusion_tables.h"
#include "renderer/scene/scene_place.h"
#include "renderer/transport/surface/fiber_walk.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { USUAL_WALKS = 1 << 16, TASK_WALKS = 512 };
static const struct rng_key walk_key = {.seed = 0x6469666675736521u};

/* ---- whether there is a pile ---- */

/* Marks the fibers of the scene that stand; n_fiber is one more than the highest index. NULL: out of memory. */
static bool *standing_fibers(const struct scene *flat, size_t n_fiber)
{
    size_t n_segment = scene_n_segment(flat);
    bool *stands = calloc(n_fiber + 1, sizeof *stands);
    for (size_t i = 0, end; i < n_segment && stands != NULL; i = end) {
        struct scene_segment from, to;
        uint32_t fiber = scene_fiber_of(flat, (uint32_t)i);
        for (end = i + 1; end < n_segment && scene_fiber_of(flat, (uint32_t)end) == fiber;) end++;
        scene_segment_at(flat, (uint32_t)i, &from);
        scene_segment_at(flat, (uint32_t)end - 1, &to);
        stands[fiber] = fabs((double)to.middle_mm[2] - (double)from.middle_mm[2]) > scene_thickness_mm(flat) / 3.0;
    }
    return stands;
}

static double standing_from(const struct scene *flat, bool below, const bool *stands)
{
    enum { N_RAY = 8192 };
    static const struct rng_key key = {.seed = 0x7374616e64696e67u};
    double seen = 0.0, standing = 0.0;
    for (uint32_t i = 0; i < N_RAY; i++) {
        struct rng rng;
        struct scene_ray ray;
        struct scene_hit hit;
        rng_start(&rng, &key, i, below);
        if (!fiber_walk_enter(flat, below, &rng, &ray) || !scene_trace(flat, &ray, &hit)) continue;
        seen += 1.0;
        standing += stands[scene_fiber_of(flat, hit.i_segment)] ? 1.0 : 0.0;
    }
    return seen > 0.0 ? standing / seen : 0.0;
}

status diffusion_check_pile(const struct scene *flat, double *standing, struct error *err)
{
    static const double least = 0.5;
    size_t n_fiber = 0;
    for (size_t i = 0; i < scene_n_segment(flat); i++)
        n_fiber = scene_fiber_of(flat, (uint32_t)i) >= n_fiber ? scene_fiber_of(flat, (uint32_t)i) + 1u : n_fiber;
    bool *stands = standing_fibers(flat, n_fiber);
    if (stands == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look for a pile: out of memory");
    double fraction = standing_from(flat, false, stands);
    if (!scene_has_black_sheet(flat)) fraction = fmax(fraction, standing_from(flat, true, stands));
    free(stands);
    if (standing != NULL) *standing = fraction;
    if (fraction >= least) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "cloth",
                           "the method diffusion is for a cloth with a pile, and this one has none: %.0f %% of what is "
                           "seen of it are fibers that stand, and of a pile %.0f %% at least; take the method dual or "
                           "fast",
                           100.0 * fraction, 100.0 * least);
}

/* ---- directions ---- */

static size_t cell_of(const float d[3])
{
    float z = 0.5f * (d[2] + 1) * DIFFUSION_N_Z,
          phi = (atan2f(d[1], d[0]) * (float)(0.5 * M_1_PI) + 0.5f) * DIFFUSION_N_PHI;
    size_t i = z > 0 ? (size_t)z : 0, k = phi > 0 ? (size_t)phi : 0;
    i = i < DIFFUSION_N_Z ? i : DIFFUSION_N_Z - 1;
    return i * DIFFUSION_N_PHI + (k < DIFFUSION_N_PHI ? k : DIFFUSION_N_PHI - 1);
}

/* Two neighbouring cells, and the share of the second. */
struct between {
    size_t a, b;
    float t;
};

/* The values of z, on one side. */
static struct between z_between(float d_z)
{
    const float half = 0.5f * DIFFUSION_N_Z, least = d_z > 0 ? half : 0, most = least + half - 1;
    float z = fminf(fmaxf(0.5f * (d_z + 1) * DIFFUSION_N_Z - 0.5f, least), most);
    size_t i = (size_t)z;
    return (struct between){i, i + 1 <= (size_t)most ? i + 1 : i, z - (float)i};
}

static struct between phi_between(const float d[3])
{
    float phi = (atan2f(d[1], d[0]) * (float)(0.5 * M_1_PI) + 1.5f) * DIFFUSION_N_PHI - 0.5f;
    size_t k = (size_t)phi;
    return (struct between){k % DIFFUSION_N_PHI, (k + 1) % DIFFUSION_N_PHI, phi - (float)k};
}

static void between_cells(const float (*cell)[3], const float d[3], float rgb[3])
{
    struct between z = z_between(d[2]), p = phi_between(d);
    const float(*low)[3] = cell + z.a * DIFFUSION_N_PHI, (*high)[3] = cell + z.b * DIFFUSION_N_PHI;
    for (int c = 0; c < 3; c++)
        rgb[c] = (1 - z.t) * ((1 - p.t) * low[p.a][c] + p.t * low[p.b][c]) +
                 z.t * ((1 - p.t) * high[p.a][c] + p.t * high[p.b][c]);
}

void diffusion_leaving_at(const struct diffusion_tables *t, size_t side, const float wo[3], float rgb[3])
{
    between_cells(t->leaving[side], wo, rgb);
}

/* Azimuths between two directions, in steps of the table. */
static struct between azimuth_between(const float a[3], const float b[3])
{
    float angle = fabsf(atan2f(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]));
    float x = fminf(angle * (float)(0.5 * M_1_PI) * DIFFUSION_N_PHI, DIFFUSION_N_BETWEEN - 1);
    size_t k = x < DIFFUSION_N_BETWEEN - 1 ? (size_t)x : DIFFUSION_N_BETWEEN - 2;
    return (struct between){k, k + 1, x - (float)k};
}

void diffusion_entering_at(const struct diffusion_tables *t, const float wo[3], const float wi[3], float rgb[3])
{
    const struct between o = z_between(wo[2]), i = z_between(wi[2]), k = azimuth_between(wo, wi);
    float pair[3] = {0, 0, 0};
    for (unsigned corner = 0; corner < 8; corner++) {
        bool up[3] = {corner & 1, corner >> 1 & 1, corner >> 2 & 1};
        float weight = (up[0] ? o.t : 1 - o.t) * (up[1] ? i.t : 1 - i.t) * (up[2] ? k.t : 1 - k.t);
        const float *p = t->pair[up[0] ? o.b : o.a][up[1] ? i.b : i.a][up[2] ? k.b : k.a];
        for (int c = 0; c < 3; c++) pair[c] += weight * p[c];
    }
    between_cells(t->entering, wi, rgb);
    for (int c = 0; c < 3; c++) rgb[c] *= pair[c];
}

/* ---- walks ---- */

/* What the walks of a task add up to. at: throughput at the last traced hit; out: that at the end. */
struct walk_sums {
    double at[DIFFUSION_N_DIRECTION][3], out[2][DIFFUSION_N_DIRECTION][3], from[DIFFUSION_N_DIRECTION][3];
    double pair[DIFFUSION_N_Z][DIFFUSION_N_Z][DIFFUSION_N_BETWEEN][3];
    double n_out;
    double square_mm2[2][3];                  /* weighted by out */
    double at2[3], out2[2][3], product[2][3]; /* for standard errors */
};

struct walk_job {
    const struct diffusion_request *q;
    struct parameter_sets sets;
    const struct progress *progress;
    struct walk_sums *sums; /* per task */
};

struct traced_end {
    size_t cell;
    float throughput[3];
    double at_mm[2];
};

/* Steps between the azimuths of two cells. */
static size_t steps_between(size_t a, size_t b)
{
    size_t i = a % DIFFUSION_N_PHI, k = b % DIFFUSION_N_PHI, d = i > k ? i - k : k - i;
    return d < DIFFUSION_N_PHI - d ? d : DIFFUSION_N_PHI - d;
}

static void add_end(struct walk_sums *s, const struct traced_end *t, const float direction[3], const double at_mm[2],
                    const float throughput[3])
{
    size_t side = direction[2] <= 0, to = cell_of(direction);
    double square = 0.0, *pair = s->pair[t->cell / DIFFUSION_N_PHI][to / DIFFUSION_N_PHI][steps_between(t->cell, to)];
    s->n_out += 1.0;
    for (int a = 0; a < 2; a++) square += (at_mm[a] - t->at_mm[a]) * (at_mm[a] - t->at_mm[a]);
    for (int c = 0; c < 3; c++) {
        double out = throughput[c];
        s->out[side][t->cell][c] += out;
        s->from[to][c] += out;
        pair[c] += out;
        s->square_mm2[side][c] += out * square;
        s->out2[side][c] += out * out;
        s->product[side][c] += out * (double)t->throughput[c];
    }
}

static void one_walk(const struct walk_job *j, uint32_t i, struct walk_sums *s)
{
    const struct scene *scene = j->q->scene;
    struct rng rng;
    struct scene_ray ray;
    struct scene_hit hit;
    struct traced_end traced = {0};
    float throughput[3] = {1, 1, 1};
    double at_mm[2] = {0.0, 0.0};
    rng_start(&rng, &walk_key, i, 0);
    if (!fiber_walk_enter(scene, !scene_has_black_sheet(scene) && i % 2 == 1, &rng, &ray)) return;
    for (uint32_t n_hit = 0; n_hit < FIBER_WALK_MOST_STEPS; n_hit++) {
        if (!scene_trace(scene, &ray, &hit)) {
            bool lit = n_hit > j->q->n_traced && !scene_sheet_met(scene, &ray);
            if (lit) add_end(s, &traced, ray.direction, at_mm, throughput);
            return;
        }
        for (int a = 0; a < 2; a++) at_mm[a] = (double)hit.position_mm[a] + ray.offset_mm[a];
        if (n_hit + 1 == j->q->n_traced) {
            const float wo[3] = {-ray.direction[0], -ray.direction[1], -ray.direction[2]};
            traced.cell = cell_of(wo);
            memcpy(traced.throughput, throughput, sizeof throughput);
            memcpy(traced.at_mm, at_mm, sizeof at_mm);
            for (int c = 0; c < 3; c++) {
                s->at[traced.cell][c] += (double)throughput[c];
                s->at2[c] += (double)throughput[c] * (double)throughput[c];
            }
        }
        if (!fiber_walk_step(scene, &j->sets, &hit, &ray, &rng, throughput)) return;
    }
}

static uint32_t n_walk_of(const struct diffusion_request *q) { return q->n_walk > 0 ? q->n_walk : USUAL_WALKS; }

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct walk_job *j = context;
    uint32_t n = n_walk_of(j->q), from = (uint32_t)i_task * TASK_WALKS;
    for (uint32_t i = from; i < from + TASK_WALKS && i < n; i++) {
        if (i % 64 == 0 && progress_cancelled(j->progress)) return;
        one_walk(j, i, &j->sums[i_task]);
    }
}

/* ---- what follows from them ---- */

static double safe_ratio(double a, double b) { return b > 0.0 ? a / b : 0.0; }

static double total(const double (*cell)[3], int c, size_t from, size_t to)
{
    double sum = 0.0;
    for (size_t i = from; i < to; i++) sum += cell[i][c];
    return sum;
}

/* Directions that no walk came by have the mean. */
static void fill_leaving(const struct walk_sums *s, struct diffusion_tables *t)
{
    for (int c = 0; c < 3; c++) {
        double all = total(s->at, c, 0, DIFFUSION_N_DIRECTION);
        for (size_t side = 0; side < 2; side++) {
            double out = total(s->out[side], c, 0, DIFFUSION_N_DIRECTION), mean = safe_ratio(out, all);
            double spread2 = s->out2[side][c] - 2.0 * mean * s->product[side][c] + mean * mean * s->at2[c];
            t->share[side][c] = mean;
            t->share_se[side][c] = safe_ratio(sqrt(fmax(0.0, spread2)), all);
            t->mean_square_mm2[side][c] = safe_ratio(s->square_mm2[side][c], out);
            t->dipole[side][c] = diffuse_dipole_match(mean, fmax(t->mean_square_mm2[side][c], 1e-12));
            for (size_t i = 0; i < DIFFUSION_N_DIRECTION; i++)
                t->leaving[side][i][c] = (float)(s->at[i][c] > 0.0 ? s->out[side][i][c] / s->at[i][c] : mean);
        }
    }
}

/* Mean over a side by cosines of what is between the cells. */
static double mean_between(const struct diffusion_tables *t, size_t side, int c)
{
    enum { N = 48 };
    double sum = 0.0;
    for (int i = 0; i < N; i++)
        for (int k = 0; k < N; k++) {
            double z = sqrt((i + 0.5) / N), r = sqrt(1.0 - z * z), phi = 2.0 * M_PI * (k + 0.5) / N;
            const float d[3] = {(float)(r * cos(phi)), (float)(r * sin(phi)), (float)(side == 0 ? z : -z)};
            float rgb[3];
            between_cells(t->entering, d, rgb);
            sum += (double)rgb[c] / (N * N);
        }
    return sum;
}

/* Integral of |cos| / pi over a cell of directions. */
static double cosine_of(size_t cell)
{
    double z = 2.0 * (double)(cell / DIFFUSION_N_PHI) / DIFFUSION_N_Z - 1.0, up = z + 2.0 / DIFFUSION_N_Z;
    return fabs(up * up - z * z) / DIFFUSION_N_PHI;
}

static void fill_entering(const struct walk_sums *s, struct diffusion_tables *t)
{
    enum { HALF = DIFFUSION_N_DIRECTION / 2 };
    for (size_t side = 0; side < 2; side++)
        for (int c = 0; c < 3; c++) {
            size_t first = side == 0 ? HALF : 0;
            double all = total(s->from, c, first, first + HALF);
            for (size_t i = first; i < first + HALF; i++) {
                t->entering[i][c] = (float)(all > 0.0 ? s->from[i][c] / (all * cosine_of(i)) : 1.0);
            }
            double mean = mean_between(t, side, c);
            for (size_t i = first; i < first + HALF; i++) t->entering[i][c] /= (float)mean;
        }
}

/* What the walks found for pairs of directions over what the product of both functions would be. Where few came by, it
 * is drawn towards 1. */
static void fill_pairs(const struct walk_sums *s, struct diffusion_tables *t, bool product)
{
    static const double doubt = 8.0; /* walks */
    double expected[DIFFUSION_N_Z][DIFFUSION_N_Z][DIFFUSION_N_BETWEEN][3] = {{{{0}}}};
    for (size_t i = 0; i < DIFFUSION_N_DIRECTION; i++)
        for (size_t k = 0; k < DIFFUSION_N_DIRECTION; k++) {
            size_t side = k < DIFFUSION_N_DIRECTION / 2;
            double *to = expected[i / DIFFUSION_N_PHI][k / DIFFUSION_N_PHI][steps_between(i, k)], cosine = cosine_of(k);
            for (int c = 0; c < 3; c++) to[c] += s->out[side][i][c] * (double)t->entering[k][c] * cosine;
        }
    for (size_t i = 0; i < DIFFUSION_N_Z; i++)
        for (size_t k = 0; k < DIFFUSION_N_Z; k++)
            for (size_t b = 0; b < DIFFUSION_N_BETWEEN; b++)
                for (int c = 0; c < 3; c++) {
                    double out = total(s->from, c, 0, DIFFUSION_N_DIRECTION), few = doubt * safe_ratio(out, s->n_out),
                           all = expected[i][k][b][c] + few;
                    t->pair[i][k][b][c] = product || !(all > 0.0) ? 1 : (float)((s->pair[i][k][b][c] + few) / all);
                }
}

static void add_sums(struct walk_sums *to, const struct walk_sums *s)
{
    double *a = (double *)to;
    const double *b = (const double *)s;
    for (size_t i = 0; i < sizeof *to / sizeof *a; i++) a[i] += b[i];
}

status diffusion_tables_make(const struct diffusion_request *q, struct thread_pool *pool,
                             const struct progress *progress, struct diffusion_tables *t, struct error *err)
{
    struct walk_job j = {.q = q, .progress = progress};
    size_t n_task = (n_walk_of(q) + TASK_WALKS - 1) / TASK_WALKS;
    memset(t, 0, sizeof *t);
    if (scattering_frame_reason(q->model) != NULL)
        return error_set_field(err, STATUS_INVALID, "model", "cannot render model '%s' by diffusion: %s", q->model->id,
                               scattering_frame_reason(q->model));
    if (scene_is_bent(q->scene) || q->n_traced == 0)
        return error_set(err, STATUS_INVALID, "cannot prepare diffusion for a bent cloth, or without a traced hit");
    status st = parameter_sets_init(&j.sets, q->scene, q->model, q->param, q->n_set, err);
    j.sums = calloc(n_task + 1, sizeof *j.sums);
    if (st == STATUS_OK && j.sums == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot prepare diffusion: out of memory");
    if (st == STATUS_OK) {
        st = thread_pool_run(pool, n_task, run_task, &j, progress);
        if (st != STATUS_OK) error_set(err, st, "preparing diffusion was cancelled");
    }
    if (st == STATUS_OK) {
        for (size_t i = 1; i < n_task; i++) add_sums(&j.sums[0], &j.sums[i]);
        t->n_set = j.sets.n;
        t->n_traced = q->n_traced;
        t->black_sheet = scene_has_black_sheet(q->scene);
        scene_tile_mm(q->scene, t->tile_mm);
        fill_leaving(&j.sums[0], t);
        fill_entering(&j.sums[0], t);
        fill_pairs(&j.sums[0], t, q->product);
    }
    parameter_sets_release(&j.sets);
    free(j.sums);
    return st;
}
