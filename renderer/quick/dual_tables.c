#include "renderer/quick/dual_tables.h"
#include "renderer/transport/surface/parameter_sets.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Midpoints for lobes that are a degree wide or more: the rule's error is exp(-2 (pi width / step)^2). */
enum { N_FINE_THETA = 256, N_FINE_PHI = 180 };
enum { N_BLURRED = DUAL_N_THETA * DUAL_N_THETA * DUAL_N_PHI * 3 };
static const double theta_step = M_PI / (DUAL_N_THETA - 1), least_spread = 4 * M_PI / 180;

struct job {
    struct dual_tables *t;
    struct parameter_sets sets;
};

static double node_theta(size_t i)
{
    const double grazing = 0.5 * M_PI - 1e-3; /* along a fiber there are no azimuths */
    return fmax(-grazing, fmin(grazing, -0.5 * M_PI + theta_step * (double)i));
}

static double fine_theta(size_t i) { return M_PI * (((double)i + 0.5) / N_FINE_THETA - 0.5); }
static double fine_phi(size_t i) { return M_PI * ((double)i + 0.5) / N_FINE_PHI; }
static double spread_of(size_t k) { return least_spread * pow(2.0, 0.5 * (double)k); }
static double gauss(double x, double sd) { return exp(-0.5 * x * x / (sd * sd)) / (sd * sqrt(2 * M_PI)); }

static void direction(double theta, double phi, float d[3])
{
    d[0] = (float)sin(theta);
    d[1] = (float)(cos(theta) * cos(phi));
    d[2] = (float)(cos(theta) * sin(phi));
}

/* ---- averages ---- */

float dual_deep_fraction(float forward, float backward)
{
    float f2 = forward * forward, lost = fmaxf(1 - f2, 1e-6f), b3 = backward * backward * backward;
    return backward * f2 / lost + b3 * f2 / (lost * lost * lost);
}

/* Shift and width of the light that comes back from behind, for the mean fractions of the channels. The published
 * shift is a series in small ones. Wide lobes are cut at grazing angles, which shifts their means by more: the sum is
 * limited to what turns light across the fiber, where it tends to after many scatterings. */
static void fill_deep(struct dual_average *a, double theta_i)
{
    float f = 0, b = 0;
    for (int c = 0; c < 3; c++) {
        a->deep[c] = dual_deep_fraction(a->forward[c], a->backward[c]);
        f += a->forward[c] / 3;
        b += a->backward[c] / 3;
    }
    float f2 = f * f, b2 = b * b, lost = fmaxf(1 - f2, 1e-6f), b3 = b2 * b;
    float of_back = 1 - 2 * b2 / (lost * lost), of_front = (2 * lost * lost + 4 * f2 * b2) / (lost * lost * lost);
    float most = fmaxf(fabsf((float)theta_i), 10 * (float)(M_PI / 180));
    a->shift_deep_rad = fminf(fmaxf(a->shift_backward_rad * of_back + a->shift_forward_rad * of_front, -most), most);
    float vf = a->var_forward_rad2, vb = a->var_backward_rad2;
    float width = b > 0 ? (1 + 0.7f * f2) * (b * sqrtf(2 * vf + vb) + b3 * sqrtf(2 * vf + 3 * vb)) /
                              (b + b3 * (2 * sqrtf(vf) + 3 * sqrtf(vb)))
                        : 0;
    a->var_deep_rad2 = width * width;
}

/* Moments of theta_o + theta_i over half a turn. */
struct moments {
    double energy, first, second;
};

static void moments_add(struct moments *m, double energy, double sum)
{
    m->energy += energy;
    m->first += energy * sum;
    m->second += energy * sum * sum;
}

static void moments_end(const struct moments *m, float *shift, float *variance)
{
    double mean = m->energy > 0 ? m->first / m->energy : 0;
    *shift = (float)mean;
    *variance = m->energy > 0 ? (float)(m->second / m->energy - mean * mean) : 0;
}

/* The mean of equation 2.18 over the incident azimuths of half a turn leaves of an azimuth phi the share |phi| / pi
 * in the half away from the light. */
static void fill_average(const struct scattering_model *m, const struct scattering_state *state, double theta_i,
                         struct dual_average *a)
{
    struct moments ahead = {0}, back = {0};
    double forward[3] = {0}, backward[3] = {0}, cell = 2 * (M_PI / N_FINE_THETA) * (M_PI / N_FINE_PHI);
    float wi[3], wo[3], rgb[3];
    direction(theta_i, 0, wi);
    for (size_t i = 0; i < N_FINE_THETA; i++)
        for (size_t k = 0; k < N_FINE_PHI; k++) {
            double theta = fine_theta(i), phi = fine_phi(k), weight = cell * cos(theta) * cos(theta), all = 0;
            direction(theta, phi, wo);
            m->eval(state, wi, wo, rgb, NULL);
            for (int c = 0; c < 3; c++) {
                double energy = weight * (double)rgb[c];
                forward[c] += energy * phi * M_1_PI;
                backward[c] += energy * (1 - phi * M_1_PI);
                all += energy;
            }
            moments_add(&ahead, all * phi * M_1_PI, theta + theta_i);
            moments_add(&back, all * (1 - phi * M_1_PI), theta + theta_i);
        }
    for (int c = 0; c < 3; c++) {
        a->forward[c] = (float)forward[c];
        a->backward[c] = (float)backward[c];
    }
    moments_end(&ahead, &a->shift_forward_rad, &a->var_forward_rad2);
    moments_end(&back, &a->shift_backward_rad, &a->var_backward_rad2);
    fill_deep(a, theta_i);
}

