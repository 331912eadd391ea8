#include "renderer/scattering/models/wave/speckle_instances.h"
#include "renderer/scattering/models/wave/solver/wave_mean.h"

#include <stdlib.h>
#include <string.h>

enum { N_OUTLINE = 8, N_LENGTH = 3, N_CHANNEL = 3 };
enum {
    N_ANGLE = 720,
    N_CLUSTER = 6,
    PER_CLUSTER = 16,
    N_WAVE = N_CLUSTER * PER_CLUSTER
}; /* waves half a degree apart */
enum { N_TASK = N_OUTLINE * N_CHANNEL };

#define PER_WAVE 3 /* nodes: errors below 1e-3 of the forward amplitude */
#define SIZE_SPREAD 0.10
#define LENGTH_SPREAD 0.04
#define CLEAR 0.7 /* C_T: the start of the models */

/* Light of one outline in one channel, by wave and angle from its travel direction; later f. */
struct field {
    float f[N_WAVE][N_ANGLE];
};

struct job {
    const struct wave_section *section;
    struct field *field; /* [outline][channel] */
    status status[N_TASK];
    struct error error[N_TASK];
};

/* Three points of a normal distribution, whose weights integrate polynomials up to the fifth degree. */
static const double length_at[N_LENGTH] = {-1.7320508075688772, 0, 1.7320508075688772},
                    length_weight[N_LENGTH] = {1.0 / 6, 2.0 / 3, 1.0 / 6};

/* Direction of travel in steps of the angle. No cluster is a turn of another by a third. */
static int wave_step(int i) { return i / PER_CLUSTER * (N_ANGLE / N_CLUSTER + 7) + i % PER_CLUSTER; }

static double angle_of(int step) { return 2 * M_PI * step / N_ANGLE; }

static void make_outline(const struct wave_section *section, size_t i_outline, struct wave_outline *o)
{
    const struct rng_key key = {0x737065636b6c65u, (uint32_t)i_outline, 0, 0};
    struct rng rng;
    double normal[2];
    rng_start(&rng, &key, 0, 0);
    rng_normal_pair(&rng, normal);
    section->outline(o);
    wave_outline_scale(o, section->radius_m * exp(SIZE_SPREAD * normal[0]) / sqrt(wave_outline_area(o) / M_PI));
    wave_outline_roughen(o, SPECKLE_HEIGHT_M, SPECKLE_LENGTH_M, &rng);
}

/* Adds the light of one wavelength and polarisation, so many times. */
static status add_light(const struct wave_problem *p, double times, struct field *field, struct error *err)
{
    struct wave_solver *s = NULL;
    double angle[N_WAVE], range[N_WAVE][2];
    for (int w = 0; w < N_WAVE; w++) {
        angle[w] = angle_of(wave_step(w));
        wave_outline_extent(p->outline, angle[w], range[w]);
    }
    status st = wave_solver_new(p, &s, err);
    if (st == STATUS_OK) st = wave_solver_solve(s, angle, N_WAVE, err);
    for (int j = 0; j < N_ANGLE && st == STATUS_OK; j++) {
        double complex t[N_WAVE];
        wave_solver_towards(s, angle_of(j), t);
        for (int w = 0; w < N_WAVE; w++) {
            const int d = (j - wave_step(w) % N_ANGLE + N_ANGLE) % N_ANGLE;
            const double complex left = t[w] - wave_shadow_amplitude(p->k, range[w], remainder(angle_of(d), 2 * M_PI));
            field->f[w][d] += (float)(times / p->k * (creal(left) * creal(left) + cimag(left) * cimag(left)));
        }
    }
    wave_solver_free(s);
    return st;
}

