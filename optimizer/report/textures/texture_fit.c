#include "optimizer/report/textures/texture_fit.h"

#include "optimizer/report/result/result_json.h"

#include <math.h>
#include <nlopt.h>
#include <stdlib.h>
#include <string.h>

enum { N_EVALUATION_OF_UNKNOWN = 90, N_GRID = 32, MOST_STEP = 4 };

struct search {
    const struct texture_model *model;
    void *surface;
    const struct texture_means *means;
    const struct observation_set *rows;
    const struct pipeline_model *rendered;
    struct texture_sample sample[N_GRID * N_GRID];
};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void scale(double v[3], double by)
{
    for (int a = 0; a < 3; a++) v[a] *= by;
}

static void polar(double theta, double phi, double out[3])
{
    out[0] = sin(theta) * cos(phi);
    out[1] = sin(theta) * sin(phi);
    out[2] = cos(theta);
}

/* Four pixels around a place, with their weights. The maps repeat. */
static void neighbours(const struct texture_maps *m, double x, double y, size_t pixel[4], double weight[4])
{
    const double left = floor(x - 0.5), top = floor(y - 0.5), fx = x - 0.5 - left, fy = y - 0.5 - top;
    for (size_t k = 0; k < 4; k++) {
        const size_t i = ((size_t)(left + (double)m->width) + k % 2) % m->width,
                     j = ((size_t)(top + (double)m->height) + k / 2) % m->height;
        pixel[k] = j * m->width + i;
        weight[k] = (k % 2 == 1 ? fx : 1.0 - fx) * (k / 2 == 1 ? fy : 1.0 - fy);
    }
}

/* x, y: in pixels from the upper left corner. */
static void sample_at(const struct texture_maps *m, double x, double y, struct texture_sample *s)
{
    size_t pixel[4];
    double weight[4];
    const double phi = (double)m->direction_rad[(size_t)y * m->width + (size_t)x] + M_PI_2;
    const double across[3] = {cos(phi), sin(phi), 0.0};
    *s = (struct texture_sample){.root_spread = 0.0};
    neighbours(m, x, y, pixel, weight);
    for (size_t k = 0; k < 4; k++) {
        for (size_t a = 0; a < 3; a++) s->normal[a] += weight[k] * (double)m->normal[3 * pixel[k] + a];
        s->root_spread += weight[k] * sqrt((double)m->spread[pixel[k]]);
        s->coherence += weight[k] * (double)m->coherence[pixel[k]];
    }
    scale(s->normal, 1.0 / sqrt(dot(s->normal, s->normal)));
    const double along = dot(across, s->normal);
    for (int a = 0; a < 3; a++) s->tangent[a] = across[a] - along * s->normal[a];
    scale(s->tangent, 1.0 / sqrt(dot(s->tangent, s->tangent)));
    for (int a = 0; a < 3; a++)
        s->bitangent[a] =
            s->normal[(a + 1) % 3] * s->tangent[(a + 2) % 3] - s->normal[(a + 2) % 3] * s->tangent[(a + 1) % 3];
}

/* A grid over the tile, each line of it shifted against the one before, so that samples lie anywhere between the
 * pixels. */
static void make_samples(const struct texture_maps *m, struct texture_sample *sample)
{
    for (size_t k = 0; k < N_GRID * N_GRID; k++) {
        const double shift = fmod(0.618034 * (double)(k / N_GRID), 1.0),
                     turn = fmod(0.618034 * (double)(k % N_GRID), 1.0);
        sample_at(m, ((double)(k % N_GRID) + shift) / N_GRID * (double)m->width,
                  ((double)(k / N_GRID) + turn) / N_GRID * (double)m->height, &sample[k]);
    }
}

/* Each rotation of a row that is a mean over n of them has its own samples, a part of all. */
static void add_rotation(const struct search *f, const struct configuration *k, uint32_t r, uint32_t n, double rgb[3])
{
    const size_t step = n < MOST_STEP ? n : MOST_STEP, n_sample = N_GRID * N_GRID / step;
    const double turned = k->cloth_rotation_rad + 2.0 * M_PI * r / n;
    double wi[3], wo[3], one[3];
    polar(k->light_theta_rad, k->light_phi_rad - turned, wi);
    polar(k->camera_theta_rad, k->camera_phi_rad - turned, wo);
    if (!(wi[2] > 0.0)) {
        for (int c = 0; c < 3; c++) rgb[c] -= wi[2] * f->means->transmission[c];
        return;
    }
    f->model->look(f->surface, wo);
    for (size_t i = 0; i < n_sample; i++) {
        f->model->reflect(f->surface, &f->sample[step * i + r % step], wi, wo, one);
        for (int c = 0; c < 3; c++) rgb[c] += one[c] / (double)n_sample;
    }
}

