/* The plug-in of the export for Mitsuba, value by value against the models in C: f for random lights, cameras, fibers
 * and parameters. Its density of samples is its own, and is checked by tests/api/exports/test_export.py. */
#include "base/angle.h"
#include "base/rng.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scene/fiber_frame.h"
#include "tests/support/scratch_folder.h"

#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { N_MODEL = 2, N_FIBER = 4, N_DIRECTION = 30, PATH_ROOM = 4096, LINE_ROOM = 1 << 14 };
/* Largest relative difference: the plug-in has tables of 512 angles and single precision. */
static const double tolerance = 0.003;
static const char *const model_id[N_MODEL] = {"two_lobe.v1", "textile.v3"};

struct fiber_case {
    const struct scattering_model *model;
    double param[SCATTERING_MAX_PARAM];
    float along[3], normal[3], light[N_DIRECTION][3], camera[N_DIRECTION][3];
};

static void draw_direction(struct rng *r, float w[3])
{
    const double z = 2.0 * rng_double(r) - 1.0, phi = 2.0 * M_PI * rng_double(r), s = sqrt(1.0 - z * z);
    w[0] = (float)(s * cos(phi));
    w[1] = (float)(s * sin(phi));
    w[2] = (float)z;
}

/* Every other light lies near the cones of R and TT, where narrow lobes have their values: the camera's direction, or
 * the opposite one, mirrored at the normal plane. */
static void draw_light(struct rng *r, struct fiber_case *c, size_t i)
{
    const float *camera = c->camera[i];
    double length = 0.0, along = 0.0, at[3];
    draw_direction(r, c->light[i]);
    if (i % 2 == 0) return;
    for (int a = 0; a < 3; a++) along += (double)camera[a] * (double)c->along[a];
    for (int a = 0; a < 3; a++) {
        const double u = (double)c->along[a], across = (double)camera[a] - along * u;
        at[a] = -along * u + (i % 4 == 1 ? across : -across) + 0.3 * (rng_double(r) - 0.5);
        length += at[a] * at[a];
    }
    for (int a = 0; a < 3; a++) c->light[i][a] = (float)(at[a] / sqrt(length));
}

static void draw_case(struct rng *r, const struct scattering_model *m, struct fiber_case *c)
{
    struct fiber_frame f;
    float other[3];
    c->model = m;
    for (size_t p = 0; p < m->n_param; p++)
        c->param[p] = m->param[p].lower + (0.02 + 0.96 * rng_double(r)) * (m->param[p].upper - m->param[p].lower);
    draw_direction(r, c->along);
    draw_direction(r, other);
    fiber_frame_flat_in(&f, c->along, other);
    memcpy(c->normal, f.v, sizeof f.v);
    for (size_t i = 0; i < N_DIRECTION; i++) {
        draw_direction(r, c->camera[i]);
        draw_light(r, c, i);
    }
}

static json_t *vector_json(const float w[3])
{
    return json_pack("[f, f, f]", (double)w[0], (double)w[1], (double)w[2]);
}

static json_t *case_json(const struct fiber_case *c)
{
    json_t *parameters = json_object(), *directions = json_array();
    for (size_t p = 0; p < c->model->n_param; p++) {
        char name[64];
        snprintf(name, sizeof name, "%s", c->model->param[p].name);
        if (strchr(name, '.') != NULL) *strchr(name, '.') = '_';
        json_object_set_new(parameters, name, json_real(param_to_file_unit(&c->model->param[p], c->param[p])));
    }
    for (size_t i = 0; i < N_DIRECTION; i++)
        json_array_append_new(directions, json_pack("[o, o]", vector_json(c->light[i]), vector_json(c->camera[i])));
    return json_pack("{s:s, s:o, s:o, s:o, s:o}", "model", c->model->id, "parameters", parameters, "along",
                     vector_json(c->along), "normal", vector_json(c->normal), "directions", directions);
}

/* S cos th_i of the model, in the frame that the tracer gives it. */
static void value_of(const struct fiber_case *c, const struct scattering_state *s, size_t i, double rgb[3])
{
    struct fiber_frame f;
    float wi[3], wo[3], value[3];
    fiber_frame_flat(&f, c->along);
    fiber_frame_to_local(&f, c->light[i], wi);
    fiber_frame_to_local(&f, c->camera[i], wo);
    c->model->eval(s, wi, wo, value, NULL);
    for (int k = 0; k < 3; k++) rgb[k] = (double)value[k] * sqrt((double)(wi[1] * wi[1] + wi[2] * wi[2]));
}

