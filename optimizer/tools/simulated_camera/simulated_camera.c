#include "optimizer/tools/simulated_camera/simulated_camera.h"

#include "base/angle.h"
#include "base/files/durable.h"
#include "base/rng.h"
#include "optimizer/photographs/camera/color_matrix.h"
#include "optimizer/tools/simulated_camera/phantom_files.h"
#include "optimizer/tools/simulated_camera/simulated_files.h"
#include "optimizer/tools/simulated_camera/studio.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RAYS = 2, NUMBER_CHART = 4000, NUMBER_DARK = 4010, NUMBER_FLAT = 4020, MAX_PIXEL = 1 << 26 };
static const double flat_fill = 0.5; /* of the range, in the brightest channel */

void simulated_camera_option_default(struct simulated_camera_option *o)
{
    *o = (struct simulated_camera_option){.size_px = {480, 416},
                                          .px_per_mm = 4.8,
                                          .crop_cm = 1.0,
                                          .exposure_s = {0.02, 0.16, 1.28},
                                          .chart_fall_phi_deg = 30.0,
                                          .chart_exposure_s = 0.16,
                                          .chart_light_theta_deg = 20.0,
                                          .chart_camera_theta_deg = 28.0,
                                          .chart_camera_phi_deg = 250.0,
                                          .aim_mm = 1.5,
                                          .seed = 1,
                                          .sensor = sensor_default()};
}

/* Shared by all pictures. */
struct simulation {
    const struct simulated_camera_option *o;
    struct studio studio;
    struct lens lens;
    double distance_mm;
    float *ideal;   /* for each photosite, where it would lie without distortion, in cells */
    float *share;   /* of the light, by vignetting */
    json_t *view;   /* photographs.json of the source */
    json_t *truth;  /* the same order */
    double crop_mm; /* of the renderings */
    status *status_of_view;
    struct error *error_of_view;
};

static struct lens lens_of(const struct simulated_camera_option *o, double distance_mm)
{
    const double w = (double)o->size_px[0], h = (double)o->size_px[1], focal = o->px_per_mm * distance_mm;
    /* 1 % of distortion at the corner, whatever the focal length is */
    const double corner2 = 0.25 * (w * w + h * h) / (focal * focal);
    return (struct lens){.has_vignetting = true,
                         .has_distortion = true,
                         .vignetting_center_px = {0.5 * w + 5.0, 0.5 * h - 3.0},
                         .vignetting_radius_px = 0.5 * hypot(w, h),
                         .vignetting = {-0.22, 0.05, -0.02},
                         .focal_px = {focal, focal},
                         .center_px = {0.5 * w + 3.0, 0.5 * h - 2.0},
                         .k = {-0.01 / corner2, 0.001 / (corner2 * corner2), 0.0},
                         .p = {0.0005 / sqrt(corner2), -0.0003 / sqrt(corner2)}};
}

static void map_photosites(struct simulation *m)
{
    const size_t w = 2 * m->o->size_px[0], h = 2 * m->o->size_px[1];
    for (size_t i = 0; i < w * h; i++) {
        const double real[2] = {0.5 * ((double)(i % w) + 0.5), 0.5 * ((double)(i / w) + 0.5)};
        double ideal[2];
        lens_undistort(&m->lens, real, ideal);
        m->ideal[2 * i] = (float)ideal[0];
        m->ideal[2 * i + 1] = (float)ideal[1];
        m->share[i] = (float)lens_vignetting(&m->lens, real);
    }
}

/* Radiance at every photosite, by the mean of RAYS x RAYS rays. */
static void trace_photosites(const struct simulation *m, const struct studio_scene *scene,
                             const struct studio_camera *c, float *rgb)
{
    const size_t n = 4 * m->o->size_px[0] * m->o->size_px[1];
    const struct lens *l = &m->lens;
    for (size_t i = 0; i < n; i++) {
        double sum[3] = {0};
        for (size_t k = 0; k < RAYS * RAYS; k++) {
            double dx = 0.5 * (((double)(k % RAYS) + 0.5) / RAYS - 0.5),
                   dy = 0.5 * (((double)(k / RAYS) + 0.5) / RAYS - 0.5);
            double u = ((double)m->ideal[2 * i] + dx - l->center_px[0]) / l->focal_px[0],
                   v = ((double)m->ideal[2 * i + 1] + dy - l->center_px[1]) / l->focal_px[1], d[3], one[3];
            for (size_t a = 0; a < 3; a++) d[a] = c->forward[a] + u * c->right[a] + v * c->down[a];
            studio_radiance(scene, c, d, one);
            for (size_t a = 0; a < 3; a++) sum[a] += one[a];
        }
        for (size_t a = 0; a < 3; a++) rgb[3 * i + a] = (float)(sum[a] / (RAYS * RAYS));
    }
}

