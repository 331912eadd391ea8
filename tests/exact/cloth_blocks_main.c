/* Traces blocks of paths through a cloth and prints the mean of each block as JSON. It is linked with each of two
 * implementations of renderer/scene, which are compared block by block: equal seeds give both
 * the same random numbers.
 *
 *   cloth_blocks REQUEST.json
 *
 * The request: "fibers" (.hair), "model", "parameters" (name or symbol to value or r, g, b, in the units of files),
 * "configurations" (arrays of light theta, phi, camera theta, phi and rotation in degrees), "blocks", "paths" of a
 * block, "seed"; "far_field": the camera is far away; "mesh" (.obj in millimetres): the cloth lies on it.
 *
 * Printed: {"parameters": [names], "seconds", "configurations": [blocks of [r, g, b, derivatives of r, of g, of b]]}.
 */
#include "base/angle.h"
#include "base/thread_pool.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/surface/path_tracer.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_CONFIGURATIONS = 16 };

struct job {
    struct scene *flat, *scene;
    const struct scattering_model *model;
    struct parameter_sets sets;
    size_t n_configuration, n_block, n_path;
    struct configuration configuration[MOST_CONFIGURATIONS];
    struct path_setting setting[MOST_CONFIGURATIONS];
    uint64_t seed;
    double *sum; /* n_configuration x n_block x (3 + 3 n_param) */
};

static void stop(const char *why, const char *subject)
{
    fprintf(stderr, "cloth_blocks: %s%s%s\n", why, subject != NULL ? ": " : "", subject != NULL ? subject : "");
    exit(1);
}

static void check(status s, const struct error *err)
{
    if (s != STATUS_OK) stop(err->text, NULL);
}

static void read_parameters(const json_t *values, const struct scattering_model *m, double *param)
{
    const char *key;
    json_t *value;
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
    json_object_foreach((json_t *)values, key, value)
    {
        size_t n = 0;
        for (size_t p = 0; p < m->n_param; p++) {
            const struct param_info *info = &m->param[p];
            if (!param_is_named(info, key)) continue;
            const json_t *one = json_is_array(value) ? json_array_get(value, (size_t)info->channel) : value;
            if (!json_is_number(one)) stop("a parameter needs a number or three", key);
            param[p] = param_from_file_unit(info, json_number_value(one));
            n++;
        }
        if (n == 0) stop("the model has no such parameter", key);
    }
}

static void read_configurations(const json_t *list, bool far_field, struct job *j)
{
    j->n_configuration = json_array_size(list);
    if (j->n_configuration == 0 || j->n_configuration > MOST_CONFIGURATIONS) stop("1 to 16 configurations", NULL);
    for (size_t i = 0; i < j->n_configuration; i++) {
        const json_t *row = json_array_get(list, i);
        double angle[5];
        for (size_t k = 0; k < 5; k++) angle[k] = json_number_value(json_array_get(row, k)) * RAD_PER_DEG;
        j->configuration[i] = (struct configuration){.light_theta_rad = angle[0],
                                                     .light_phi_rad = angle[1],
                                                     .camera_theta_rad = angle[2],
                                                     .camera_phi_rad = angle[3],
                                                     .cloth_rotation_rad = angle[4],
                                                     .light_distance_m = 0.61,
                                                     .lamp_side_m = 0.10,
                                                     .camera_distance_m = 1.0,
                                                     .crop_m = 0.01,
                                                     .camera = far_field ? CAMERA_FAR_FIELD : CAMERA_PERSPECTIVE};
    }
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct job *j = context;
    const size_t i = i_task / j->n_block, i_block = i_task % j->n_block, n_jac = 3 * j->model->n_param;
    double *sum = j->sum + i_task * (3 + n_jac);
    const struct rng_key key = {.seed = j->seed, .configuration = (uint32_t)i};
    struct camera camera;
    camera_init(&camera, &j->configuration[i]);
    for (size_t k = 0; k < j->n_path; k++) {
        struct rng rng;
        struct scene_ray ray;
        struct path_result path;
        double xy[2];
        rng_start(&rng, &key, (uint32_t)i_block, (uint32_t)k);
        for (int a = 0; a < 2; a++) xy[a] = rng_double(&rng);
        if (!camera_ray(&camera, j->scene, xy, &ray)) continue;
        path_trace(&j->setting[i], &ray, &rng, &path, NULL);
        for (size_t c = 0; c < 3; c++) sum[c] += (double)path.radiance[c] / (double)j->n_path;
        for (size_t p = 0; p < n_jac; p++) sum[3 + p] += (double)path.jac[p] / (double)j->n_path;
    }
}