/* ---- the blurred S ---- */

/* Integral of an even function of period 2 pi from 0 to x in [0, pi]; sum[k]: to the k-th step. */
static double integral_to(double sum[N_FINE_PHI + 1][3], double x, int c)
{
    double at = x / M_PI * N_FINE_PHI;
    size_t k = at < N_FINE_PHI ? (size_t)at : N_FINE_PHI - 1;
    double t = at - (double)k;
    return (1 - t) * sum[k][c] + t * sum[k + 1][c];
}

/* Mean of S over half a turn of incident azimuths about each of the table's azimuths. */
static void average_azimuths(const struct scattering_model *m, const struct scattering_state *state, const float wo[3],
                             double theta_i, double out[DUAL_N_PHI][3])
{
    double sum[N_FINE_PHI + 1][3] = {{0}};
    for (size_t k = 0; k < N_FINE_PHI; k++) {
        float wi[3], rgb[3];
        direction(theta_i, fine_phi(k), wi);
        m->eval(state, wi, wo, rgb, NULL);
        for (int c = 0; c < 3; c++) sum[k + 1][c] = sum[k][c] + (double)rgb[c] * M_PI / N_FINE_PHI;
    }
    for (size_t k = 0; k < DUAL_N_PHI; k++)
        for (int c = 0; c < 3; c++) {
            double phi = M_PI * (double)k / (DUAL_N_PHI - 1), from = phi - M_PI_2, to = phi + M_PI_2;
            double below = from < 0 ? integral_to(sum, -from, c) : -integral_to(sum, from, c);
            double above =
                to <= M_PI ? integral_to(sum, to, c) : 2 * sum[N_FINE_PHI][c] - integral_to(sum, 2 * M_PI - to, c);
            out[k][c] = (below + above) * M_1_PI;
        }
}

/* The part of the table for one theta_o. The weights g cos^2 keep the light that meets the fiber. */
static void fill_blurred(const struct scattering_model *m, const struct scattering_state *state, size_t i_theta_o,
                         float *table)
{
    static const size_t n_entry = DUAL_N_PHI * 3;
    double fine[N_FINE_THETA][DUAL_N_PHI][3];
    float wo[3];
    direction(node_theta(i_theta_o), 0, wo);
    for (size_t i = 0; i < N_FINE_THETA; i++) average_azimuths(m, state, wo, fine_theta(i), fine[i]);
    for (size_t s = 0; s < DUAL_N_SPREAD; s++)
        for (size_t d = 0; d < DUAL_N_THETA; d++) {
            double sum[DUAL_N_PHI * 3] = {0}, all = 0;
            for (size_t i = 0; i < N_FINE_THETA; i++) {
                double theta = fine_theta(i), weight = gauss(theta - node_theta(d), spread_of(s));
                weight *= cos(theta) * cos(theta);
                all += weight;
                for (size_t k = 0; k < n_entry; k++) sum[k] += weight * fine[i][k / 3][k % 3];
            }
            float *out = table + ((s * DUAL_N_THETA + i_theta_o) * DUAL_N_THETA + d) * n_entry;
            for (size_t k = 0; k < n_entry; k++) out[k] = (float)(sum[k] / all);
        }
}

static void fill_norm(struct dual_tables *t)
{
    for (size_t s = 0; s < DUAL_N_SPREAD; s++)
        for (size_t d = 0; d < DUAL_N_THETA; d++) {
            double sum = 0;
            for (size_t i = 0; i < N_FINE_THETA; i++)
                sum += gauss(fine_theta(i) - node_theta(d), spread_of(s)) * pow(cos(fine_theta(i)), 2) * M_PI /
                       N_FINE_THETA;
            t->norm[s * DUAL_N_THETA + d] = (float)sum;
        }
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct job *j = context;
    size_t i_set = i_task / DUAL_N_THETA, i = i_task % DUAL_N_THETA;
    const struct scattering_state *state = j->sets.state[i_set];
    fill_average(j->sets.model, state, node_theta(i), &j->t->average[i_task]);
    fill_blurred(j->sets.model, state, i, j->t->blurred + i_set * DUAL_N_SPREAD * N_BLURRED);
}

