#include "optimizer/report/textures/texture_fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Samples along an edge of the tile. */
enum { N_GRID = 16, N_SAMPLE = N_GRID * N_GRID, MOST_STEP = 4 };

struct search {
    const struct texture_model *model;
    void *surface;
    const struct texture_means *means;
    const struct texture_target *target;
    size_t n_fitted;                                       /* radiances of the target that have a weight */
    struct texture_sample map[N_SAMPLE], sample[N_SAMPLE]; /* as the maps have them, and with scaled normals */
    struct texture_sample afar;                            /* with the means of the maps */
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
        const double opacity = texture_maps_opacity(m, pixel[k]);
        s->opacity += weight[k] * opacity;
        for (size_t c = 0; c < 3; c++)
            s->share[c] += weight[k] * (m->share != NULL ? (double)m->share[3 * pixel[k] + c] / opacity : 1.0);
    }
    memcpy(s->tangent, across, sizeof across);
}

/* The place with slopes of the normal times `factor`, and a frame around the normal. */
static struct texture_sample turned(const struct texture_sample *map, double factor)
{
    struct texture_sample s = *map;
    for (int a = 0; a < 2; a++) s.normal[a] *= factor;
    scale(s.normal, 1.0 / sqrt(dot(s.normal, s.normal)));
    const double along = dot(s.tangent, s.normal);
    for (int a = 0; a < 3; a++) s.tangent[a] -= along * s.normal[a];
    scale(s.tangent, 1.0 / sqrt(dot(s.tangent, s.tangent)));
    for (int a = 0; a < 3; a++)
        s.bitangent[a] =
            s.normal[(a + 1) % 3] * s.tangent[(a + 2) % 3] - s.normal[(a + 2) % 3] * s.tangent[(a + 1) % 3];
    return s;
}

struct texture_sample texture_pixel_sample(const struct texture_maps *maps, size_t i, double normal_scale)
{
    struct texture_sample s;
    sample_at(maps, (double)(i % maps->width) + 0.5, (double)(i / maps->width) + 0.5, &s);
    return turned(&s, normal_scale);
}

/* A grid over the tile, each line of it shifted against the one before, so that samples lie anywhere between the
 * pixels. */
static void make_samples(const struct texture_maps *m, struct texture_sample *sample)
{
    for (size_t k = 0; k < N_SAMPLE; k++) {
        const double shift = fmod(0.618034 * (double)(k / N_GRID), 1.0),
                     turn = fmod(0.618034 * (double)(k % N_GRID), 1.0);
        sample_at(m, ((double)(k % N_GRID) + shift) / N_GRID * (double)m->width,
                  ((double)(k / N_GRID) + turn) / N_GRID * (double)m->height, &sample[k]);
    }
}

/* The means of the maps on a flat surface, with the tangent of most fibers. */
static void make_afar(struct search *f)
{
    double twice[2] = {0.0, 0.0};
    f->afar = (struct texture_sample){.normal = {0.0, 0.0, 1.0}, .share = {1.0, 1.0, 1.0}, .opacity = 1.0};
    for (size_t k = 0; k < N_SAMPLE; k++) {
        const struct texture_sample *s = &f->map[k];
        f->afar.root_spread += s->root_spread / N_SAMPLE;
        f->afar.coherence += s->coherence / N_SAMPLE;
        twice[0] += s->tangent[0] * s->tangent[0] - s->tangent[1] * s->tangent[1];
        twice[1] += 2.0 * s->tangent[0] * s->tangent[1];
    }
    const double phi = 0.5 * atan2(twice[1], twice[0]);
    f->afar.tangent[0] = f->afar.bitangent[1] = cos(phi);
    f->afar.tangent[1] = sin(phi);
    f->afar.bitangent[0] = -sin(phi);
}

/* Each rotation of a row that is a mean over n of them has its own samples, a part of all. */
static void add_rotation(const struct search *f, const struct configuration *k, uint32_t r, bool afar, double rgb[3])
{
    const uint32_t n = k->n_rotation > 1 ? k->n_rotation : 1;
    const size_t step = n < MOST_STEP ? n : MOST_STEP, n_sample = afar ? 1 : N_SAMPLE / step;
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
        const struct texture_sample *s = afar ? &f->afar : &f->sample[step * i + r % step];
        f->model->reflect(f->surface, s, wi, wo, one);
        for (int c = 0; c < 3; c++) rgb[c] += one[c] * s->opacity / (double)n_sample;
    }
}

static void radiance_of(const struct search *f, const struct configuration *k, bool afar, double rgb[3])
{
    const uint32_t n = k->n_rotation > 1 ? k->n_rotation : 1;
    rgb[0] = rgb[1] = rgb[2] = 0.0;
    for (uint32_t r = 0; r < n && k->light != LIGHT_NO_LAMP; r++) add_rotation(f, k, r, afar, rgb);
    for (int c = 0; c < 3; c++) rgb[c] = rgb[c] / n + k->environment_rgb[c] * f->means->albedo[c];
}

