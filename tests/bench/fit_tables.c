/* Measured tables: figures fit.real.* and fit.real_all_rotations.* of bench_fit. */
#include "base/angle.h"
#include "base/catalogue/method_catalogue.h"
#include "base/files/durable.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/rows/measurement_table.h"
#include "tests/bench/fit_bench.h"

#include <glob.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* REAL_BUDGET is the path budget of a fit, MOST_SCORE_PATHS the largest number of paths for each configuration and
 * replica of a score. Rows state no errors and the models deviate by several percent, so more paths would not be
 * useful. */
enum { MAX_REAL = 32, REAL_BUDGET = 2000000, MOST_SCORE_PATHS = 400000 };
#define SCORE_SE 0.01

struct real {
    const struct bench *bench;
    bool all_rotations;
    struct fit_cloth cloth[2]; /* weave and felt, made for the first sample that needs them */
};

struct real_row {
    char sample[64];
    struct observation_set observation;
    double error[BENCH_N_MODEL][2]; /* fitted, held out */
};

static void print_rows(const struct fit_phantom *f, const double *param, size_t n_path)
{
    struct estimate e[FIT_MAX_OBSERVATION];
    const double deg = DEG_PER_RAD;
    fit_phantom_render(f, param, n_path, e);
    fprintf(stderr, "  %-12s %5s %5s %5s %5s %5s  %-24s  %s\n", "row", "lamp", "phi", "cam", "phi", "turn", "measured",
            "rendered / measured");
    for (size_t i = 0; i < f->observation.n; i++) {
        const struct observation *o = &f->observation.item[i];
        const struct configuration *k = &o->configuration;
        fprintf(stderr, "  %-12s %5.0f %5.0f %5.0f %5.0f %5.0f ", o->name, k->light_theta_rad * deg,
                k->light_phi_rad * deg, k->camera_theta_rad * deg, k->camera_phi_rad * deg,
                k->cloth_rotation_rad * deg);
        for (int c = 0; c < 3; c++) fprintf(stderr, " %7.4f", o->mean_rgb[c]);
        for (int c = 0; c < 3; c++)
            fprintf(stderr, "  %5.2f +- %.2f", e[i].mean[c] / o->mean_rgb[c], sqrt(e[i].var[c]) / o->mean_rgb[c]);
        fputc('\n', stderr);
    }
}

/* The tables have each row twice, with the cloth turned by 0 and by 90 degrees, and with equal values. This keeps one
 * of the two as a mean over all rotations. */
static void take_as_isotropic(struct observation_set *o)
{
    size_t n = 0;
    for (size_t i = 0; i < o->n; i++) {
        if (o->item[i].configuration.cloth_rotation_rad != 0.0) continue;
        o->item[n] = o->item[i];
        o->item[n++].configuration.n_rotation = CONFIGURATION_ALL_ROTATIONS;
    }
    o->n = n;
}

static void read_table(const struct real *real, const char *path, struct real_row *row)
{
    struct error err = {0};
    char *text = NULL;
    size_t n = 0;
    const struct job_setup set_up = {.lamp_side_cm = 10.0,
                                     .lamp_distance_cm = 61.0,
                                     .camera_distance_cm = 100.0,
                                     .crop_cm = 1.0,
                                     .black_sheet = true};
    observation_set_init(&row->observation);
    fit_check(file_read_all(path, 1 << 20, &text, &n, &err), &err);
    fit_check(measurement_table_parse(text, n, row->sample, &set_up, &row->observation, &err), &err);
    if (real->all_rotations) take_as_isotropic(&row->observation);
    free(text);
}

/* Both errors are estimated with fresh paths. The fit's own objective is too low, because its minimum is partly due
 * to the noise of the paths that it was fitted to. */
static void score_table(const struct real *real, const struct fit_phantom *f, const double *param, size_t k,
                        struct real_row *row)
{
    const struct fit_score_goal goal = {SCORE_SE, real->bench->score_paths / 2, MOST_SCORE_PATHS};
    for (int held_out = 0; held_out < 2; held_out++) {
        char what[160];
        const struct fit_score s = fit_phantom_score_to(f, held_out ? JOB_SET_HELD_OUT : JOB_SET_FIT, param, &goal);
        row->error[k][held_out] = s.rel_rms;
        fprintf(stderr, "  %s %.3f +- %.3f\n", held_out ? "held out" : "fitted", s.rel_rms, s.se);
        snprintf(what, sizeof what, "%s.%s.%s", row->sample, bench_model[k].name,
                 held_out ? "heldout_rel_rms" : "fit_rel_rms");
        bench_print(real->all_rotations ? "real_all_rotations" : "real", what, s.rel_rms, "1", "lower");
    }
}

