#include "optimizer/tools/phantom/phantom_photographs.h"

#include "base/files/durable.h"
#include "base/rng.h"
#include "geometry/fibers/fiber_set.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/rows/observation.h"
#include "optimizer/tools/phantom/phantom_view_table.h"
#include "optimizer/tools/simulated_camera/phantom_files.h"
#include "renderer/estimate/render.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void phantom_photograph_option_default(struct phantom_photograph_option *o)
{
    *o = (struct phantom_photograph_option){.n_path = 1 << 17,
                                            .px = 64,
                                            .seed = 1,
                                            .lamp_side_cm = 10.0,
                                            .lamp_distance_cm = 61.0,
                                            .camera_distance_cm = 100.0,
                                            .crop_cm = 1.0,
                                            .black_sheet = true};
}

/* Reads one to three comma-separated numbers. Returns their count, or 0 for any other text. */
static size_t parse_numbers(const char *text, double value[3])
{
    for (size_t n = 0; n < 3; n++) {
        char *end;
        value[n] = strtod(text, &end);
        if (end == text || !isfinite(value[n])) return 0;
        if (*end == '\0') return n + 1;
        if (*end != ',') return 0;
        text = end + 1;
    }
    return 0;
}

status phantom_photograph_model(struct phantom_photograph_option *o, const char *model_id,
                                const char (*group)[MODEL_SET_NAME_BYTES], size_t n_group, struct error *err)
{
    o->model = scattering_find(model_id);
    if (o->model == NULL) return error_set(err, STATUS_INVALID, "unknown scattering model '%s'", model_id);
    status st = model_sets_init(&o->sets, model_catalogue_find(model_id), group, n_group, err);
    for (size_t i = 0; i < o->sets.info.n_param && st == STATUS_OK; i++) o->param[i] = o->sets.param[i].start;
    return st;
}

/* Returns whether the n bytes of key name the parameter, and whether they name the whole colour that it belongs to. */
static bool is_named(const struct param_info *p, const char *key, size_t n, bool *colour)
{
    char name[MODEL_SET_TEXT_BYTES];
    if (n >= sizeof name) return false;
    memcpy(name, key, n);
    name[n] = '\0';
    *colour = p->channel >= 0 && strcmp(name, p->name) != 0 && strcmp(name, param_own_name(p)) != 0;
    return param_is_named(p, name);
}

status phantom_param_parse(const struct model_info *model, const char *text, double *param, struct error *err)
{
    size_t n_name = strcspn(text, "="), n_match = 0;
    double value[3];
    size_t n_value = text[n_name] == '=' ? parse_numbers(text + n_name + 1, value) : 0;
    if (n_value == 0)
        return error_set_field(err, STATUS_INVALID, "param", "parameter '%s' is not NAME=value or NAME=r,g,b", text);
    for (size_t i = 0; i < model->n_param; i++) {
        const struct param_info *p = &model->param[i];
        bool colour;
        if (!is_named(p, text, n_name, &colour)) continue;
        size_t wanted = colour ? 3 : 1;
        if (n_value != 1 && n_value != wanted)
            return error_set_field(err, STATUS_INVALID, "param", "parameter '%s': it takes %s", text,
                                   wanted == 3 ? "1 or 3 values" : "1 value");
        double v = param_from_file_unit(p, n_value == 3 ? value[p->channel] : value[0]);
        if (!(v >= p->lower && v <= p->upper))
            return error_set_field(err, STATUS_INVALID, "param", "parameter '%s': it must lie between %g and %g %s",
                                   text, param_to_file_unit(p, p->lower), param_to_file_unit(p, p->upper),
                                   param_unit_name(p->unit));
        param[i] = v;
        n_match++;
    }
    if (n_match == 0)
        return error_set_field(err, STATUS_INVALID, "param", "model '%s' has no parameter '%.*s'", model->id,
                               (int)n_name, text);
    return STATUS_OK;
}

static bool ends_with(const char *text, const char *end)
{
    size_t n = strlen(text), m = strlen(end);
    return n >= m && strcmp(text + n - m, end) == 0;
}

static status load_scene(const struct phantom_photograph_option *o, struct scene **scene, json_t *truth,
                         struct error *err)
{
    struct fiber_set f;
    fiber_set_init(&f);
    status st = ends_with(o->fiber_file, ".hair") ? fiber_set_read_hair(&f, o->fiber_file, err)
                                                  : fiber_set_read_text(&f, o->fiber_file, err);
    for (int a = 0; a < 2; a++)
        if (o->tile_mm[a] > 0.0) f.tile_size_m[a] = 1e-3 * o->tile_mm[a];
    if (st == STATUS_OK) st = fiber_set_validate(&f, err);
    if (st == STATUS_OK) {
        const struct scene_option option = {.black_sheet = o->black_sheet, .sections = o->model->width != NULL};
        st = scene_new(&f, &option, scene, err);
        json_object_set_new(truth, "n_fiber", json_integer((json_int_t)f.n_fiber));
        json_object_set_new(truth, "tile_mm", json_pack("[f,f]", 1e3 * f.tile_size_m[0], 1e3 * f.tile_size_m[1]));
    }
    fiber_set_release(&f);
    return st;
}

