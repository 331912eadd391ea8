#include "geometry/orientation/main_directions.h"
#include "base/angle.h"
#include "geometry/orientation/direction_samples.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum {
    N_BIN = 180,
    APART_BIN = 30, /* least distance of two peaks in bins of the histogram, which are one degree each */
    N_ROUND = 30,
    LEAST_SAMPLE = 200
};

/* length of the part of a unit direction in the plane: at most 60 degrees out of it */
static const double LEAST_IN_PLANE = 0.5;
static const double WITHIN_RAD = 0.8727;  /* 50 degrees */
static const double KERNEL_RAD = 0.1396;  /* 8 degrees */
static const double LEAST_CONTRAST = 2.5; /* ratio of a peak to the valley beside it */
static const double LEAST_SECOND = 0.12;  /* a second peak below this share of the first is not a system of its own */
static const double LEAST_SHARE = 0.12;   /* of the directions in the plane */

static double angle_of(const struct direction_sample *s) { return atan2((double)s->d[1], (double)s->d[0]); }

/* Difference of the angles of two lines in radians, within -pi/2..pi/2. */
static double line_difference(double a, double b)
{
    double d = a - b;
    return d - M_PI * round(d / M_PI);
}

static bool in_plane(const struct direction_sample *s)
{
    return s->weight > 0.0f && hypot((double)s->d[0], (double)s->d[1]) >= LEAST_IN_PLANE;
}

static void make_histogram(const struct direction_samples *f, double height[N_BIN])
{
    double raw[N_BIN] = {0.0};
    for (size_t i = 0; i < f->n_brick * DIRECTION_SAMPLES_PER_BRICK; i++)
        if (in_plane(&f->sample[i])) {
            double turn = angle_of(&f->sample[i]) / M_PI;
            raw[(size_t)((turn - floor(turn)) * N_BIN) % N_BIN] += (double)f->sample[i].weight;
        }
    for (int i = 0; i < N_BIN; i++) {
        height[i] = 0.0;
        for (int j = 0; j < N_BIN; j++) {
            double d = line_difference((i - j) * M_PI / N_BIN, 0.0) / KERNEL_RAD;
            height[i] += raw[j] * exp(-0.5 * d * d);
        }
    }
}

/* Finds the bins of the two highest peaks that lie at least APART_BIN apart. Two valleys separate the peaks;
 * contrast is the height of the lower peak over the lowest place of the higher valley. */
static void find_peaks(const double height[N_BIN], int peak[2], double *contrast)
{
    double valley[2] = {INFINITY, INFINITY};
    peak[0] = 0;
    for (int i = 1; i < N_BIN; i++)
        if (height[i] > height[peak[0]]) peak[0] = i;
    peak[1] = (peak[0] + APART_BIN) % N_BIN;
    for (int o = APART_BIN; o <= N_BIN - APART_BIN; o++)
        if (height[(peak[0] + o) % N_BIN] > height[peak[1]]) peak[1] = (peak[0] + o) % N_BIN;
    int apart = (peak[1] - peak[0] + N_BIN) % N_BIN;
    for (int o = 0; o < N_BIN; o++) valley[o > apart] = fmin(valley[o > apart], height[(peak[0] + o) % N_BIN]);
    *contrast = height[peak[1]] / fmax(fmax(valley[0], valley[1]), 1e-300);
}

struct vector_sum {
    double v[3], weight, square; /* square: sum of weight times squared cosine to the present direction */
};

/* Adds the samples of brick b that belong to direction p: those nearer to it in the plane than to the other
 * direction, and within 50 degrees of it there. */
static void add_brick(const struct direction_samples *f, size_t b, double u[2][3], size_t n, size_t p,
                      struct vector_sum *t)
{
    double own = atan2(u[p][1], u[p][0]), other = atan2(u[1 - p][1], u[1 - p][0]);
    for (size_t i = b * DIRECTION_SAMPLES_PER_BRICK; i < (b + 1) * DIRECTION_SAMPLES_PER_BRICK; i++) {
        const struct direction_sample *s = &f->sample[i];
        if (!in_plane(s)) continue;
        double w = (double)s->weight, away = fabs(line_difference(angle_of(s), own)), c = 0.0;
        if (away > WITHIN_RAD || (n > 1 && fabs(line_difference(angle_of(s), other)) < away)) continue;
        for (int a = 0; a < 3; a++) c += u[p][a] * (double)s->d[a];
        for (int a = 0; a < 3; a++) t->v[a] += (c < 0.0 ? -w : w) * (double)s->d[a];
        t->weight += w;
        t->square += w * c * c;
    }
}

static void unit(const double v[3], double u[3])
{
    double norm = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int a = 0; a < 3; a++) u[a] = norm > 0.0 ? v[a] / norm : 0.0;
}

static void iterate_means(const struct direction_samples *f, double u[2][3], size_t n, struct vector_sum total[2])
{
    for (int round = 0; round < N_ROUND; round++) {
        double next[2][3];
        for (size_t p = 0; p < n; p++) {
            total[p] = (struct vector_sum){.weight = 0.0};
            for (size_t b = 0; b < f->n_brick; b++) add_brick(f, b, u, n, p, &total[p]);
            if (total[p].weight > 0.0)
                unit(total[p].v, next[p]);
            else
                memcpy(next[p], u[p], sizeof next[p]);
        }
        memcpy(u, next, n * sizeof *next);
    }
}

