#include "optimizer/report/textures/texture_tile.h"

#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/report/textures/texture_smooth.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"
#include "renderer/estimate/render.h"
#include "renderer/transport/environment.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_TILE_PX = 1024, LEAST_TILE_PX = 2, LEAST_SAMPLE = 8, MOST_SAMPLE = 1 << 16, STREAM = 4090 };
enum { N_SMOOTHING = 8 };
/* The most smoothing, which is a sixth of the width of a yarn of some forty fibers. */
static const double most_smooth_radii = 4.0;
/* Paths of each of the two renderings: so many on a square millimetre, since smoothing goes by the size of fibers and
 * not of tiles. Forecasts, which do not know the tile, take `usual_paths`, of one of .75 mm2. A path takes as long as
 * `as_photograph` of a path of a photograph. */
static const double paths_per_mm2 = 2e6, least_paths = 2.5e5, most_paths = 4e6, usual_paths = 1.5e6,
                    as_photograph = 0.6;
static const double mm = 1e3, mm_of_cm = 10.0;

double texture_tile_paths(const struct job_results *results, size_t n_row, double n_fit_path)
{
    (void)results, (void)n_row, (void)n_fit_path;
    return (2.0 * as_photograph * usual_paths + texture_target_paths()) / TEXTURE_TILE_SHARE;
}

/* ---- size ---- */

struct texture_size texture_size_of(const double tile_mm[2], double edge_mm, size_t most_px)
{
    struct texture_size size;
    double longer_mm = 0.0, px_mm;
    for (int a = 0; a < 2; a++) {
        const double most = (double)(most_px / LEAST_TILE_PX);
        size.repeat[a] = (size_t)fmin(fmax(round(edge_mm / tile_mm[a]), 1.0), most);
        longer_mm = fmax(longer_mm, (double)size.repeat[a] * tile_mm[a]);
    }
    px_mm = longer_mm / (double)most_px;
    for (int a = 0; a < 2; a++)
        size.tile_px[a] = (size_t)fmin(fmax(floor(tile_mm[a] / px_mm + 1e-9), LEAST_TILE_PX), MOST_TILE_PX);
    return size;
}

struct texture_size texture_size_wanted(const struct export_scene *e)
{
    const double *size_m = e->report->in.made->fiber.tile_size_m, tile_mm[2] = {mm * size_m[0], mm * size_m[1]};
    const struct job_results *results = e->report->in.results;
    return texture_size_of(tile_mm, mm_of_cm * results->texture_cm, results->texture_px);
}

/* ---- renderings under even light of radiance 1 from above or from below ---- */

static status half_sphere(bool above, struct environment **environment, struct error *err)
{
    struct image im;
    status s = image_init(&im, 4, 2, 3, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < 24; i++) im.pixel[i] = (i < 12) == above ? 1.0f : 0.0f;
    s = environment_new(&im, 1.0, environment, err);
    image_release(&im);
    return s;
}

/* Renders two halves of the samples. */
static status render_halves(const struct export_scene *e, const struct render_request *q, const double part[2],
                            struct image half[2], struct error *err)
{
    status s = STATUS_OK;
    for (int h = 0; h < 2 && s == STATUS_OK; h++) {
        struct progress_part share;
        const double length = 0.5 * (part[1] - part[0]);
        const struct progress progress = progress_begin_part(&share, e->progress, part[0] + h * length, length);
        struct render_request own = *q;
        own.first_sample = h == 0 ? 0 : RENDER_HALF;
        own.n_sample = q->n_sample / 2;
        s = render_run(&own, e->report->in.job->tools->pool, &progress, &half[h], err);
    }
    return s;
}

/* As little smoothing as brings the noise below its limit, and no more than keeps yarns. */
static status smooth(const struct export_scene *e, const struct texture_maps *m, const struct image half[2],
                     struct image *out, struct texture_noise *noise, struct error *err)
{
    const double radius_mm = texture_maps_radius_mm(&e->report->in.made->fiber);
    status s = texture_smooth(m, half, 0.0, out, &noise->rel_se, err);
    for (int k = 1; k <= N_SMOOTHING && s == STATUS_OK && noise->rel_se > TEXTURE_NOISE; k++) {
        noise->smooth_mm = most_smooth_radii * radius_mm * k / N_SMOOTHING;
        s = texture_smooth(m, half, noise->smooth_mm, out, &noise->rel_se, err);
    }
    return s;
}