/* Smooths a picture by a Gaussian of one photosite along lines of n values with this stride, in place; places beyond an
 * end have the value at the end. line: scratch of n values. */
static void blur_lines(float *value, size_t n_line, size_t line_step, size_t n, size_t step, float *line)
{
    static const double weight[4] = {0.39905, 0.24204, 0.05401, 0.00443};
    for (size_t k = 0; k < n_line; k++) {
        float *at = value + k * line_step;
        for (size_t i = 0; i < n; i++) line[i] = at[i * step];
        for (size_t i = 0; i < n; i++) {
            double sum = weight[0] * (double)line[i];
            for (size_t d = 1; d < 4; d++)
                sum += weight[d] * ((double)line[i >= d ? i - d : 0] + (double)line[i + d < n ? i + d : n - 1]);
            at[i * step] = (float)sum;
        }
    }
}

/* Rate of every photosite, behind a lens that blurs the scene by a photosite. */
static status collect_light(const struct simulation *m, const struct studio_scene *scene, const struct studio_camera *c,
                            float *rate, struct error *err)
{
    const size_t w = 2 * m->o->size_px[0], h = 2 * m->o->size_px[1];
    const struct sensor *s = &m->o->sensor;
    float *rgb = malloc(3 * w * h * sizeof *rgb), *line = malloc((w > h ? w : h) * sizeof *line);
    status st = rgb != NULL && line != NULL
                    ? STATUS_OK
                    : error_set(err, STATUS_NO_MEMORY, "cannot simulate a camera: out of memory");
    if (st == STATUS_OK) {
        trace_photosites(m, scene, c, rgb);
        for (size_t a = 0; a < 3; a++) {
            blur_lines(rgb + a, h, 3 * w, w, 3, line);
            blur_lines(rgb + a, w, 3, h, 3 * w, line);
        }
    }
    for (size_t i = 0; i < w * h && st == STATUS_OK; i++) {
        const double *row = s->matrix + 3 * sensor_channel(i % w, i / w);
        double light = 0.0;
        for (size_t a = 0; a < 3; a++) light += row[a] * (double)rgb[3 * i + a];
        rate[i] = (float)(light * s->dn_per_s * (double)m->share[i]);
    }
    free(rgb);
    free(line);
    return st;
}

/* Time for which the shutter is open at this setting; a setting is as wrong for the chart as for a view. */
static double true_time(const struct simulated_camera_option *o, double stated_s)
{
    for (size_t k = 0; k < SIMULATED_EXPOSURES; k++)
        if (stated_s == o->exposure_s[k])
            return stated_s * (1.0 + (k % 2 == 0 ? o->exposure_error : -o->exposure_error));
    return stated_s;
}

static status expose(const struct simulation *m, const float *rate, double exposure_s, uint32_t number,
                     const char *name, struct error *err)
{
    const size_t size[2] = {2 * m->o->size_px[0], 2 * m->o->size_px[1]};
    const double time_s[2] = {true_time(m->o, exposure_s), exposure_s};
    char path[PHANTOM_PATH_BYTES];
    status st = phantom_path(m->o->folder, name, path, err);
    return st == STATUS_OK ? sensor_expose(&m->o->sensor, size, rate, time_s, m->o->seed, number, path, err) : st;
}

static float *new_rate(const struct simulation *m, struct error *err)
{
    float *rate = calloc(4 * m->o->size_px[0] * m->o->size_px[1], sizeof *rate);
    if (rate == NULL) error_set(err, STATUS_NO_MEMORY, "cannot simulate a camera: out of memory");
    return rate;
}

/* A camera whose aim is off by chance. number: of the picture. */
static void aim(const struct simulation *m, double theta_deg, double phi_deg, uint32_t number, struct studio_camera *c)
{
    const struct rng_key key = {.seed = m->o->seed, .iteration = 65532};
    struct rng r;
    double off[2];
    rng_start(&r, &key, number, 0);
    for (size_t i = 0; i < 2; i++) off[i] = m->o->aim_mm * (2.0 * rng_double(&r) - 1.0);
    studio_camera_init(c, theta_deg * RAD_PER_DEG, phi_deg * RAD_PER_DEG, m->distance_mm, off);
}

/* ---- the views ---- */

static double number_of(const json_t *view, const char *key) { return json_number_value(json_object_get(view, key)); }