static json_t *param_json(const struct model_info *model, const double *param)
{
    json_t *out = json_object();
    for (size_t i = 0; i < model->n_param; i++)
        json_object_set_new(out, model->param[i].name, json_real(param_to_file_unit(&model->param[i], param[i])));
    return out;
}

/* Adds the mean and its standard error of each channel to row, multiplies the picture by its random error, and writes
 * the rgb channels. */
static status finish_picture(const struct phantom_photograph_option *o, const struct image *im, size_t number,
                             const char *path, json_t *row, struct error *err)
{
    static const char *const rgb_name[] = {"R", "G", "B"};
    const struct rng_key key = {.seed = o->seed, .iteration = 65534};
    size_t n = im->width * im->height;
    double mean[3] = {0}, var[3] = {0}, gain[3];
    struct image out;
    struct rng rng;
    status st = image_init(&out, im->width, im->height, 3, err);
    if (st != STATUS_OK) return st;
    out.channel_name = rgb_name;
    rng_start(&rng, &key, (uint32_t)number, 0);
    for (int c = 0; c < 3; c++) {
        double normal[2];
        rng_normal_pair(&rng, normal);
        gain[c] = 1.0 + o->noise * normal[0];
    }
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < 3; c++) {
            mean[c] += (double)im->pixel[i * im->n_channel + c] / (double)n;
            var[c] += (double)im->pixel[i * im->n_channel + 3 + c] / ((double)n * (double)n);
            out.pixel[3 * i + c] = (float)(gain[c] * (double)im->pixel[i * im->n_channel + c]);
        }
    st = image_write_exr(&out, path, err);
    image_release(&out);
    json_object_set_new(row, "mean_rgb", json_pack("[f,f,f]", mean[0], mean[1], mean[2]));
    json_object_set_new(row, "mean_rgb_se", json_pack("[f,f,f]", sqrt(var[0]), sqrt(var[1]), sqrt(var[2])));
    json_object_set_new(row, "gain_rgb", json_pack("[f,f,f]", gain[0], gain[1], gain[2]));
    return st;
}

static struct configuration view_configuration(const struct phantom_photograph_option *o,
                                               const struct job_photograph *v)
{
    const struct job_setup set_up = {
        .lamp_side_cm = o->lamp_side_cm,
        .lamp_distance_cm = o->lamp_distance_cm,
        .lamp_directional = o->lamp_directional,
        .camera_distance_cm = o->camera_distance_cm,
        .crop_cm = o->crop_cm,
        .camera_far_field = o->camera_far_field,
        .camera_blur_mm = o->camera_blur_mm,
        .environment_rgb = {o->environment_rgb[0], o->environment_rgb[1], o->environment_rgb[2]}};
    return observation_configuration(&set_up, v->light_theta_deg, v->light_phi_deg, v->camera_theta_deg,
                                     v->camera_phi_deg, v->cloth_rotation_deg);
}

static status check_view(const struct phantom_photograph_option *o, const struct job_photograph *v, struct error *err)
{
    const struct configuration c = view_configuration(o, v);
    if (configuration_check(&c, 1, NULL) != STATUS_OK || !(v->light_theta_deg >= 0.0 && v->light_theta_deg <= 180.0))
        return error_set(
            err, STATUS_INVALID,
            "photograph '%s' makes no sense: camera_theta_deg must be 0 to below 90, light_theta_deg 0 to 180, and "
            "distances, lamp and crop above 0",
            v->file);
    if (o->black_sheet && v->light_theta_deg >= 90.0)
        return error_set(
            err, STATUS_INVALID,
            "photograph '%s' would be black: the lamp at %g degrees is behind the black sheet (--no-black-sheet)",
            v->file, v->light_theta_deg);
    return STATUS_OK;
}

/* Makes the array "photographs" of a job document, and the list of the photographs' means without noise. */
struct photograph_lists {
    json_t *photographs, *truth;
};

