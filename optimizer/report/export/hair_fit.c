#include "optimizer/report/export/hair_fit.h"
#include "renderer/scattering/fresnel.h"

#include <math.h>
#include <nlopt.h>
#include <stdlib.h>
#include <string.h>

enum {
    N_THETA_O = 6,
    N_THETA_I = 28,
    N_PHI = 18,
    N_TURN = 4,
    N_VIEW = 32,    /* places across a near field's width */
    N_OF_LOBES = 6, /* unknowns of one hair material */
    N_UNKNOWN = HAIR_FIT_N_BLEND * N_OF_LOBES + 1,
    N_START = 4,
    N_SECOND = 5, /* starts of the second material */
    N_EVALUATION = 1000,
    N_EVALUATION_BLEND = 4000,
    N_WIDTH = 12
};
#define N_VALUE ((size_t)N_THETA_O * N_THETA_I * N_PHI * 3)
/* Cloth scatters light many times, and returning light has turned round in some fiber. So the scattered share of light,
 * against the absorbed share, counts more than the shapes of the lobes, and the share that turns back as much. */
static const double albedo_weight = 4.0, turned_weight = 1.0, least_absorbed = 0.1, least_turned = 0.005;
enum side { TURNS_BACK, GOES_ON, N_SIDE };
/* roughness, roughness, index, ln absorption of each material; share of the second one */
#define LOWER 0.03, 0.05, 1.05, -9.0, -9.0, -9.0
#define UPPER 1.0, 1.0, 3.0, 4.0, 4.0, 4.0
static const double lower[N_UNKNOWN] = {LOWER, LOWER, 0.0}, upper[N_UNKNOWN] = {UPPER, UPPER, 0.95};

struct target {
    double theta_o[N_THETA_O], theta_i[N_THETA_I], phi[N_PHI];
    double weight_o[N_THETA_O], weight_i[N_THETA_I]; /* of solid angles; phi is uniform over half a turn, doubled */
    double *fiber, *lobes;                           /* [N_THETA_O][N_THETA_I][N_PHI][3] */
    double share[N_THETA_O][N_SIDE][3];
};

static void direction(double theta, double phi, float w[3])
{
    w[0] = (float)sin(theta);
    w[1] = (float)(cos(theta) * cos(phi));
    w[2] = (float)(cos(theta) * sin(phi));
}

/* Midpoints of equal steps of sin th, so that all have the same solid angle. Light along the fiber is left out. */
static void make_directions(struct target *t)
{
    for (int i = 0; i < N_THETA_O; i++) {
        t->theta_o[i] = asin((i + 0.5) / N_THETA_O);
        t->weight_o[i] = cos(t->theta_o[i]) / N_THETA_O;
    }
    for (int i = 0; i < N_THETA_I; i++) {
        t->theta_i[i] = asin(-1.0 + (2.0 * i + 1.0) / N_THETA_I);
        t->weight_i[i] = 2.0 / N_THETA_I * 2.0 * M_PI / N_PHI;
    }
    for (int k = 0; k < N_PHI; k++) t->phi[k] = M_PI * (k + 0.5) / N_PHI;
}

static void add_fiber(const struct scattering_model *m, const struct scattering_state *state, struct target *t,
                      size_t i_value, int o, int i, int k)
{
    double *at = t->fiber + i_value;
    const int n = m->near_field ? N_VIEW : 2 * N_TURN;
    for (int turn = 0; turn < n; turn++) { /* the other azimuth of each pair mirrors the first */
        float wi[3], wo[3], s[3];
        double from = m->near_field ? scattering_view_azimuth_rad(m, turn, n) : M_PI * (turn + 0.5) / n;
        direction(t->theta_o[o], from, wo);
        direction(t->theta_i[i], from + (turn % 2 == 0 ? t->phi[k] : -t->phi[k]), wi);
        m->eval(state, wi, wo, s, NULL);
        for (int c = 0; c < 3; c++) at[c] += (double)s[c] * cos(t->theta_i[i]) / n;
    }
}

/* Shares of the light from th_o that leave on the side of where it came from, and on the other side. */
static void add_shares(const struct target *t, const double *value, double share[N_THETA_O][N_SIDE][3])
{
    memset(share, 0, N_THETA_O * sizeof *share);
    for (int o = 0; o < N_THETA_O; o++)
        for (int i = 0; i < N_THETA_I; i++)
            for (int k = 0; k < N_PHI; k++, value += 3)
                for (int c = 0; c < 3; c++)
                    share[o][cos(t->phi[k]) > 0.0 ? TURNS_BACK : GOES_ON][c] += value[c] * t->weight_i[i];
}