/* Standard error of the mean vector by a delete-a-block jackknife, whose blocks are columns of bricks over the
 * height of the cloth. se_deg: within the plane of x and y, and out of it. */
static void standard_error(const struct direction_samples *f, double u[2][3], size_t n, size_t p,
                           const struct vector_sum *total, double se_deg[2])
{
    double sum[2] = {0.0}, square[2] = {0.0}, used = 0.0, flat = hypot(u[p][0], u[p][1]);
    for (size_t column = 0; column < f->n_column; column++) {
        struct vector_sum own = {.weight = 0.0};
        double rest[3], without[3];
        for (size_t b = column; b < f->n_brick; b += f->n_column) add_brick(f, b, u, n, p, &own);
        if (!(own.weight > 0.0)) continue;
        for (int a = 0; a < 3; a++) rest[a] = total->v[a] - own.v[a];
        unit(rest, without);
        const double away[2] = {(without[1] * u[p][0] - without[0] * u[p][1]) / flat, without[2] - u[p][2]};
        for (int a = 0; a < 2; a++) {
            sum[a] += away[a];
            square[a] += away[a] * away[a];
        }
        used += 1.0;
    }
    for (int a = 0; a < 2; a++)
        se_deg[a] = used < 2.0
                        ? NAN
                        : angle_to_deg(sqrt(fmax(0.0, (used - 1.0) * (square[a] / used - pow(sum[a] / used, 2.0)))));
}

/* Puts the direction nearer to x first, and chooses signs so that weft points along +x and warp along +y. */
static void order(struct main_directions *m)
{
    double(*u)[3] = m->direction;
    bool swap =
        m->n == 2 ? fabs(u[0][0]) + fabs(u[1][1]) < fabs(u[0][1]) + fabs(u[1][0]) : fabs(u[0][0]) < fabs(u[0][1]);
    if (swap) {
        struct main_directions t = *m;
        for (int p = 0; p < 2; p++) {
            memcpy(u[p], t.direction[1 - p], sizeof u[p]);
            m->se_deg[p] = t.se_deg[1 - p];
            m->tilt_se_deg[p] = t.tilt_se_deg[1 - p];
            m->share[p] = t.share[1 - p];
            m->concentration[p] = t.concentration[1 - p];
        }
    }
    for (int p = 0; p < 2; p++)
        if (u[p][p] < 0.0)
            for (int a = 0; a < 3; a++) u[p][a] = -u[p][a];
}

/* Counts all directions and those along z. */
static void count_samples(const struct direction_samples *f, struct main_directions *m, double *all)
{
    double along_z = 0.0;
    *all = 0.0;
    for (size_t i = 0; i < f->n_brick * DIRECTION_SAMPLES_PER_BRICK; i++) {
        if (!(f->sample[i].weight > 0.0f)) continue;
        *all += (double)f->sample[i].weight;
        along_z += in_plane(&f->sample[i]) ? 0.0 : (double)f->sample[i].weight;
        m->n_sample++;
    }
    m->n_brick = f->n_brick;
    m->share_z = *all > 0.0 ? along_z / *all : 0.0;
}

static void conclude(const struct direction_samples *f, struct main_directions *m)
{
    double u[2][3] = {{0.0}}, height[N_BIN], all;
    struct vector_sum total[2];
    int peak[2];
    count_samples(f, m, &all);
    if (m->n_sample < LEAST_SAMPLE) return;
    make_histogram(f, height);
    find_peaks(height, peak, &m->contrast);
    for (int p = 0; p < 2; p++) {
        u[p][0] = cos((peak[p] + 0.5) * M_PI / N_BIN);
        u[p][1] = sin((peak[p] + 0.5) * M_PI / N_BIN);
    }
    size_t n = height[peak[1]] < LEAST_SECOND * height[peak[0]] ? 1 : 2;
    iterate_means(f, u, n, total);
    for (size_t p = 0; p < n; p++) {
        memcpy(m->direction[p], u[p], sizeof u[p]);
        m->share[p] = total[p].weight / all;
        m->concentration[p] = total[p].weight > 0.0 ? total[p].square / total[p].weight : 0.0;
        double se_deg[2];
        standard_error(f, u, n, p, &total[p], se_deg);
        m->se_deg[p] = se_deg[0];
        m->tilt_se_deg[p] = se_deg[1];
    }
    double least = LEAST_SHARE * (1.0 - m->share_z);
    if (n == 1 ? m->share[0] >= least : m->contrast >= LEAST_CONTRAST && fmin(m->share[0], m->share[1]) >= least)
        m->n = n;
    if (m->n > 0) order(m);
}

status main_directions_find(const struct volume *v, double material, struct thread_pool *pool,
                            const struct progress *progress, struct main_directions *m, struct error *err)
{
    struct direction_samples samples;
    *m = (struct main_directions){.n = 0};
    status s = direction_samples_take(v, material, pool, progress, &samples, err);
    if (s != STATUS_OK) return s;
    conclude(&samples, m);
    direction_samples_release(&samples);
    return STATUS_OK;
}