status dual_tables_init(struct dual_tables *t, const struct scene *scene, const struct scattering_model *model,
                        const double *param, size_t n_set, struct thread_pool *pool, const struct progress *progress,
                        struct error *err)
{
    struct job j = {.t = t};
    memset(t, 0, sizeof *t);
    if (scattering_frame_reason(model) != NULL)
        return error_set_field(err, STATUS_INVALID, "model", "cannot render model '%s' by dual scattering: %s",
                               model->id, scattering_frame_reason(model));
    status st = parameter_sets_init(&j.sets, scene, model, param, n_set, err);
    t->n_set = j.sets.n;
    t->average = calloc(t->n_set * DUAL_N_THETA + 1, sizeof *t->average);
    t->blurred = calloc(t->n_set * DUAL_N_SPREAD * N_BLURRED + 1, sizeof *t->blurred);
    t->norm = calloc(DUAL_N_SPREAD * DUAL_N_THETA, sizeof *t->norm);
    if (st == STATUS_OK && (t->average == NULL || t->blurred == NULL || t->norm == NULL))
        st = error_set(err, STATUS_NO_MEMORY, "cannot prepare dual scattering: out of memory");
    if (st == STATUS_OK) {
        fill_norm(t);
        st = thread_pool_run(pool, t->n_set * DUAL_N_THETA, run_task, &j, progress);
        if (st != STATUS_OK) error_set(err, st, "preparing dual scattering was cancelled");
    }
    parameter_sets_release(&j.sets);
    return st;
}

void dual_tables_release(struct dual_tables *t)
{
    free(t->average);
    free(t->blurred);
    free(t->norm);
    memset(t, 0, sizeof *t);
}

/* ---- looking up ---- */

/* Place in a table of n entries: index of the lower one, and the share of the upper one. */
struct place {
    size_t i;
    float t;
};

static struct place place_in(float x, size_t n)
{
    float most = (float)(n - 1);
    x = x > 0 ? (x < most ? x : most) : 0;
    size_t i = (size_t)x < n - 1 ? (size_t)x : n - 2;
    return (struct place){i, x - (float)i};
}

static struct place theta_place(float theta)
{
    return place_in((theta + (float)M_PI_2) / (float)theta_step, DUAL_N_THETA);
}

static struct place spread_place(float variance)
{
    const float least2 = (float)(least_spread * least_spread);
    return place_in(variance > least2 ? log2f(variance / least2) : 0, DUAL_N_SPREAD);
}

void dual_average_at(const struct dual_tables *t, size_t i_set, float theta, struct dual_average *out)
{
    struct place p = theta_place(theta);
    float a[sizeof *out / sizeof(float)], b[sizeof *out / sizeof(float)];
    memcpy(a, &t->average[i_set * DUAL_N_THETA + p.i], sizeof a);
    memcpy(b, &t->average[i_set * DUAL_N_THETA + p.i + 1], sizeof b);
    for (size_t k = 0; k < sizeof a / sizeof *a; k++) a[k] += p.t * (b[k] - a[k]);
    memcpy(out, a, sizeof a);
}

void dual_blurred_at(const struct dual_tables *t, size_t i_set, float theta_d, float theta_o, float phi, float variance,
                     float s_rgb[3])
{
    struct place p[4] = {spread_place(variance), theta_place(theta_o), theta_place(theta_d),
                         place_in(fabsf(phi) * (float)((DUAL_N_PHI - 1) * M_1_PI), DUAL_N_PHI)};
    const float *table = t->blurred + i_set * DUAL_N_SPREAD * N_BLURRED;
    for (int c = 0; c < 3; c++) s_rgb[c] = 0;
    for (unsigned corner = 0; corner < 16; corner++) {
        size_t at[4];
        float weight = 1;
        for (unsigned a = 0; a < 4; a++) {
            bool upper = corner >> a & 1;
            at[a] = p[a].i + upper;
            weight *= upper ? p[a].t : 1 - p[a].t;
        }
        const float *rgb = table + (((at[0] * DUAL_N_THETA + at[1]) * DUAL_N_THETA + at[2]) * DUAL_N_PHI + at[3]) * 3;
        for (int c = 0; c < 3; c++) s_rgb[c] += weight * rgb[c];
    }
}

void dual_deep_lobe(const struct dual_tables *t, const struct dual_average *a, float theta_i, float theta_o,
                    float variance, float s_rgb[3])
{
    const float least2 = (float)(least_spread * least_spread),
                most2 = (float)(spread_of(DUAL_N_SPREAD - 1) * spread_of(DUAL_N_SPREAD - 1));
    float all = fminf(fmaxf(a->var_deep_rad2 + variance, least2), most2), middle = a->shift_deep_rad - theta_i;
    struct place p[2] = {spread_place(all), theta_place(middle)};
    const float *low = t->norm + p[0].i * DUAL_N_THETA + p[1].i, *high = low + DUAL_N_THETA;
    float norm =
        (1 - p[0].t) * (low[0] + p[1].t * (low[1] - low[0])) + p[0].t * (high[0] + p[1].t * (high[1] - high[0]));
    float x = theta_o - middle, g = expf(-0.5f * x * x / all) / sqrtf((float)(2 * M_PI) * all);
    for (int c = 0; c < 3; c++) s_rgb[c] = a->deep[c] * g / ((float)M_PI * norm);
}