static void radiance_of(const struct search *f, const struct configuration *k, double rgb[3])
{
    const uint32_t n = k->n_rotation > 1 ? k->n_rotation : 1;
    rgb[0] = rgb[1] = rgb[2] = 0.0;
    for (uint32_t r = 0; r < n && k->light != LIGHT_NO_LAMP; r++) add_rotation(f, k, r, n, rgb);
    for (int c = 0; c < 3; c++) rgb[c] = rgb[c] / n + k->environment_rgb[c] * f->means->albedo[c];
}

static double rel_rms_of(const struct search *f, bool fitted)
{
    double square = 0.0, n = 0.0;
    for (size_t i = 0; i < f->rows->n; i++) {
        double ours[3], se[3], theirs[3];
        if ((f->rows->item[i].set == JOB_SET_FIT) != fitted) continue;
        result_rendered_mean(f->rendered, i, ours, se);
        radiance_of(f, &f->rows->item[i].configuration, theirs);
        double brightest = fmax(fmax(ours[0], ours[1]), fmax(ours[2], 1e-12));
        for (int c = 0; c < 3; c++) square += pow((theirs[c] - ours[c]) / brightest, 2.0) / 3.0;
        n += 1.0;
    }
    return n > 0.0 ? sqrt(square / n) : NAN;
}

static double objective(unsigned n, const double *x, double *gradient, void *data)
{
    (void)n, (void)gradient;
    struct search *f = data;
    f->model->take(f->surface, x);
    return rel_rms_of(f, true);
}

static status search_from(struct search *f, const double *start, double *x, double *value, struct error *err)
{
    nlopt_opt opt = nlopt_create(NLOPT_LN_NELDERMEAD, (unsigned)f->model->n_unknown);
    if (opt == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit textures: out of memory");
    memcpy(x, start, TEXTURE_MAX_UNKNOWN * sizeof *x);
    nlopt_set_lower_bounds(opt, f->model->lower);
    nlopt_set_upper_bounds(opt, f->model->upper);
    nlopt_set_min_objective(opt, objective, f);
    nlopt_set_maxeval(opt, N_EVALUATION_OF_UNKNOWN * (int)f->model->n_unknown);
    nlopt_set_ftol_rel(opt, 1e-6);
    nlopt_optimize(opt, x, value); /* also when the evaluations are used up, x is the best point so far */
    nlopt_destroy(opt);
    return STATUS_OK;
}

status texture_fit_run(const struct texture_model *model, void *surface, const struct texture_maps *maps,
                       const struct texture_means *means, const struct report *report,
                       const struct pipeline_model *rendered, double rel_rms[2], struct error *err)
{
    double best[TEXTURE_MAX_UNKNOWN], lowest = INFINITY;
    struct search *f = calloc(1, sizeof *f);
    if (f == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit textures: out of memory");
    *f = (struct search){
        model, surface, means, &report->in.job->rows->observation, rendered, {{{0.0}, {0.0}, {0.0}, 0.0, 0.0}}};
    make_samples(maps, f->sample);
    memcpy(best, model->start[0], sizeof best);
    status s = STATUS_OK;
    for (size_t k = 0; k < model->n_start && s == STATUS_OK; k++) {
        double x[TEXTURE_MAX_UNKNOWN], value = INFINITY;
        s = search_from(f, model->start[k], x, &value, err);
        if (s != STATUS_OK || !(value < lowest)) continue;
        lowest = value;
        memcpy(best, x, sizeof best);
    }
    if (s == STATUS_OK) {
        model->take(surface, best);
        rel_rms[0] = rel_rms_of(f, true);
        rel_rms[1] = rel_rms_of(f, false);
    }
    free(f);
    return s;
}