static void fill_fiber(const struct scattering_model *m, const struct scattering_state *state, struct target *t)
{
    size_t at = 0;
    for (int o = 0; o < N_THETA_O; o++)
        for (int i = 0; i < N_THETA_I; i++)
            for (int k = 0; k < N_PHI; k++, at += 3) add_fiber(m, state, t, at, o, i, k);
    add_shares(t, t->fiber, t->share);
}

static struct hair_blend blend_of(const double x[N_UNKNOWN])
{
    struct hair_blend b = {.second_share = x[N_UNKNOWN - 1]};
    for (int k = 0; k < HAIR_FIT_N_BLEND; k++, x += N_OF_LOBES)
        b.lobes[k] = (struct hair_lobes){x[0], x[1], x[2], {exp(x[3]), exp(x[4]), exp(x[5])}};
    return b;
}

static void fill_blend(const struct hair_blend *b, struct target *t)
{
    const double share[HAIR_FIT_N_BLEND] = {1.0 - b->second_share, b->second_share};
    const struct hair_directions to = {t->theta_i, t->phi, N_THETA_I, N_PHI};
    memset(t->lobes, 0, N_VALUE * sizeof(double));
    for (size_t o = 0; o < N_THETA_O; o++)
        for (int k = 0; k < HAIR_FIT_N_BLEND; k++)
            if (share[k] > 0.0)
                hair_lobes_density(&b->lobes[k], share[k], t->theta_o[o], &to, t->lobes + o * N_THETA_I * N_PHI * 3);
}

/* Mean squared difference over the mean square of the fiber's. */
static double shape_square(const struct target *t)
{
    double difference = 0.0, whole = 0.0;
    const double *a = t->fiber, *b = t->lobes;
    for (int o = 0; o < N_THETA_O; o++)
        for (int j = 0; j < N_THETA_I * N_PHI * 3; j++, a++, b++) {
            difference += t->weight_o[o] * (*a - *b) * (*a - *b);
            whole += t->weight_o[o] * *a * *a;
        }
    return difference / whole;
}

static double share_square(const struct target *t)
{
    double share[N_THETA_O][N_SIDE][3], sum = 0.0, weight = 0.0;
    add_shares(t, t->lobes, share);
    for (int o = 0; o < N_THETA_O; o++)
        for (int c = 0; c < 3; c++) {
            double turned = t->share[o][TURNS_BACK][c], kept = turned + t->share[o][GOES_ON][c];
            double d = (share[o][TURNS_BACK][c] - turned) / fmax(turned, least_turned);
            double e = (share[o][TURNS_BACK][c] + share[o][GOES_ON][c] - kept) / (1.0 - kept + least_absorbed);
            sum += t->weight_o[o] * (turned_weight * d * d + albedo_weight * e * e);
            weight += t->weight_o[o];
        }
    return sum / weight;
}

/* Gives one material where n = N_OF_LOBES. */
static double objective(unsigned n, const double *x, double *gradient, void *data)
{
    (void)gradient;
    struct target *t = data;
    double all[N_UNKNOWN] = {0};
    memcpy(all, x, n * sizeof *x);
    const struct hair_blend b = blend_of(all);
    fill_blend(&b, t);
    return shape_square(t) + share_square(t);
}