static status render_in(const struct export_scene *e, struct scene *scene, const struct environment *light,
                        const double part[2], struct texture_tile *t, size_t k, struct error *err)
{
    struct report *report = e->report;
    const struct pipeline_model *m = e->model;
    struct image *out = k == 0 ? &t->reflected : &t->transmitted;
    const double *size_m = report->in.made->fiber.tile_size_m, n_px = (double)(out->width * out->height);
    const double paths = fmin(fmax(paths_per_mm2 * mm * mm * size_m[0] * size_m[1], least_paths), most_paths);
    const struct configuration above = {.camera = CAMERA_FAR_FIELD,
                                        .camera_phi_rad = -M_PI_2,
                                        .light = LIGHT_NO_LAMP,
                                        .environment = light,
                                        .light_distance_m = 1.0,
                                        .lamp_side_m = 0.1,
                                        .camera_distance_m = 1.0,
                                        .crop_m = size_m[0],
                                        .crop_aspect = size_m[0] / size_m[1]};
    const struct render_request q = {.input = {.scene = {.fibers = scene},
                                               .model = &m->setup->appearance,
                                               .param = m->fit->result.param,
                                               .n_set = m->setup->sets.n_set,
                                               .discrepancy = pipeline_discrepancy(m->validation)},
                                     .configuration = &above,
                                     .width = out->width,
                                     .height = out->height,
                                     .n_sample =
                                         2 * (size_t)fmin(fmax(ceil(0.5 * paths / n_px), LEAST_SAMPLE), MOST_SAMPLE),
                                     .seed = report->in.job->seed ^ 0x74657874757265u,
                                     .stream = STREAM};
    struct image half[2] = {{0}, {0}};
    status s = render_halves(e, &q, part, half, err);
    if (s == STATUS_OK) s = smooth(e, &t->maps, half, out, &t->noise[k], err);
    image_release(&half[0]);
    image_release(&half[1]);
    return s;
}

static void take_means(struct texture_tile *t)
{
    const size_t n = t->maps.width * t->maps.height;
    for (size_t i = 0; i < 3 * n; i++) {
        t->means.albedo[i % 3] += (double)t->reflected.pixel[i] / (double)n;
        t->means.transmission[i % 3] += (double)t->transmitted.pixel[i] / (double)n;
    }
    for (size_t i = 0; i < 3 * n; i++)
        t->maps.share[i] = (float)((double)t->reflected.pixel[i] / fmax(t->means.albedo[i % 3], 1e-9));
}

static status render_both(const struct export_scene *e, struct texture_tile *t, struct error *err)
{
    struct scene *scene = NULL;
    struct image *out[2] = {&t->reflected, &t->transmitted};
    t->maps.share = calloc(3 * t->maps.width * t->maps.height, sizeof *t->maps.share);
    if (t->maps.share == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot render textures: out of memory");
    struct film_groups films;
    job_cloth_films(e->report->in.job->cloth, &films);
    status s = scene_new(&e->report->in.made->fiber, &(struct scene_option){.films = &films}, &scene, err);
    for (int k = 0; k < 2 && s == STATUS_OK; k++) {
        const double part[2] = {0.5 * k * TEXTURE_TILE_SHARE, 0.5 * (k + 1) * TEXTURE_TILE_SHARE};
        struct environment *light = NULL;
        s = image_init(out[k], t->maps.width, t->maps.height, 3, err);
        if (s == STATUS_OK) s = half_sphere(k == 0, &light, err);
        if (s == STATUS_OK) s = render_in(e, scene, light, part, t, (size_t)k, err);
        environment_free(light);
    }
    if (s == STATUS_OK) take_means(t);
    scene_free(scene);
    return s;
}

status texture_tile_make(const struct export_scene *e, const size_t tile_px[2], struct texture_tile *t,
                         struct error *err)
{
    *t = (struct texture_tile){0};
    status s = texture_maps_make(&e->report->in.made->fiber, tile_px, &t->maps, err);
    return s == STATUS_OK ? render_both(e, t, err) : s;
}

void texture_tile_release(struct texture_tile *t)
{
    image_release(&t->reflected);
    image_release(&t->transmitted);
    texture_maps_release(&t->maps);
}