/* Compares the numbers of a line; differences count against the channel's largest value of the fiber, too, because
 * values far down the tail of a lobe are of no importance. Returns the largest one. */
static double largest_difference(const struct fiber_case *c, char *line)
{
    struct scattering_state *s = NULL;
    struct error err = {0};
    static double ours[N_DIRECTION][3];
    double most[3] = {0}, worst = 0.0;
    if (c->model->prepare(c->param, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
    for (size_t i = 0; i < N_DIRECTION; i++) {
        value_of(c, s, i, ours[i]);
        for (int k = 0; k < 3; k++) most[k] = fmax(most[k], ours[i][k]);
    }
    for (size_t i = 0; i < N_DIRECTION; i++)
        for (int k = 0; k < 3; k++) {
            char *end;
            const double theirs = strtod(line, &end);
            assert_true(end != line);
            line = end;
            worst = fmax(worst, fabs(theirs - ours[i][k]) / (ours[i][k] + 1e-3 * most[k]));
        }
    c->model->release(s);
    return worst;
}

static void check_bound(const char *line)
{
    char model[32], name[32];
    double low, high;
    assert_int_equal(sscanf(line, "bound %31s %31s %lf %lf", model, name, &low, &high), 4);
    char *under = strrchr(name, '_');
    if (under != NULL && strchr("rgb", under[1]) != NULL && name[0] == 'C') *under = '.';
    const struct scattering_model *m = scattering_find(model);
    const int p = scattering_param_index(m, name);
    assert_true(p >= 0);
    const struct param_info *info = &m->param[p];
    assert_true(low <= param_to_file_unit(info, info->lower) + 1e-9);
    assert_true(high >= param_to_file_unit(info, info->upper) - 1e-9);
}

/* What the file says of a wrong parameter names it. */
static void check_refusal(const char *line)
{
    char name[32], quoted[40];
    int n = 0;
    assert_int_equal(sscanf(line, "refused %31s %n", name, &n), 1);
    snprintf(quoted, sizeof quoted, "'%s'", name);
    if (strstr(line + n, quoted) == NULL) fail_msg("'%s' is not named by: %s", name, line + n);
}

static FILE *start_plug_in(void **state, const struct fiber_case *c, size_t n)
{
    const char *build = getenv("SELVEDGE_BUILD"), *in = scratch_path(state, "cases.json");
    char python[PATH_ROOM], command[3 * PATH_ROOM];
    json_t *list = json_array();
    snprintf(python, sizeof python, "%s/exports-python/bin/python", build != NULL ? build : "build");
    if (access(python, X_OK) != 0) {
        json_decref(list);
        return NULL;
    }
    for (size_t i = 0; i < n; i++) json_array_append_new(list, case_json(&c[i]));
    assert_int_equal(json_dump_file(list, in, 0), 0);
    json_decref(list);
    snprintf(command, sizeof command, "%s tests/support/python/mitsuba_fiber_values.py %s < %s", python,
             "optimizer/report/export/selvedge_fiber.py", in);
    return popen(command, "r"); // NOLINT(cert-env33-c): a command of this test
}

static void test_the_plug_in_has_the_values_of_the_models(void **state)
{
    enum { N = N_MODEL * N_FIBER };
    static struct fiber_case c[N];
    static char line[LINE_ROOM];
    struct rng r;
    size_t n_bound = 0, n_refused = 0, n = 0;
    rng_start(&r, &(struct rng_key){.seed = 7}, 0, 0);
    for (size_t i = 0; i < N; i++) draw_case(&r, scattering_find(model_id[i / N_FIBER]), &c[i]);
    FILE *out = start_plug_in(state, c, N);
    if (out == NULL) skip(); /* no Python with Mitsuba: make test installs it where there is a package index */
    while (fgets(line, sizeof line, out) != NULL) {
        if (strncmp(line, "bound", 5) == 0) {
            check_bound(line);
            n_bound++;
        } else if (strncmp(line, "refused", 7) == 0) {
            check_refusal(line);
            n_refused++;
        } else if (strncmp(line, "values", 6) == 0) {
            assert_true(n < N);
            const double worst = largest_difference(&c[n], line + 6);
            print_message("%s: %.2g\n", c[n].model->id, worst);
            assert_true(worst < tolerance);
            n++;
        }
    }
    assert_int_equal(pclose(out), 0);
    assert_int_equal(n, N);
    assert_int_equal(n_refused, 5);
    assert_int_equal(n_bound, scattering_find(model_id[0])->n_param + scattering_find(model_id[1])->n_param);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_the_plug_in_has_the_values_of_the_models, scratch_folder_setup,
                                        scratch_folder_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