static status make_photograph(const struct phantom_photograph_option *o, const struct scene *scene,
                              const struct job_photograph *v, size_t number, struct thread_pool *pool,
                              const struct progress *progress, struct photograph_lists *lists, struct error *err)
{
    char path[PHANTOM_PATH_BYTES];
    struct image im = {0};
    const struct configuration c = view_configuration(o, v);
    const size_t n_pixel = o->px * o->px, n_sample = (size_t)((o->n_path + n_pixel - 1) / n_pixel);
    struct appearance model;
    appearance_from_surface(o->model, &model);
    const struct render_request q = {
        .input = {.scene = {.fibers = scene}, .model = &model, .param = o->param, .n_set = o->sets.n_set},
        .configuration = &c,
        .width = o->px,
        .height = o->px,
        .n_sample = n_sample > 2 ? n_sample : 2, /* one sample has no standard error */
        .seed = o->seed,
        .stream = (uint32_t)number};
    status st = render_run(&q, pool, progress, &im, err);
    if (st != STATUS_OK) return st;
    json_t *row =
        json_pack("{s:s,s:s,s:f,s:f,s:f,s:f,s:f,s:f}", "file", v->file, "set",
                  v->set == JOB_SET_FIT ? "fit" : "held-out", "light_theta_deg", v->light_theta_deg, "light_phi_deg",
                  v->light_phi_deg, "camera_theta_deg", v->camera_theta_deg, "camera_phi_deg", v->camera_phi_deg,
                  "cloth_rotation_deg", v->cloth_rotation_deg, "scale", v->scale);
    json_t *truth = json_pack("{s:s}", "file", v->file);
    st = phantom_path(o->folder, v->file, path, err);
    if (st == STATUS_OK) st = finish_picture(o, &im, number, path, truth, err);
    json_array_append_new(lists->photographs, row);
    json_array_append_new(lists->truth, truth);
    image_release(&im);
    return st;
}

status phantom_photographs_make(const struct phantom_photograph_option *o, struct thread_pool *pool,
                                const struct progress *progress, struct error *err)
{
    struct scene *scene = NULL;
    json_t *photographs = json_array(), *rows = json_array(), *truth = json_object();
    struct phantom_view_table *t = calloc(1, sizeof *t);
    status st = STATUS_OK;
    if (t == NULL || photographs == NULL || rows == NULL || truth == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot make photographs: out of memory");
        goto out;
    }
    if (o->px < 1 || o->px > 4096 || o->n_path < 1) {
        st = error_set(err, STATUS_INVALID, "a photograph needs 1 to 4096 pixels a side and at least one path");
        goto out;
    }
    if (o->table_file == NULL)
        phantom_view_table_builtin(t);
    else
        st = phantom_view_table_read(t, o->table_file, err);
    for (size_t i = 0; i < t->n && st == STATUS_OK; i++) st = check_view(o, &t->view[i], err);
    if (st == STATUS_OK) st = durable_make_folder(o->folder, err);
    if (st == STATUS_OK) st = load_scene(o, &scene, truth, err);
    const struct progress quiet = progress_silent(progress);
    struct photograph_lists lists = {photographs, rows};
    for (size_t i = 0; i < t->n && st == STATUS_OK; i++) {
        st = make_photograph(o, scene, &t->view[i], i, pool, &quiet, &lists, err);
        progress_report(progress, (double)(i + 1) / (double)t->n);
    }
    if (st != STATUS_OK) goto out;
    json_object_set_new(truth, "model", json_string(o->model->id));
    json_object_set_new(truth, "parameter", param_json(&o->sets.info, o->param));
    json_object_set_new(truth, "seed", json_integer((json_int_t)o->seed));
    json_object_set_new(truth, "n_path", json_integer((json_int_t)o->n_path));
    json_object_set_new(truth, "noise", json_real(o->noise));
    json_object_set_new(truth, "black_sheet", json_boolean(o->black_sheet));
    json_object_set_new(truth, "lamp",
                        json_pack("{s:s,s:f,s:f}", "kind", o->lamp_directional ? "directional" : "square", "side_cm",
                                  o->lamp_side_cm, "distance_cm", o->lamp_distance_cm));
    json_object_set_new(
        truth, "environment",
        json_pack("{s:[f,f,f]}", "radiance", o->environment_rgb[0], o->environment_rgb[1], o->environment_rgb[2]));
    json_object_set_new(truth, "camera",
                        json_pack("{s:f,s:f,s:b,s:f}", "distance_cm", o->camera_distance_cm, "crop_cm", o->crop_cm,
                                  "far_field", o->camera_far_field, "blur_mm", o->camera_blur_mm));
    json_object_set(truth, "photographs", rows);
    st = phantom_json_write(photographs, o->folder, "photographs.json", err);
    if (st == STATUS_OK) st = phantom_json_write(truth, o->folder, "truth.json", err);
out:
    scene_free(scene);
    free(t);
    json_decref(photographs);
    json_decref(rows);
    json_decref(truth);
    return st;
}
