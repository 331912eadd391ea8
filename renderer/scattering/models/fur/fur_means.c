#include "renderer/scattering/models/fur/fur_means.h"
#include "renderer/scattering/models/fur/fur.h"

#include <string.h>

enum { N_WAVE = 16, N_ODD = N_WAVE / 2, N_OFFSET = 160 }; /* wave 2 k + 1 is the k-th odd one */

struct work {
    struct medulla_around around;
    float cosine[MEDULLA_ROUND_RANK][N_ODD], sine[MEDULLA_ROUND_RANK][N_ODD];
};

/* The odd waves of the density of one ray, and their derivatives. */
struct odd_waves {
    float cosine[1 + MEDULLA_RAY_N_BY][N_ODD], sine[1 + MEDULLA_RAY_N_BY][N_ODD];
};

static struct odd_waves odd_waves_of(const struct work *b, const struct medulla_ray *m)
{
    struct odd_waves y = {{{0}}, {{0}}};
    for (int q = 0; q <= MEDULLA_RAY_N_BY; q++) {
        const float *weight = q == 0 ? m->weight : m->d[q - 1];
        medulla_add_waves(weight, b->cosine[0], N_ODD, y.cosine[q]);
        medulla_add_waves(weight, b->sine[0], N_ODD, y.sine[q]);
    }
    return y;
}

/* The mean of |ph| / pi of scattered light, which is the weight of the half that goes through: |ph| is a sum of odd
 * waves, (pi / 2) - (4 / pi) sum cos(k ph) / k^2. */
static struct fur_mean through_weight(const struct fur_fiber *f, const struct fur_ray *ray, const struct odd_waves *y,
                                      int segment, double x)
{
    double d_eta, azimuth = fur_segment_azimuth(ray, segment, x, &d_eta), d_depth[3], by[1 + MEDULLA_RAY_N_BY] = {0};
    double c = cos(azimuth), s = sin(azimuth), turned = 0; /* by the azimuth */
    const double c2 = c * c - s * s, s2 = 2 * s * c;
    fur_depth(f, ray, d_depth);
    for (int j = 0; j < N_ODD; j++) {
        const int k = 2 * j + 1;
        const double factor = -4 / (M_PI * M_PI * k * k), kc = factor * c, ks = factor * s;
        for (int q = 0; q <= MEDULLA_RAY_N_BY; q++) by[q] += kc * (double)y->cosine[q][j] - ks * (double)y->sine[q][j];
        turned += k * (ks * (double)y->cosine[0][j] + kc * (double)y->sine[0][j]);
        const double next = c * c2 - s * s2; /* of wave k + 2 */
        s = s * c2 + c * s2;
        c = next;
    }
    const double by_depth = by[1 + MEDULLA_RAY_BY_DEPTH], by_offset = by[1 + MEDULLA_RAY_BY_OFFSET];
    struct fur_mean w = {0.5 + by[0], {0}};
    w.d[FUR_M_ETA] = by_depth * d_depth[0] + by_offset * ray->offset.eta - d_eta * turned;
    w.d[FUR_M_KAPPA] = by_depth * d_depth[1] + by_offset * ray->offset.kappa;
    w.d[FUR_M_MS] = by_depth * d_depth[2];
    w.d[FUR_M_G] = by[1 + MEDULLA_RAY_BY_G];
    return w;
}

