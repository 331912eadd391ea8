#include "geometry/orientation/main_directions.h"
#include "base/angle.h"
#include "base/small_matrix.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLUR = 2,   /* reach of the blur of standard deviation 1 voxel */
    WINDOW = 5, /* reach of the tensor's window */
    INNER = 16,
    STEP = 4, /* samples are taken at every 4th of the 16 voxels along each axis */
    BUFFER = INNER + 2 * (WINDOW + 1 + BLUR),
    PER_BRICK = (INNER / STEP) * (INNER / STEP) * (INNER / STEP),
    MAX_BRICK = 1600,
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
static const double LEAST_Z = 0.35; /* share of fibers along z at which the axes are wrong if warp or weft is missing */

struct sample {
    float d[3], weight;
};

struct finder {
    const struct volume *v;
    float material;
    size_t n_brick, *first; /* corner voxels of bricks, in the order x, y, z */
    size_t n_column;        /* number of columns of bricks in x and y */
    struct sample *sample;  /* PER_BRICK per brick; weight 0: no sample */
    float *scratch;         /* two buffers per thread */
};

static const size_t EDGE = BUFFER, CUBE = (size_t)BUFFER * BUFFER * BUFFER;

static size_t cube_index(size_t i, size_t j, size_t k) { return (k * EDGE + j) * EDGE + i; }

static size_t clamped(size_t corner, size_t i, size_t n)
{
    size_t shift = WINDOW + 1 + BLUR, at = corner + i;
    return at < shift ? 0 : at - shift < n ? at - shift : n - 1;
}

static void copy_brick(const struct finder *f, const size_t corner[3], float *out)
{
    const size_t *n = f->v->n;
    float least = f->material;
    scratch_keep_within(f->v->space);
    for (size_t k = 0; k < EDGE; k++)
        for (size_t j = 0; j < EDGE; j++)
            for (size_t i = 0; i < EDGE; i++) {
                float x = f->v->density[volume_index(n, clamped(corner[0], i, n[0]), clamped(corner[1], j, n[1]),
                                                     clamped(corner[2], k, n[2]))];
                out[cube_index(i, j, k)] = x;
                if (isfinite(x) && x < least) least = x;
            }
    for (size_t i = 0; i < CUBE; i++)
        if (!isfinite(out[i])) out[i] = least;
}

/* Blurs by a Gaussian of one voxel along all three axes. A border of BLUR voxels keeps its values. */
static void blur_brick(float *a, float *b)
{
    static const float weight[2 * BLUR + 1] = {0.0545f, 0.2442f, 0.4026f, 0.2442f, 0.0545f};
    const size_t stride[3] = {1, EDGE, EDGE * EDGE};
    for (int axis = 0; axis < 3; axis++) {
        memcpy(b, a, CUBE * sizeof *b);
        for (size_t at = BLUR * stride[axis]; at + BLUR * stride[axis] < CUBE; at++) {
            float sum = 0.0f;
            for (size_t o = 0; o <= 2 * BLUR; o++) sum += weight[o] * b[at + o * stride[axis] - BLUR * stride[axis]];
            a[at] = sum;
        }
    }
}

/* Direction of least change around a place of the buffer; its weight states how clearly it is a single line. The
 * window is cut at the faces of the volume, because repeated voxels beyond them would not change along one axis. */
static void tensor_sample(const struct finder *f, const size_t corner[3], const float *a, const size_t at[3],
                          struct sample *s)
{
    const size_t stride[3] = {1, EDGE, EDGE * EDGE}, shift = WINDOW + 1 + BLUR;
    double sum[6] = {0.0}, scale[3];
    size_t from[3], to[3];
    for (int c = 0; c < 3; c++) {
        size_t end = f->v->n[c] + shift > corner[c] + 1 ? f->v->n[c] + shift - corner[c] - 1
                                                        : 0; /* one before the last inner voxel */
        from[c] = corner[c] + at[c] < shift + WINDOW + 1 ? shift + 1 - corner[c] : at[c] - WINDOW;
        to[c] = at[c] + WINDOW + 1 < end ? at[c] + WINDOW + 1 : end;
        scale[c] = f->v->voxel_size_m[0] / f->v->voxel_size_m[c];
    }
    for (size_t k = from[2]; k < to[2]; k++)
        for (size_t j = from[1]; j < to[1]; j++) {
            float row[6] = {0.0f};
            for (size_t i = from[0]; i < to[0]; i++) {
                const float *p = a + cube_index(i, j, k);
                float gx = p[1] - *(p - 1), gy = p[stride[1]] - *(p - stride[1]), gz = p[stride[2]] - *(p - stride[2]);
                row[0] += gx * gx, row[1] += gy * gy, row[2] += gz * gz;
                row[3] += gx * gy, row[4] += gx * gz, row[5] += gy * gz;
            }
            for (int c = 0; c < 6; c++) sum[c] += (double)row[c];
        }
    double m[3][3] = {{sum[0], sum[3], sum[4]}, {sum[3], sum[1], sum[5]}, {sum[4], sum[5], sum[2]}};
    for (int p = 0; p < 3; p++)
        for (int q = 0; q < 3; q++) m[p][q] *= scale[p] * scale[q];
    float vector[3][3], value[3];
    small_eigen_3(m, vector, value);
    float clear = value[1] + value[0] > 0.0f ? (value[1] - value[0]) / (value[1] + value[0]) : 0.0f;
    memcpy(s->d, vector[0], sizeof s->d);
    s->weight = clear * clear;
}