/* Mean over the crop in the middle of the rendering, which shows crop_mm. */
static void mean_of_crop(const struct image *im, double share, double mean[3])
{
    const double n[2] = {(double)im->width, (double)im->height};
    double area = 0.0;
    memset(mean, 0, 3 * sizeof *mean);
    for (size_t i = 0; i < im->width * im->height; i++) {
        double a = 1.0;
        for (size_t k = 0; k < 2; k++) {
            double from = (double)(k == 0 ? i % im->width : i / im->width);
            a *= fmax(0.0, fmin(from + 1.0, 0.5 * n[k] * (1.0 + share)) - fmax(from, 0.5 * n[k] * (1.0 - share)));
        }
        area += a;
        for (size_t c = 0; c < 3; c++) mean[c] += a * (double)im->pixel[im->n_channel * i + c];
    }
    for (size_t c = 0; c < 3; c++) mean[c] /= area;
}

static status take_view(const struct simulation *m, size_t i, struct error *err)
{
    const struct simulated_camera_option *o = m->o;
    const json_t *view = json_array_get(m->view, i);
    const char *file = json_string_value(json_object_get(view, "file"));
    char path[PHANTOM_PATH_BYTES], name[SIMULATED_NAME_BYTES];
    struct studio_camera camera;
    struct image im = {0};
    double mean[3];
    status st = file != NULL ? phantom_path(o->source, file, path, err)
                             : error_set(err, STATUS_FORMAT, "photographs.json: row %zu has no file", i);
    if (st == STATUS_OK) st = image_read_exr(&im, path, MAX_PIXEL, err);
    if (st != STATUS_OK) return st;
    const struct studio_scene scene = {.studio = &m->studio,
                                       .cloth = &im,
                                       .cloth_crop_mm = m->crop_mm,
                                       .cos_light = fmax(0.0, cos(number_of(view, "light_theta_deg") * RAD_PER_DEG))};
    mean_of_crop(&im, 10.0 * o->crop_cm / m->crop_mm, mean);
    json_t *row = json_array_get(m->truth, i);
    json_object_set_new(row, "mean_rgb", json_pack("[f,f,f]", mean[0], mean[1], mean[2]));
    float *rate = new_rate(m, err);
    st = rate != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    if (st == STATUS_OK) {
        aim(m, number_of(view, "camera_theta_deg"),
            number_of(view, "camera_phi_deg") - number_of(view, "cloth_rotation_deg"), (uint32_t)i, &camera);
        st = collect_light(m, &scene, &camera, rate, err);
    }
    for (size_t k = 0; k < SIMULATED_EXPOSURES && st == STATUS_OK; k++) {
        simulated_raw_name(file, k, name);
        st = expose(m, rate, o->exposure_s[k], (uint32_t)(SIMULATED_EXPOSURES * i + k), name, err);
    }
    free(rate);
    image_release(&im);
    return st;
}

static void view_task(void *context, size_t i, size_t i_thread)
{
    struct simulation *m = context;
    (void)i_thread;
    m->status_of_view[i] = take_view(m, i, &m->error_of_view[i]);
}