static void simulate(void *context, size_t i_task, size_t i_thread)
{
    struct job *job = context;
    const struct wave_section *section = job->section;
    struct wave_outline outline;
    status st = STATUS_OK;
    (void)i_thread;
    make_outline(section, i_task / N_CHANNEL, &outline);
    for (int l = 0; l < N_LENGTH; l++) {
        const double length_m = wave_length_m[i_task % N_CHANNEL] * exp(LENGTH_SPREAD * length_at[l]);
        const double k = 2 * M_PI / length_m;
        for (int field = 0; field < WAVE_N_FIELD && st == STATUS_OK; field++) {
            const struct wave_problem p = {&outline, k, section->index - I * log(CLEAR) / (4 * k * section->radius_m),
                                           (enum wave_field)field,
                                           wave_solver_nodes(&outline, k, section->index, PER_WAVE)};
            st = add_light(&p, length_weight[l], &job->field[i_task], &job->error[i_task]);
        }
    }
    job->status[i_task] = st;
}

/* Sums of a field of a channel over instances, made even. */
static void add_up(const struct field *field, int channel, double power, double sum[N_ANGLE])
{
    memset(sum, 0, N_ANGLE * sizeof *sum);
    for (int n = 0; n < N_OUTLINE; n++)
        for (int w = 0; w < N_WAVE; w++)
            for (int d = 0; d < N_ANGLE; d++) {
                const double x = 0.5 * pow((double)field[n * N_CHANNEL + channel].f[w][d], power);
                sum[d] += x;
                sum[(N_ANGLE - d) % N_ANGLE] += x;
            }
}

/* Mean of the instances' sum over the neighbours up to `reach`. */
static double smooth(const double sum[N_ANGLE], int d, int reach)
{
    double all = 0;
    for (int e = -reach; e <= reach; e++) all += sum[(d + e + N_ANGLE) % N_ANGLE];
    return all / ((2 * reach + 1) * N_OUTLINE * N_WAVE);
}

/* By the angle from straight on: mean light, and mean square of its relative deviation. */
struct light {
    double mean[N_ANGLE], contrast2[N_ANGLE];
};

/* Makes (f - 1) / contrast of the light of a channel. */
static void standardise(struct field *field, int channel, struct light *light)
{
    enum { REACH = 2 };
    double sum[N_ANGLE];
    add_up(field, channel, 1, sum);
    for (int d = 0; d < N_ANGLE; d++) light->mean[d] = smooth(sum, d, REACH);
    for (int n = 0; n < N_OUTLINE; n++)
        for (int w = 0; w < N_WAVE; w++)
            for (int d = 0; d < N_ANGLE; d++) {
                float *f = &field[n * N_CHANNEL + channel].f[w][d];
                *f = *f / (float)light->mean[d] - 1;
            }
    add_up(field, channel, 2, sum);
    for (int d = 0; d < N_ANGLE; d++) light->contrast2[d] = smooth(sum, d, 0);
    for (int n = 0; n < N_OUTLINE; n++)
        for (int w = 0; w < N_WAVE; w++)
            for (int d = 0; d < N_ANGLE; d++)
                field[n * N_CHANNEL + channel].f[w][d] /= (float)sqrt(light->contrast2[d]);
}

struct mean {
    double weights, sum;
};

static void mean_add(struct mean *m, double weight, double value)
{
    m->weights += weight;
    m->sum += weight * value;
}

static double mean_of(const struct mean *m) { return m->sum / m->weights; }

static int zone_of(int d) { return (d < N_ANGLE - d ? d : N_ANGLE - d) * SPECKLE_N_ZONE / (N_ANGLE / 2 + 1); }

/* Products of the deviations at pairs of directions. */
struct products {
    struct mean by_distance[SPECKLE_N_DISTANCE], between[2], memory, turned;
};

static void add_by_distance(struct products *p, double distance, double weight, float product)
{
    const int i = (int)lround(distance / SPECKLE_DISTANCE_STEP);
    if (i < SPECKLE_N_DISTANCE) mean_add(&p->by_distance[i], weight, (double)product);
}