/* Takes the end of a search from x for `best` where it is lower than `lowest`. */
static status search(struct target *t, unsigned n, int n_evaluation, double x[N_UNKNOWN], double *lowest,
                     double best[N_UNKNOWN], struct error *err)
{
    nlopt_opt opt = nlopt_create(n == N_OF_LOBES ? NLOPT_LN_SBPLX : NLOPT_LN_BOBYQA, n);
    if (opt == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit hair lobes: out of memory");
    double f = INFINITY;
    nlopt_set_lower_bounds(opt, lower);
    nlopt_set_upper_bounds(opt, upper);
    nlopt_set_min_objective(opt, objective, t);
    nlopt_set_maxeval(opt, n_evaluation);
    nlopt_set_ftol_rel(opt, 1e-5);
    nlopt_optimize(opt, x, &f); /* also when the evaluations are used up, x is the best point so far */
    nlopt_destroy(opt);
    if (!(f < *lowest)) return STATUS_OK;
    *lowest = f;
    memcpy(best, x, n * sizeof *x);
    return STATUS_OK;
}

/* From several starts; the best end counts. One material first, then a second one beside it. */
static status minimise(struct target *t, double best[N_UNKNOWN], struct error *err)
{
    static const double start[N_SECOND][N_OF_LOBES] = {{0.2, 0.4, 1.5, -2.0, -2.0, -2.0},
                                                       {0.6, 0.8, 1.5, -2.0, -2.0, -2.0},
                                                       {0.4, 0.2, 1.3, -1.0, -1.0, -1.0},
                                                       {0.5, 0.3, 1.1, -1.0, -1.0, -1.0},
                                                       {0.2, 0.4, 1.5, 2.0, 2.0, 2.0}}; /* lets nothing through */
    double lowest = INFINITY, single[N_UNKNOWN] = {0}, x[N_UNKNOWN];
    status s = STATUS_OK;
    for (int k = 0; k < N_START && s == STATUS_OK; k++) {
        memcpy(x, start[k], sizeof start[k]);
        s = search(t, N_OF_LOBES, N_EVALUATION, x, &lowest, single, err);
    }
    for (int i = 0; i < N_OF_LOBES; i++) single[N_OF_LOBES + i] = single[i]; /* the same material twice */
    memcpy(best, single, sizeof single);
    for (int k = 0; k < N_SECOND && s == STATUS_OK; k++) {
        memcpy(x, single, sizeof single);
        memcpy(x + N_OF_LOBES, start[k], sizeof start[k]);
        x[N_UNKNOWN - 1] = 0.3;
        s = search(t, N_UNKNOWN, N_EVALUATION_BLEND, x, &lowest, best, err);
    }
    if (s != STATUS_OK || isfinite(lowest)) return s;
    return error_set(err, STATUS_INTERNAL, "the hair lobes of an export have no finite error");
}

static void mean_share(const struct target *t, double share[N_THETA_O][N_SIDE][3], double turned[3], double all[3])
{
    double weight = 0.0;
    for (int o = 0; o < N_THETA_O; o++) weight += t->weight_o[o];
    for (int c = 0; c < 3; c++) {
        turned[c] = all[c] = 0.0;
        for (int o = 0; o < N_THETA_O; o++) {
            turned[c] += t->weight_o[o] * share[o][TURNS_BACK][c] / weight;
            all[c] += t->weight_o[o] * (share[o][TURNS_BACK][c] + share[o][GOES_ON][c]) / weight;
        }
    }
}

/* ---- an opaque fiber ---- */

static double smith(double cosine, double alpha)
{
    return 2.0 * cosine / (cosine + sqrt(alpha * alpha + (1.0 - alpha * alpha) * cosine * cosine));
}

/* GGX (Walter et al. 2007) for normals in the normal plane of the fiber; times pi, so that diffuse is 1. */
static double highlight(double cos_i, double cos_o, double half2, double index, double roughness)
{
    double alpha = roughness * roughness, half = sqrt(half2), z = (cos_i + cos_o) / (2.0 * half);
    double t = z * z * (alpha * alpha - 1.0) + 1.0;
    return alpha * alpha / (t * t) * smith(cos_i, alpha) * smith(cos_o, alpha) *
           fresnel_unpolarised(half, index, NULL) / (4.0 * cos_i * cos_o);
}

/* Means over the width of the fiber of cos cos f, f = 1 / pi for [0] and the highlight for [1], towards wi from wo. */
static void over_width(double theta_o, double theta_i, double phi, const double x[2], double out[2])
{
    /* square of the cosine of half of the angle between both directions */
    double half2 = 0.5 * (1.0 + sin(theta_o) * sin(theta_i) + cos(theta_o) * cos(theta_i) * cos(phi));
    double step = (M_PI - phi) / N_WIDTH;
    out[0] = out[1] = 0.0;
    for (int k = 0; k < N_WIDTH; k++) {
        double a = phi - M_PI_2 + (k + 0.5) * step, o = cos(a), i = cos(a - phi);
        out[0] += 0.5 * step * o * i / M_PI;
        out[1] += 0.5 * step * o * i / M_PI *
                  highlight(fmax(i * cos(theta_i), 1e-6), fmax(o * cos(theta_o), 1e-6), fmax(half2, 1e-6), x[0], x[1]);
    }
}

/* The dielectric and the diffuse part of colour 1, as the first two channels of the lobes. */
static void fill_parts(struct target *t, const double x[2])
{
    double *at = t->lobes, part[2];
    for (int o = 0; o < N_THETA_O; o++)
        for (int i = 0; i < N_THETA_I; i++)
            for (int k = 0; k < N_PHI; k++, at += 3) {
                over_width(t->theta_o[o], t->theta_i[i], t->phi[k], x, part);
                at[0] = part[1] * cos(t->theta_i[i]);
                at[1] = part[0] * cos(t->theta_i[i]);
                at[2] = 0.0;
            }
}

/* Colours by Kubelka and Munk, from shares of the parts. */
static void choose_colour(const struct target *t, const struct hair_fit *fit, struct surface_fit *f)
{
    double share[N_THETA_O][N_SIDE][3], turned[3], all[3];
    add_shares(t, t->lobes, share);
    mean_share(t, share, turned, all);
    for (int c = 0; c < 3; c++) {
        double q = fmax(1.0 - fit->albedo[c], 0.0) / fmax(fit->turned[c], 1e-6);
        double colour = (1.0 - all[0] - q * turned[0]) / (all[1] + q * turned[1]);
        f->diffuse[c] = fmin(fmax(colour, 0.0), fmax(1.0 - all[0], 0.0));
        f->albedo[c] = all[0] + f->diffuse[c] * all[1];
        f->turned[c] = turned[0] + f->diffuse[c] * turned[1];
    }
}

static void fill_surface(struct target *t, const struct hair_fit *fit, const double x[2], struct surface_fit *f)
{
    fill_parts(t, x);
    choose_colour(t, fit, f);
    for (size_t k = 0; k < N_VALUE; k += 3) {
        double shine = t->lobes[k], base = t->lobes[k + 1];
        for (size_t c = 0; c < 3; c++) t->lobes[k + c] = shine + f->diffuse[c] * base;
    }
    f->index = x[0];
    f->roughness = x[1];
    f->rel_rms = sqrt(shape_square(t));
}

/* The best of a grid: two numbers, and not more than a surface can be right. */
static void fit_surface(struct target *t, struct hair_fit *fit)
{
    static const double index[] = {1.0, 1.2, 1.35, 1.5, 1.75, 2.0, 2.5, 3.0},
                        roughness[] = {0.2, 0.3, 0.4, 0.5, 0.65, 0.8};
    double lowest = INFINITY;
    for (size_t i = 0; i < sizeof index / sizeof index[0]; i++)
        for (size_t k = 0; k < sizeof roughness / sizeof roughness[0]; k++) {
            struct surface_fit f;
            fill_surface(t, fit, (const double[2]){index[i], roughness[k]}, &f);
            if (!(f.rel_rms < lowest)) continue;
            lowest = f.rel_rms;
            fit->surface = f;
        }
}

static status fit_target(struct target *t, const struct hair_blend *known, struct hair_fit *fit, struct error *err)
{
    double x[N_UNKNOWN] = {0};
    status s = known == NULL ? minimise(t, x, err) : STATUS_OK;
    if (s != STATUS_OK) return s;
    fit->blend = known == NULL ? blend_of(x) : *known;
    fill_blend(&fit->blend, t);
    fit->rel_rms = sqrt(shape_square(t));
    mean_share(t, t->share, fit->turned, fit->albedo);
    fit_surface(t, fit);
    return STATUS_OK;
}

status hair_fit_run(const struct scattering_model *model, const double *param, const struct hair_blend *known,
                    struct hair_fit *fit, struct error *err)
{
    struct target t = {.fiber = calloc(N_VALUE, sizeof(double)), .lobes = calloc(N_VALUE, sizeof(double))};
    struct scattering_state *state = NULL;
    status s = t.fiber != NULL && t.lobes != NULL
                   ? model->prepare(param, &state, err)
                   : error_set(err, STATUS_NO_MEMORY, "cannot fit hair lobes: out of memory");
    if (s == STATUS_OK) {
        make_directions(&t);
        fill_fiber(model, state, &t);
        model->release(state);
        s = fit_target(&t, known, fit, err);
    }
    free(t.fiber);
    free(t.lobes);
    return s;
}