static status take_views(struct simulation *m, struct thread_pool *pool, struct error *err)
{
    const size_t n = json_array_size(m->view);
    if (n == 0 || n != json_array_size(m->truth) || SIMULATED_EXPOSURES * n > NUMBER_CHART)
        return error_set(err, STATUS_FORMAT, "photographs.json and truth.json of '%s' do not belong together",
                         m->o->source);
    m->status_of_view = calloc(n, sizeof *m->status_of_view);
    m->error_of_view = calloc(n, sizeof *m->error_of_view);
    if (m->status_of_view == NULL || m->error_of_view == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot simulate a camera: out of memory");
    status st = thread_pool_run(pool, n, view_task, m, NULL);
    for (size_t i = 0; i < n && st == STATUS_OK; i++)
        if (m->status_of_view[i] != STATUS_OK) {
            st = m->status_of_view[i];
            *err = m->error_of_view[i];
        }
    return st;
}

/* ---- chart, dark and flat frames ---- */

static status take_chart(const struct simulation *m, float *rate, struct error *err)
{
    const struct simulated_camera_option *o = m->o;
    const struct studio_scene scene = {.studio = &m->studio, .cos_light = cos(o->chart_light_theta_deg * RAD_PER_DEG)};
    struct studio_camera camera;
    aim(m, o->chart_camera_theta_deg, o->chart_camera_phi_deg, NUMBER_CHART, &camera);
    status st = collect_light(m, &scene, &camera, rate, err);
    return st == STATUS_OK ? expose(m, rate, o->chart_exposure_s, NUMBER_CHART, "chart.dng", err) : st;
}

/* Half of the dark frames have the shortest, half the longest exposure time. */
static status take_frames(const struct simulation *m, float *rate, struct error *err)
{
    const struct simulated_camera_option *o = m->o;
    const size_t w = 2 * o->size_px[0], n = w * 2 * o->size_px[1];
    char name[SIMULATED_NAME_BYTES];
    status st = STATUS_OK;
    memset(rate, 0, n * sizeof *rate);
    for (uint32_t i = 0; i < SIMULATED_DARK && st == STATUS_OK; i++) {
        snprintf(name, sizeof name, "dark-%u.dng", i);
        st = expose(m, rate, o->exposure_s[i < SIMULATED_DARK / 2 ? 0 : SIMULATED_EXPOSURES - 1], NUMBER_DARK + i, name,
                    err);
    }
    for (size_t i = 0; i < n; i++) {
        const double *row = o->sensor.matrix + 3 * sensor_channel(i % w, i / w);
        rate[i] = (float)((row[0] + row[1] + row[2]) * o->sensor.dn_per_s * (double)m->share[i]);
    }
    const double flat_s = flat_fill * (double)(o->sensor.white - o->sensor.black) / o->sensor.dn_per_s;
    for (uint32_t i = 0; i < SIMULATED_FLAT && st == STATUS_OK; i++) {
        snprintf(name, sizeof name, "flat-%u.dng", i);
        st = expose(m, rate, flat_s, NUMBER_FLAT + i, name, err);
    }
    return st;
}

/* ---- all of it ---- */

static status read_source(struct simulation *m, json_t **truth, struct error *err)
{
    status st = phantom_json_read(m->o->source, "photographs.json", &m->view, err);
    if (st == STATUS_OK) st = phantom_json_read(m->o->source, "truth.json", truth, err);
    if (st != STATUS_OK) return st;
    const json_t *camera = json_object_get(*truth, "camera");
    m->truth = json_object_get(*truth, "photographs");
    m->distance_mm = 10.0 * number_of(camera, "distance_cm");
    m->crop_mm = 10.0 * number_of(camera, "crop_cm");
    if (json_is_true(json_object_get(camera, "far_field")) || !(m->distance_mm > 0.0))
        return error_set(err, STATUS_INVALID, "the renderings in '%s' are those of a camera far away", m->o->source);
    const double margin_mm = 2.0 / m->o->px_per_mm;
    if (m->crop_mm < 10.0 * m->o->crop_cm + margin_mm)
        return error_set(err, STATUS_INVALID,
                         "the renderings in '%s' show %g mm, which is not more than the crop of %g mm and a margin of "
                         "two pixels: render them with a larger --crop-cm",
                         m->o->source, m->crop_mm, 10.0 * m->o->crop_cm);
    return STATUS_OK;
}

static status prepare(struct simulation *m, struct error *err)
{
    const size_t n = 4 * m->o->size_px[0] * m->o->size_px[1];
    m->lens = lens_of(m->o, m->distance_mm);
    m->ideal = malloc(2 * n * sizeof *m->ideal);
    m->share = malloc(n * sizeof *m->share);
    if (m->ideal == NULL || m->share == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot simulate a camera: out of memory");
    map_photosites(m);
    status st = studio_init(&m->studio, err);
    m->studio.chart_fall = m->o->chart_fall;
    m->studio.chart_fall_phi_rad = m->o->chart_fall_phi_deg * RAD_PER_DEG;
    return st;
}

status simulated_camera_make(const struct simulated_camera_option *o, struct thread_pool *pool, struct error *err)
{
    struct simulation *m = calloc(1, sizeof *m);
    json_t *truth = NULL;
    float *rate = NULL;
    if (m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot simulate a camera: out of memory");
    m->o = o;
    status st = STATUS_OK;
    if (o->size_px[0] < 64 || o->size_px[1] < 64 || o->size_px[0] > 8192 || o->size_px[1] > 8192)
        st = error_set(err, STATUS_INVALID, "a picture of the simulated camera has 64 to 8192 pixels a side");
    if (st == STATUS_OK) st = read_source(m, &truth, err);
    if (st == STATUS_OK) st = prepare(m, err);
    if (st == STATUS_OK) st = durable_make_folder(o->folder, err);
    if (st == STATUS_OK) st = take_views(m, pool, err);
    if (st == STATUS_OK && (rate = new_rate(m, err)) == NULL) st = STATUS_NO_MEMORY;
    if (st == STATUS_OK) st = take_chart(m, rate, err);
    if (st == STATUS_OK) st = take_frames(m, rate, err);
    if (st == STATUS_OK) st = simulated_files_write(o, &m->lens, &m->studio.board, m->view, truth, err);
    free(rate);
    free(m->ideal);
    free(m->share);
    free(m->status_of_view);
    free(m->error_of_view);
    json_decref(m->view);
    json_decref(truth);
    free(m);
    return st;
}
