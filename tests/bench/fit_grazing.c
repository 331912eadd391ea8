/* Lamp and camera in mirrored directions, from the normal to grazing: figures fit.grazing.* of bench_fit. */
#include "base/angle.h"
#include "base/catalogue/method_catalogue.h"
#include "optimizer/job/document/job_setup.h"
#include "tests/bench/fit_bench.h"
#include "tests/support/cloth/fit_fabrics.h"

#include <math.h>
#include <stdio.h>

enum { N_MIRROR = 18, MIRROR_STEP_DEG = 5 };

static void print_mirror(const char *of, double angle_deg, const double rgb[3], double se)
{
    printf("{\"name\":\"fit.grazing.%s\",\"value\":%.5g,\"unit\":\"1\",\"better\":\"higher\",\"angle_deg\":%g,\"se\":%."
           "2g}\n",
           of, (rgb[0] + rgb[1] + rgb[2]) / 3.0, angle_deg, se);
}

/* Prints the fitted photographs that were taken in mirrored directions. */
static void print_mirror_photographs(const struct observation_set *o)
{
    const double deg = DEG_PER_RAD;
    for (size_t i = 0; i < o->n; i++) {
        const struct configuration *k = &o->item[i].configuration;
        if (fabs(k->light_theta_rad - k->camera_theta_rad) > 1e-6 || k->cloth_rotation_rad != 0.0 ||
            fabs(fabs(k->light_phi_rad - k->camera_phi_rad) - M_PI) > 1e-6)
            continue;
        print_mirror("photograph", k->light_theta_rad * deg, o->item[i].mean_rgb, 0.0);
    }
}

/* Replaces the observations of f by n mirrored directions from first_deg on. */
static void observe_mirror(struct fit_phantom *f, double first_deg, size_t n)
{
    const struct job_setup set_up = {
        .lamp_side_cm = 10.0, .lamp_distance_cm = 61.0, .camera_distance_cm = 100.0, .crop_cm = 1.0};
    struct observation_set o;
    struct error err = {0};
    observation_set_init(&o);
    for (size_t i = 0; i < n; i++) {
        double theta_deg = first_deg + MIRROR_STEP_DEG * (double)i;
        const struct observation item = {.set = JOB_SET_HELD_OUT,
                                         .weight = 1.0,
                                         .configuration =
                                             observation_configuration(&set_up, theta_deg, 0.0, theta_deg, 180.0, 0.0)};
        fit_check(observation_set_append(&o, &item, &err), &err);
    }
    fit_phantom_observe(f, &o);
    observation_set_release(&o);
}

static double mean_se(const struct estimate *e) { return sqrt(e->var[0] + e->var[1] + e->var[2]) / 3.0; }

static void print_mirror_curve(const struct bench *b, struct fit_phantom *f, const char *name, const double *param)
{
    struct estimate e[N_MIRROR];
    observe_mirror(f, 0.0, N_MIRROR);
    fit_phantom_render(f, param, b->score_paths, e);
    for (size_t i = 0; i < N_MIRROR; i++) print_mirror(name, MIRROR_STEP_DEG * (double)i, e[i].mean, mean_se(&e[i]));
    fflush(stdout);
}

/* Prints the largest radiance of microflakes at 80 degrees (thesis, figure 5.15), with the albedo at its upper bound,
 * over the range of gamma and for several d. */
static void print_brightest_microflake(const struct bench *b, const struct fit_cloth *cloth)
{
    enum { N_GAMMA = 7, N_DENSITY = 3 };
    const double at_deg = 80.0;
    struct fit_phantom f;
    struct estimate e, brightest = {0};
    double param[FIT_MAX_PARAM];
    fit_phantom_init_on(&f, b->folder, b->pool, cloth, "microflake.v1", NULL);
    observe_mirror(&f, at_deg, 1);
    size_t i_gamma = f.model.n_param - 2, i_d = f.model.n_param - 1;
    const struct param_info *gamma = &f.model.param[i_gamma];
    for (size_t p = 0; p < i_gamma; p++) param[p] = f.model.param[p].upper;
    for (size_t g = 0; g < N_GAMMA; g++)
        for (size_t d = 0; d < N_DENSITY; d++) {
            param[i_gamma] = gamma->lower * pow(gamma->upper / gamma->lower, (double)g / (N_GAMMA - 1));
            param[i_d] = f.model.param[i_d].start * pow(4.0, (double)d - 1.0);
            fit_phantom_render(&f, param, b->score_paths, &e);
            fprintf(stderr, "  microflake, albedo %.3f, gamma %.3f, d %.0f /cm: %.3f\n", param[0], param[i_gamma],
                    1e-2 * param[i_d], e.mean[0]);
            if (e.mean[0] > brightest.mean[0]) brightest = e;
        }
    print_mirror("microflake_brightest", at_deg, brightest.mean, mean_se(&brightest));
    fit_phantom_release(&f);
}

/* Fits all models to photographs of Gabardine that are made with two_lobe.v1, and prints their grazing radiances. */
void bench_grazing(const struct bench *b)
{
    const struct fit_fabric *fabric = fit_fabric_find("gabardine");
    struct fit_cloth cloth;
    struct fit_phantom truth;
    fit_cloth_init(&cloth, &(struct fit_cloth_option){.weave = fabric->weave, .with_volume = true}, b->pool);
    fit_phantom_init_on(&truth, b->folder, b->pool, &cloth, fabric->model_id, fabric->truth);
    bench_keep_truth_inside(&truth);
    bench_photograph(b, &truth);
    print_mirror_photographs(&truth.fitted);
    for (size_t k = 0; k < BENCH_N_MODEL; k++) {
        struct fit_phantom f;
        struct fit_result r;
        if (!bench_takes_model(b, k)) continue;
        fprintf(stderr, "grazing, %s\n", bench_model[k].name);
        fit_phantom_init_on(&f, b->folder, b->pool, &cloth, bench_model[k].id, NULL);
        fit_phantom_observe(&f, &truth.observation);
        bench_run_fit(&f, method_gauss_newton.id, 1, b->path_budget, NULL, &r, NULL);
        bench_print_fit(&f, &r);
        print_mirror_curve(b, &f, bench_model[k].name, r.param);
        fit_phantom_release(&f);
    }
    print_mirror_curve(b, &truth, "truth", truth.truth);
    print_brightest_microflake(b, &cloth);
    fit_phantom_release(&truth);
    fit_cloth_release(&cloth);
}