static void sample_brick(void *context, size_t i_brick, size_t i_thread)
{
    const struct finder *f = context;
    float *a = f->scratch + i_thread * 2 * CUBE, *b = a + CUBE;
    struct sample *out = f->sample + i_brick * PER_BRICK;
    size_t n = 0, at[3];
    scratch_keep_within(f->v->space);
    copy_brick(f, f->first + 3 * i_brick, a);
    blur_brick(a, b);
    const size_t low = WINDOW + 1 + BLUR;
    for (at[2] = low; at[2] < low + INNER; at[2] += STEP)
        for (at[1] = low; at[1] < low + INNER; at[1] += STEP)
            for (at[0] = low; at[0] < low + INNER; at[0] += STEP)
                if (a[cube_index(at[0], at[1], at[2])] >= f->material)
                    tensor_sample(f, f->first + 3 * i_brick, a, at, &out[n++]);
}

/* Places bricks side by side, or spread evenly if there are more than MAX_BRICK of them. */
static status place_bricks(struct finder *f, struct error *err)
{
    size_t n[3], gap[3];
    for (int a = 0; a < 3; a++) {
        gap[a] = INNER;
        n[a] = f->v->n[a] / gap[a] > 0 ? f->v->n[a] / gap[a] : 1;
    }
    while (n[0] * n[1] * n[2] > MAX_BRICK) {
        int longest = n[0] >= n[1] && n[0] >= n[2] ? 0 : n[1] >= n[2] ? 1 : 2;
        n[longest]--;
    }
    f->n_column = n[0] * n[1];
    f->n_brick = f->n_column * n[2];
    f->first = malloc(3 * f->n_brick * sizeof *f->first);
    f->sample = calloc(f->n_brick * PER_BRICK, sizeof *f->sample);
    if (f->first == NULL || f->sample == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot find main directions: out of memory");
    for (size_t b = 0; b < f->n_brick; b++) {
        const size_t i[3] = {b % n[0], b / n[0] % n[1], b / n[0] / n[1]};
        for (int a = 0; a < 3; a++) {
            size_t room = f->v->n[a] > INNER ? f->v->n[a] - INNER : 0;
            f->first[3 * b + (size_t)a] = n[a] > 1 ? i[a] * room / (n[a] - 1) : room / 2;
        }
    }
    return STATUS_OK;
}

/* ---- peaks of the angle within the plane of x and y ---- */

static double angle_of(const struct sample *s) { return atan2((double)s->d[1], (double)s->d[0]); }

/* Difference of the angles of two lines in radians, within -pi/2..pi/2. */
static double line_difference(double a, double b)
{
    double d = a - b;
    return d - M_PI * round(d / M_PI);
}

static bool in_plane(const struct sample *s)
{
    return s->weight > 0.0f && hypot((double)s->d[0], (double)s->d[1]) >= LEAST_IN_PLANE;
}

static void make_histogram(const struct finder *f, double height[N_BIN])
{
    double raw[N_BIN] = {0.0};
    for (size_t i = 0; i < f->n_brick * PER_BRICK; i++)
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
static void add_brick(const struct finder *f, size_t b, double u[2][3], size_t n, size_t p, struct vector_sum *t)
{
    double own = atan2(u[p][1], u[p][0]), other = atan2(u[1 - p][1], u[1 - p][0]);
    for (size_t i = b * PER_BRICK; i < (b + 1) * PER_BRICK; i++) {
        const struct sample *s = &f->sample[i];
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

static void iterate_means(const struct finder *f, double u[2][3], size_t n, struct vector_sum total[2])
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
static void standard_error(const struct finder *f, double u[2][3], size_t n, size_t p, const struct vector_sum *total,
                           double se_deg[2])
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
static void count_samples(const struct finder *f, struct main_directions *m, double *all)
{
    double along_z = 0.0;
    *all = 0.0;
    for (size_t i = 0; i < f->n_brick * PER_BRICK; i++) {
        if (!(f->sample[i].weight > 0.0f)) continue;
        *all += (double)f->sample[i].weight;
        along_z += in_plane(&f->sample[i]) ? 0.0 : (double)f->sample[i].weight;
        m->n_sample++;
    }
    m->n_brick = f->n_brick;
    m->share_z = *all > 0.0 ? along_z / *all : 0.0;
}

static void conclude(const struct finder *f, struct main_directions *m)
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
    struct finder f = {.v = v, .material = (float)material};
    *m = (struct main_directions){.n = 0};
    status s = place_bricks(&f, err);
    f.scratch = malloc(thread_pool_n_thread(pool) * 2 * CUBE * sizeof *f.scratch);
    if (s == STATUS_OK && f.scratch == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot find main directions: out of memory");
    if (s == STATUS_OK) {
        s = thread_pool_run(pool, f.n_brick, sample_brick, &f, progress);
        if (s != STATUS_OK) error_set(err, s, "finding main directions was cancelled");
    }
    if (s == STATUS_OK) conclude(&f, m);
    free(f.first);
    free(f.sample);
    free(f.scratch);
    return s;
}

/* ---- matrix ---- */

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static double length(const double a[3]) { return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

/* Writes the rows of the inverse of the matrix with columns u, v, w. */
static void inverse_of_columns(const double u[3], const double v[3], const double w[3], double out[9])
{
    double vw[3], wu[3], uv[3];
    cross(v, w, vw);
    cross(w, u, wu);
    cross(u, v, uv);
    double det = u[0] * vw[0] + u[1] * vw[1] + u[2] * vw[2];
    for (int a = 0; a < 3; a++) {
        out[a] = vw[a] / det;
        out[3 + a] = wu[a] / det;
        out[6 + a] = uv[a] / det;
    }
}

/* Writes the columns of the identity rotated by the shortest way that brings `axis` to u. */
static void turned_frame(const double u[3], int axis, double column[3][3])
{
    double e[3] = {0.0}, k[3];
    e[axis] = 1.0;
    cross(e, u, k);
    double c = u[axis];
    for (int b = 0; b < 3; b++) { /* rotation formula of Rodrigues */
        double x[3] = {0.0}, kx[3], along = 0.0;
        x[b] = 1.0;
        cross(k, x, kx);
        for (int a = 0; a < 3; a++) along += k[a] * x[a];
        for (int a = 0; a < 3; a++) column[b][a] = c * x[a] + kx[a] + k[a] * along / (1.0 + c);
    }
}

/* Puts a direction without a repeat into the plane of x and y: less than a repeat of crimped yarns may lean, so the
 * part out of the plane is not a tilt of the cloth. */
static void flattened(const struct main_directions *m, int p, double u[3])
{
    const double flat[3] = {m->direction[p][0], m->direction[p][1], m->repeat_m[p] > 0.0 ? m->direction[p][2] : 0.0};
    unit(flat, u);
}

static void align_one(const struct main_directions *m, int axis, const double u[3], struct alignment *a)
{
    double column[3][3];
    turned_frame(u, axis, column);
    inverse_of_columns(column[0], column[1], column[2], a->matrix);
    a->rotation_deg = angle_to_deg(axis == 0 ? atan2(u[1], u[0]) : atan2(-u[0], u[1]));
    a->tilt_deg = angle_to_deg(asin(fmin(1.0, fabs(u[2]))));
    a->se_deg = m->se_deg[axis];
    a->tilt_se_deg = m->tilt_se_deg[axis];
}

void alignment_from_directions(const struct main_directions *m, struct alignment *a)
{
    *a = (struct alignment){.outcome = ALIGN_NO_DIRECTION, .matrix = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}};
    if (m->n < 2 && m->share_z > LEAST_Z) a->outcome = ALIGN_OTHER_AXES;
    if (m->n == 0 || a->outcome == ALIGN_OTHER_AXES) return;
    for (int p = 0; p < 2; p++) {
        const double *u = m->direction[p];
        if (length(u) > 0.5 && (fabs(u[2]) > 0.7072 || u[p] < 0.5)) {
            a->outcome = ALIGN_OTHER_AXES;
            return;
        }
    }
    a->outcome = ALIGN_DONE;
    double u[3], v[3];
    flattened(m, 0, u);
    flattened(m, 1, v);
    if (m->n == 1) {
        align_one(m, length(u) > 0.5 ? 0 : 1, length(u) > 0.5 ? u : v, a);
        return;
    }
    double w[3], dot = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    cross(u, v, w);
    double norm = length(w);
    for (int i = 0; i < 3; i++) w[i] /= norm;
    inverse_of_columns(u, v, w, a->matrix);
    a->rotation_deg = angle_to_deg(atan2(u[1], u[0]));
    a->shear_deg = angle_to_deg(acos(dot)) - 90.0;
    a->tilt_deg = angle_to_deg(acos(fmin(1.0, fabs(w[2]))));
    a->se_deg = fmax(m->se_deg[0], m->se_deg[1]);
    a->tilt_se_deg = fmax(m->tilt_se_deg[0], m->tilt_se_deg[1]);
}