static void add_ray(const struct work *b, const struct fur_fiber *f, double cosine, double x, double weight,
                    struct fur_mean row[FUR_N_PART_OF_LIGHT])
{
    static const int by[FUR_N_BY] = {-1, FUR_M_ETA, FUR_M_KAPPA, FUR_M_LAYERS, FUR_M_MS, -1};
    const struct fur_ray ray = fur_ray_at(f, cosine, x);
    const struct fur_shares a = fur_shares_of(f, &ray, 0);
    double part[FUR_N_PART][FUR_N_BY], d_depth[3];
    struct medulla_ray m;
    fur_parts(f, &ray, 0, part);
    medulla_ray_init(&b->around, fur_depth(f, &ray, d_depth), ray.offset.v, &m);
    const struct odd_waves waves = odd_waves_of(b, &m);
    for (int mode = 0; mode < FUR_N_MODE; mode++) {
        double slope[FUR_N_BY];
        struct fur_mean share = {weight * a.value[mode], {0}};
        fur_share_slopes(&a, mode, part, slope);
        for (int k = 0; k < FUR_N_BY; k++)
            if (by[k] >= 0) share.d[by[k]] = weight * slope[k];
        bool scattered = mode == FUR_TT_S || mode == FUR_TRT_S;
        struct fur_mean w = {0, {0}};
        if (scattered) w = through_weight(f, &ray, &waves, mode == FUR_TT_S ? 1 : 2, x);
        struct fur_mean *to = &row[scattered ? FUR_PART_BACK : mode == FUR_REST ? FUR_TRT : mode];
        to->v += share.v * (1 - w.v);
        for (int k = 0; k < FUR_N_MEAN_BY; k++) to->d[k] += share.d[k] * (1 - w.v) - share.v * w.d[k];
        if (!scattered) continue;
        row[FUR_PART_THROUGH].v += share.v * w.v;
        for (int k = 0; k < FUR_N_MEAN_BY; k++) row[FUR_PART_THROUGH].d[k] += share.d[k] * w.v + share.v * w.d[k];
    }
}

struct rows {
    struct work work;
    struct fur_fiber fiber;
    double weights; /* their sum */
    struct fur_means *means;
};

static void fill_row(void *context, size_t row, size_t i_thread)
{
    const struct rows *r = context;
    struct fur_mean *part = r->means->row[row];
    (void)i_thread;
    for (int i = 0; i < N_OFFSET; i++) {
        double x = (i + 0.5) * M_PI_2 / N_OFFSET;
        add_ray(&r->work, &r->fiber, fmax((double)row / FUR_N_ROW, FUR_LEAST_COSINE), x, cos(x) / r->weights, part);
    }
    part[FUR_PART_SCATTERED].v = part[FUR_PART_BACK].v + part[FUR_PART_THROUGH].v;
    for (int k = 0; k < FUR_N_MEAN_BY; k++)
        part[FUR_PART_SCATTERED].d[k] = part[FUR_PART_BACK].d[k] + part[FUR_PART_THROUGH].d[k];
}

void fur_means_fill(struct fur_means *m, const double *param, struct thread_pool *pool)
{
    struct rows r = {.fiber = fur_fiber_of(param), .means = m};
    float cosine[N_WAVE][MEDULLA_ROUND_RANK], sine[N_WAVE][MEDULLA_ROUND_RANK];
    r.fiber.sigma_ma = 0;
    for (int i = 0; i < N_OFFSET; i++) r.weights += cos((i + 0.5) * M_PI_2 / N_OFFSET);
    medulla_around_init(&r.work.around, param[FUR_P_G]);
    medulla_waves(N_WAVE, cosine, sine);
    for (int k = 0; k < N_ODD; k++)
        for (int q = 0; q < MEDULLA_ROUND_RANK; q++) {
            r.work.cosine[q][k] = cosine[2 * k + 1][q];
            r.work.sine[q][k] = sine[2 * k + 1][q];
        }
    memset(m, 0, sizeof *m);
    thread_pool_run(pool, FUR_N_ROW + 1, fill_row, &r, NULL);
}

struct fur_mean fur_mean_at(const struct fur_means *m, double cos_theta, int part)
{
    double x = fmin(cos_theta, 1) * FUR_N_ROW;
    int row = x < FUR_N_ROW - 1 ? (int)x : FUR_N_ROW - 1;
    const struct fur_mean *a = &m->row[row][part], *b = &m->row[row + 1][part];
    struct fur_mean y = {a->v + (x - row) * (b->v - a->v), {0}};
    for (int k = 0; k < FUR_N_MEAN_BY; k++) y.d[k] = a->d[k] + (x - row) * (b->d[k] - a->d[k]);
    return y;
}