/* All pairs whose first wave is this one. size: radius over wavelength. */
static void add_wave(struct products *p, const struct field *field, int w, const struct light *light, double size)
{
    enum { SHIFT = 4 /* 2 degrees */ };
    const int ahead = PER_CLUSTER - 1 - w % PER_CLUSTER;
    for (int d = 0; d < N_ANGLE; d++) {
        const float here = field->f[w][d];
        const double weight = light->mean[d], length = 2 * sin(0.5 * angle_of(d)); /* |wi + wo| */
        for (int e = 0; e < 2 * PER_CLUSTER; e++)                                  /* the camera moves */
            add_by_distance(p, 2 * sin(0.5 * angle_of(e)) * size, weight, here * field->f[w][(d + e) % N_ANGLE]);
        if (zone_of(d) == 0) continue;
        for (int e = 1; e <= ahead; e++) /* the fiber turns */
            add_by_distance(p, 2 * sin(0.5 * angle_of(e)) * size * length, weight, here * field->f[w + e][d]);
        if (ahead < SHIFT) continue;
        mean_add(&p->turned, weight, (double)(here * field->f[w + SHIFT][d]));
        mean_add(&p->memory, weight, (double)(here * field->f[w + SHIFT][(d + N_ANGLE - 2 * SHIFT) % N_ANGLE]));
    }
}

static void add_between_channels(struct products *p, const struct job *job, const struct light *light)
{
    for (int n = 0; n < N_OUTLINE; n++)
        for (int w = 0; w < N_WAVE; w++)
            for (int d = 0; d < N_ANGLE; d++)
                for (int c = 0; c < 2; c++) {
                    const struct field *f = &job->field[n * N_CHANNEL + c];
                    mean_add(&p->between[c], light->mean[d], (double)(f[0].f[w][d] * f[1].f[w][d]));
                }
}

static void evaluate(const struct job *job, struct light light[N_CHANNEL], struct speckle_statistics *out)
{
    struct products p = {0};
    struct mean zone[SPECKLE_N_ZONE] = {0};
    double all = 0;
    for (int c = 0; c < N_CHANNEL; c++) standardise(job->field, c, &light[c]);
    for (int i = 0; i < N_TASK; i++)
        for (int w = 0; w < N_WAVE; w++)
            add_wave(&p, &job->field[i], w, &light[i % N_CHANNEL],
                     job->section->radius_m / wave_length_m[i % N_CHANNEL]);
    add_between_channels(&p, job, &light[1]);
    for (int i = 0; i < SPECKLE_N_DISTANCE; i++) out->correlation[i] = mean_of(&p.by_distance[i]);
    for (int c = 0; c < N_CHANNEL; c++)
        for (int d = 0; d < N_ANGLE; d++) mean_add(&zone[zone_of(d)], light[c].mean[d], light[c].contrast2[d]);
    for (int z = 0; z < SPECKLE_N_ZONE; z++) all += zone[z].weights;
    for (int z = 0; z < SPECKLE_N_ZONE; z++) {
        out->zone_contrast2[z] = mean_of(&zone[z]);
        out->zone_share[z] = zone[z].weights / all;
    }
    memset(out->by_length, 0, sizeof out->by_length);
    for (int d = 0; d < N_ANGLE; d++) {
        const int i = (int)(SPECKLE_N_LENGTH * sin(0.5 * angle_of(d)));
        out->by_length[i < SPECKLE_N_LENGTH ? i : SPECKLE_N_LENGTH - 1] +=
            light[1].mean[d] / p.between[0].weights * N_OUTLINE * N_WAVE;
    }
    for (int c = 0; c < 2; c++) out->between_channels[c] = mean_of(&p.between[c]);
    out->memory = mean_of(&p.memory);
    out->turned = mean_of(&p.turned);
}

status speckle_instances(const struct wave_section *section, struct thread_pool *pool, struct speckle_statistics *out,
                         struct error *err)
{
    struct light light[N_CHANNEL];
    struct job *job = calloc(1, sizeof *job);
    if (job != NULL) job->field = calloc(N_TASK, sizeof *job->field);
    if (job == NULL || job->field == NULL) {
        free(job);
        return error_set(err, STATUS_NO_MEMORY, "cannot simulate speckle: out of memory");
    }
    job->section = section;
    status st = thread_pool_run(pool, N_TASK, simulate, job, NULL);
    for (int i = 0; i < N_TASK && st == STATUS_OK; i++) {
        st = job->status[i];
        if (st != STATUS_OK) *err = job->error[i];
    }
    if (st == STATUS_OK) evaluate(job, light, out);
    free(job->field);
    free(job);
    return st;
}