static void fit_table(const struct real *real, const struct fit_cloth *cloth, size_t k, struct real_row *row)
{
    const struct bench *b = real->bench;
    struct fit_phantom f;
    struct fit_result r;
    fprintf(stderr, "%s, %s\n", row->sample, bench_model[k].name);
    fit_phantom_init_on(&f, b->folder, b->pool, cloth, bench_model[k].id, NULL);
    fit_phantom_observe(&f, &row->observation);
    bench_run_fit(&f, method_gauss_newton.id, 1, b->path_budget > 0 ? b->path_budget : REAL_BUDGET, NULL, &r, NULL);
    bench_print_fit(&f, &r);
    if (b->row_paths > 0) print_rows(&f, r.param, b->row_paths);
    score_table(real, &f, r.param, k, row);
    fit_phantom_release(&f);
}

static void print_table(const struct bench *b, const struct real_row *row, size_t n)
{
    fprintf(stderr, "%-32s", "relative RMS, fitted / held out");
    for (size_t k = 0; k < BENCH_N_MODEL; k++)
        if (bench_takes_model(b, k)) fprintf(stderr, "%20s", bench_model[k].name);
    for (size_t i = 0; i < n; i++) {
        fprintf(stderr, "\n%-32s", row[i].sample);
        for (size_t k = 0; k < BENCH_N_MODEL; k++)
            if (bench_takes_model(b, k)) fprintf(stderr, "%12.3f / %.3f", row[i].error[k][0], row[i].error[k][1]);
    }
    fputc('\n', stderr);
}

static const struct fit_cloth *real_cloth(struct real *real, const char *data, const char *sample)
{
    const struct bench *b = real->bench;
    const bool felt = strstr(sample, "felt") != NULL;
    struct fit_cloth *cloth = &real->cloth[felt];
    char yarn[1024];
    if (cloth->scene != NULL) return cloth;
    snprintf(yarn, sizeof yarn, "%s/yarns/cotton1.txt", data);
    const char *file = b->yarn == NULL ? yarn : b->yarn;
    const struct fit_cloth_option weave = {.weave = PHANTOM_PLAIN,
                                           .yarn_file = strcmp(file, "none") == 0 ? NULL : file,
                                           .flatness = b->flatness,
                                           .with_volume = true},
                                  lofty = {.weave = PHANTOM_FELT, .lofty = true, .with_volume = true};
    fit_cloth_init(cloth, felt ? &lofty : &weave, b->pool);
    return cloth;
}

static size_t read_tables(const struct real *real, const char *pattern, struct real_row row[MAX_REAL])
{
    glob_t found;
    size_t n = 0;
    if (glob(pattern, 0, NULL, &found) != 0) {
        fprintf(stderr, "skipped: no '%s' (set SELVEDGE_DATA)\n", pattern);
        return 0;
    }
    for (size_t i = 0; i < found.gl_pathc && n < MAX_REAL; i++) {
        const char *slash = strrchr(found.gl_pathv[i], '/'), *sample = real->bench->sample;
        snprintf(row[n].sample, sizeof row[n].sample, "%s", slash != NULL ? slash + 1 : found.gl_pathv[i]);
        row[n].sample[strcspn(row[n].sample, ".")] = '\0';
        if (sample == NULL || strcmp(sample, row[n].sample) == 0) read_table(real, found.gl_pathv[i], &row[n++]);
    }
    globfree(&found);
    if (n > 0) return n;
    fprintf(stderr, "no table '%s' in '%s'\n", real->bench->sample, pattern);
    exit(1);
}

void bench_real(const struct bench *b, bool all_rotations)
{
    const char *set = getenv("SELVEDGE_DATA"), *data = set != NULL ? set : "../shared/data";
    char pattern[1024];
    struct real_row row[MAX_REAL] = {0};
    struct real real = {.bench = b, .all_rotations = all_rotations};
    snprintf(pattern, sizeof pattern, "%s/measured-reflectance/*.csv", data);
    size_t n = read_tables(&real, pattern, row);
    for (size_t k = 0; k < BENCH_N_MODEL; k++)
        for (size_t i = 0; i < n && bench_takes_model(b, k); i++)
            fit_table(&real, real_cloth(&real, data, row[i].sample), k, &row[i]);
    if (n > 0) print_table(b, row, n);
    for (size_t i = 0; i < n; i++) observation_set_release(&row[i].observation);
    for (size_t k = 0; k < 2; k++)
        if (real.cloth[k].scene != NULL) fit_cloth_release(&real.cloth[k]);
}