/* Sets the numbers, and turns the normals as they say. */
static void take(struct search *f, const double *x)
{
    f->model->take(f->surface, x);
    const double factor = f->model->normal_scale != NULL ? f->model->normal_scale(f->surface) : 1.0;
    for (size_t i = 0; i < N_SAMPLE; i++) f->sample[i] = turned(&f->map[i], factor);
}

static void residuals(void *context, const double *x, double *out)
{
    struct search *f = context;
    take(f, x);
    for (size_t i = 0; i < f->target->n; i++) {
        const struct texture_radiance *r = &f->target->item[i];
        double rgb[3];
        if (!(r->weight > 0.0)) continue;
        for (int afar = 0; afar < (f->model->has_afar ? 2 : 1); afar++) {
            const double part = r->weight / (f->model->has_afar ? 6.0 : 3.0);
            radiance_of(f, &r->configuration, afar == 1, rgb);
            for (int c = 0; c < 3; c++) *out++ = (rgb[c] - r->rgb[c]) * r->scale * sqrt(part);
        }
    }
}

/* A sum of squared errors of radiances, and how many they are. */
struct part {
    double square, n;
};

static double root_of(struct part a, struct part b)
{
    return a.n + b.n > 0.0 ? sqrt((a.square + b.square) / (a.n + b.n)) : NAN;
}

static status judge(struct search *f, struct texture_error *error, struct error *err)
{
    struct part part[TEXTURE_OTHER_DIRECTION + 1] = {{0.0, 0.0}};
    const struct part none = {0.0, 0.0};
    double afar = 0.0;
    error->row_rel_error = calloc(f->target->n_row + 1, sizeof *error->row_rel_error);
    if (error->row_rel_error == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot judge textures: out of memory");
    for (size_t i = 0; i < f->target->n; i++) {
        const struct texture_radiance *r = &f->target->item[i];
        double rgb[3], square = 0.0;
        radiance_of(f, &r->configuration, false, rgb);
        for (int c = 0; c < 3; c++) square += pow((rgb[c] - r->rgb[c]) * r->scale, 2.0) / 3.0;
        if (i < f->target->n_row) error->row_rel_error[i] = sqrt(square);
        if (i < f->target->n_row) radiance_of(f, &r->configuration, true, rgb);
        for (int c = 0; c < 3 && i < f->target->n_row; c++)
            afar += pow((rgb[c] - r->rgb[c]) * r->scale, 2.0) / (3.0 * (double)f->target->n_row);
        part[r->part].square += square;
        part[r->part].n += 1.0;
    }
    error->afar_rel_rms = sqrt(afar);
    error->rel_rms = root_of(part[TEXTURE_FITTED_ROW], none);
    error->heldout_rel_rms = root_of(part[TEXTURE_HELDOUT_ROW], none);
    error->row_rel_rms = root_of(part[TEXTURE_FITTED_ROW], part[TEXTURE_HELDOUT_ROW]);
    error->hemisphere_rel_rms = root_of(part[TEXTURE_OTHER_DIRECTION], none);
    return STATUS_OK;
}

/* From every start; the best end counts. */
static status search_all(struct search *f, double best[TEXTURE_MAX_UNKNOWN], struct error *err)
{
    const struct least_squares p = {.n_unknown = f->model->n_unknown,
                                    .n_residual = (f->model->has_afar ? 6 : 3) * f->n_fitted,
                                    .lower = f->model->lower,
                                    .upper = f->model->upper,
                                    .residuals = residuals,
                                    .context = f};
    double lowest = INFINITY;
    memcpy(best, f->model->start[0], TEXTURE_MAX_UNKNOWN * sizeof *best);
    for (size_t k = 0; k < f->model->n_start; k++) {
        double x[TEXTURE_MAX_UNKNOWN], value = INFINITY;
        memcpy(x, f->model->start[k], sizeof x);
        status s = least_squares_run(&p, x, &value, err);
        if (s != STATUS_OK) return s;
        if (!(value < lowest)) continue;
        lowest = value;
        memcpy(best, x, sizeof x);
    }
    return STATUS_OK;
}

status texture_fit_run(const struct texture_model *model, void *surface, const struct texture_maps *maps,
                       const struct texture_means *means, const struct texture_target *target,
                       struct texture_error *error, struct error *err)
{
    double best[TEXTURE_MAX_UNKNOWN];
    struct search *f = calloc(1, sizeof *f);
    *error = (struct texture_error){.row_rel_error = NULL};
    if (f == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit textures: out of memory");
    f->model = model;
    f->surface = surface;
    f->means = means;
    f->target = target;
    for (size_t i = 0; i < target->n; i++) f->n_fitted += target->item[i].weight > 0.0;
    make_samples(maps, f->map);
    make_afar(f);
    status s = search_all(f, best, err);
    if (s == STATUS_OK) {
        take(f, best);
        s = judge(f, error, err);
    }
    free(f);
    return s;
}

void texture_error_release(struct texture_error *error)
{
    free(error->row_rel_error);
    error->row_rel_error = NULL;
}
