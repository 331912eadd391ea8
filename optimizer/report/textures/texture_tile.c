#include "optimizer/report/textures/texture_tile.h"

#include "optimizer/job/document/job_results.h"
#include "optimizer/report/result/result_pictures.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"
#include "renderer/estimate/render.h"

#include <math.h>
#include <stdlib.h>

enum { DEFAULT_PX = 96, MIN_EDGE = 16, MAX_EDGE = 512, MIN_SAMPLE = 64, SAMPLES_OF_A_RENDERING = 4, STREAM = 4090 };
/* A path of a tile under even light takes a shorter time than a path of a photograph: on a twill 3.6 us. Fitting and
 * writing the textures takes a share of the export's time. */
static const double path_of_tile = 0.42, fit_share = 1.0 - TEXTURE_TILE_SHARE;

static size_t edge_of(const struct job_results *results)
{
    const size_t edge = 2 * (results->render_px > 0 ? results->render_px : DEFAULT_PX);
    return edge < MIN_EDGE ? MIN_EDGE : edge > MAX_EDGE ? MAX_EDGE : edge;
}

static size_t samples_of(const struct job_results *results, size_t n_row, double n_fit_path)
{
    const size_t n = SAMPLES_OF_A_RENDERING * result_picture_samples(results, n_row, n_fit_path);
    return n > MIN_SAMPLE ? n : MIN_SAMPLE;
}

double texture_tile_paths(const struct job_results *results, size_t n_row, double n_fit_path)
{
    const double edge = (double)edge_of(results);
    return 2.0 * path_of_tile * edge * edge * (double)samples_of(results, n_row, n_fit_path) / (1.0 - fit_share);
}

/* Renders the tile above a black sheet, which is the first half of the progress of both renderings, or without one. */
static status render_tile(const struct export_scene *e, const struct texture_tile *t, bool black_sheet,
                          struct image *im, struct error *err)
{
    struct report *report = e->report;
    const struct pipeline_model *m = e->model;
    const double *size_m = report->in.made->fiber.tile_size_m;
    const struct configuration above = {.camera = CAMERA_FAR_FIELD,
                                        .camera_phi_rad = -M_PI_2,
                                        .light = LIGHT_NO_LAMP,
                                        .environment_rgb = {1.0, 1.0, 1.0},
                                        .light_distance_m = 1.0,
                                        .lamp_side_m = 0.1,
                                        .camera_distance_m = 1.0,
                                        .crop_m = size_m[0],
                                        .crop_aspect = size_m[0] / size_m[1]};
    struct scene *scene = NULL;
    struct progress_part half;
    struct progress progress =
        progress_begin_part(&half, e->progress, black_sheet ? 0.0 : 0.5 * (1.0 - fit_share), 0.5 * (1.0 - fit_share));
    status s = scene_new(&report->in.made->fiber, &(struct scene_option){.black_sheet = black_sheet}, &scene, err);
    if (s != STATUS_OK) return s;
    const struct render_request q = {
        .input = {.scene = {.fibers = scene},
                  .model = &m->setup->appearance,
                  .param = m->fit->result.param,
                  .n_set = m->setup->sets.n_set,
                  .discrepancy = pipeline_discrepancy(m->validation)},
        .configuration = &above,
        .width = t->maps.width,
        .height = t->maps.height,
        .n_sample = samples_of(report->in.results, report->in.job->rows->observation.n, (double)m->fit->result.n_path),
        .seed = report->in.job->seed ^ 0x74657874757265u,
        .stream = STREAM};
    s = render_run(&q, report->in.job->tools->pool, &progress, im, err);
    scene_free(scene);
    return s;
}

static void take_pixels(struct texture_tile *t, const struct image *dark, const struct image *open)
{
    const size_t n = t->maps.width * t->maps.height;
    double variance = 0.0, square = 0.0;
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < 3; c++) {
            double a = (double)dark->pixel[i * dark->n_channel + c], b = (double)open->pixel[i * open->n_channel + c];
            t->reflected.pixel[3 * i + c] = (float)a;
            t->transmitted.pixel[3 * i + c] = (float)fmax(b - a, 0.0);
            t->means.albedo[c] += a / (double)n;
            t->means.transmission[c] += (b - a) / (double)n;
            variance += (double)dark->pixel[i * dark->n_channel + 3 + c];
            square += a * a;
        }
    for (size_t c = 0; c < 3; c++) t->means.transmission[c] = fmax(t->means.transmission[c], 0.0);
    for (size_t i = 0; i < 3 * n; i++)
        t->maps.share[i] = (float)((double)t->reflected.pixel[i] / fmax(t->means.albedo[i % 3], 1e-9));
    t->noise = square > 0.0 ? sqrt(variance / square) : 0.0;
}

static status render_both(const struct export_scene *e, struct texture_tile *t, struct error *err)
{
    struct image dark = {0}, open = {0};
    t->maps.share = calloc(3 * t->maps.width * t->maps.height, sizeof *t->maps.share);
    if (t->maps.share == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot render textures: out of memory");
    status s = image_init(&t->reflected, t->maps.width, t->maps.height, 3, err);
    if (s == STATUS_OK) s = image_init(&t->transmitted, t->maps.width, t->maps.height, 3, err);
    if (s == STATUS_OK) s = render_tile(e, t, true, &dark, err);
    if (s == STATUS_OK) s = render_tile(e, t, false, &open, err);
    if (s == STATUS_OK) take_pixels(t, &dark, &open);
    image_release(&dark);
    image_release(&open);
    return s;
}

status texture_tile_make(const struct export_scene *e, struct texture_tile *t, struct error *err)
{
    *t = (struct texture_tile){0};
    const double *size_m = e->report->in.made->fiber.tile_size_m, longer = fmax(size_m[0], size_m[1]);
    const double edge = (double)edge_of(e->report->in.results);
    const size_t size[2] = {(size_t)fmax(1.0, round(edge * size_m[0] / longer)),
                            (size_t)fmax(1.0, round(edge * size_m[1] / longer))};
    status s = texture_maps_make(&e->report->in.made->fiber, size, &t->maps, err);
    return s == STATUS_OK ? render_both(e, t, err) : s;
}

void texture_tile_release(struct texture_tile *t)
{
    image_release(&t->reflected);
    image_release(&t->transmitted);
    texture_maps_release(&t->maps);
}