static void print_result(const struct job *j, double seconds)
{
    const size_t n_value = 3 + 3 * j->model->n_param;
    json_t *names = json_array(), *all = json_array();
    for (size_t p = 0; p < j->model->n_param; p++) json_array_append_new(names, json_string(j->model->param[p].name));
    for (size_t i = 0; i < j->n_configuration; i++) {
        json_t *blocks = json_array();
        for (size_t b = 0; b < j->n_block; b++) {
            json_t *row = json_array();
            for (size_t v = 0; v < n_value; v++)
                json_array_append_new(row, json_real(j->sum[(i * j->n_block + b) * n_value + v]));
            json_array_append_new(blocks, row);
        }
        json_array_append_new(all, blocks);
    }
    json_t *out = json_pack("{s:o,s:f,s:o}", "parameters", names, "seconds", seconds, "configurations", all);
    json_dumpf(out, stdout, JSON_COMPACT | JSON_REAL_PRECISION(10));
    json_decref(out);
}

static void make_scene(const json_t *q, struct job *j)
{
    struct error err = {0};
    struct fiber_set f;
    fiber_set_init(&f);
    check(fiber_set_read_hair(&f, json_string_value(json_object_get(q, "fibers")), &err), &err);
    check(scene_new(&f, &(struct scene_option){.black_sheet = true}, &j->flat, &err), &err);
    fiber_set_release(&f);
    j->scene = j->flat;
    const char *path = json_string_value(json_object_get(q, "mesh"));
    if (path == NULL) return;
    struct mesh mesh;
    check(mesh_read_obj(path, 1.0, &mesh, &err), &err);
    check(scene_bend(j->flat, &mesh, true, &j->scene, &err), &err);
    mesh_release(&mesh);
}

int main(int argc, char **argv)
{
    static struct job j;
    struct error err = {0};
    struct thread_pool *pool = NULL;
    struct timespec start, end;
    double param[SCATTERING_MAX_PARAM];
    json_t *q = argc == 2 ? json_load_file(argv[1], 0, NULL) : NULL;
    if (q == NULL) stop("one argument: a file with a request in JSON", NULL);
    const char *model = json_string_value(json_object_get(q, "model"));
    j.model = model != NULL ? scattering_find(model) : NULL;
    if (j.model == NULL) stop("no such model", model);
    read_parameters(json_object_get(q, "parameters"), j.model, param);
    read_configurations(json_object_get(q, "configurations"), json_is_true(json_object_get(q, "far_field")), &j);
    j.n_block = (size_t)json_integer_value(json_object_get(q, "blocks"));
    j.n_path = (size_t)json_integer_value(json_object_get(q, "paths"));
    j.seed = (uint64_t)json_integer_value(json_object_get(q, "seed"));
    make_scene(q, &j);
    check(parameter_sets_init(&j.sets, j.scene, j.model, param, 1, &err), &err);
    for (size_t i = 0; i < j.n_configuration; i++)
        path_setting_init_sets(&j.setting[i], j.scene, &j.sets, &j.configuration[i], true);
    const size_t n_task = j.n_configuration * j.n_block;
    j.sum = calloc(n_task * (3 + 3 * j.model->n_param), sizeof *j.sum);
    if (j.sum == NULL) stop("out of memory", NULL);
    check(thread_pool_new(0, &pool, &err), &err);
    clock_gettime(CLOCK_MONOTONIC, &start);
    check(thread_pool_run(pool, n_task, run_task, &j, NULL), &(struct error){.text = "cancelled"});
    clock_gettime(CLOCK_MONOTONIC, &end);
    print_result(&j, (double)(end.tv_sec - start.tv_sec) + 1e-9 * (double)(end.tv_nsec - start.tv_nsec));
    parameter_sets_release(&j.sets);
    if (j.scene != j.flat) scene_free(j.scene);
    scene_free(j.flat);
    thread_pool_free(pool);
    free(j.sum);
    json_decref(q);
    return 0;
}
