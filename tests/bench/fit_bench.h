/* What the parts of bench_fit share: options, one fit, photographs of a phantom, what is printed. Everything ends the program when it fails. */
#ifndef SELVEDGE_TESTS_BENCH_FIT_H
#define SELVEDGE_TESTS_BENCH_FIT_H

#include "optimizer/fit/descent/descent.h"
#include "tests/support/cloth/fit_phantom.h"

enum { BENCH_N_MODEL = 4, BENCH_MAX_STEP = 600 };

#define BENCH_NOISE 0.005 /* of photographs, relative */

struct bench {
    struct thread_pool *pool;
    const char *folder;
    uint64_t row_paths; /* for each row of a measured table told by itself; 0: none is */
    uint64_t photograph_paths, kept_paths, score_paths, curve_paths;
    uint64_t path_budget, sgd_budget;
    const char *fabric;  /* of "curve" and "published" */
    const char *journal; /* of the published method; NULL: not kept */
    const char *sample;  /* NULL: all measured tables */
    const char *model;   /* NULL: all four on measured tables */
    const char
        *yarn; /* file of the measured tables' yarn; NULL: yarns/cotton1.txt of SELVEDGE_DATA; "none": smooth yarns */
    double flatness; /* of the measured tables' yarns: width over height */
    bool prepare;
};

/* The models that are compared: two of fiber surfaces, two of volumes. */
extern const struct bench_model_name {
    const char *name, *id;
} bench_model[BENCH_N_MODEL];

struct fit_curve {
    size_t n, n_param;
    double wall_s[BENCH_MAX_STEP], paths[BENCH_MAX_STEP], objective[BENCH_MAX_STEP],
        param[BENCH_MAX_STEP][SCATTERING_MAX_PARAM];
};

/* One JSON object fit.<of>.<what>, without the dot when `what` is empty. */
void bench_print(const char *of, const char *what, double value, const char *unit, const char *better);
/* One of bench_model, or NULL: all. */
bool bench_has_model(const char *name);
/* --model: all (NULL) or the k-th. */
bool bench_takes_model(const struct bench *b, size_t k);
/* Step by step into a struct fit_curve; steps beyond BENCH_MAX_STEP are not kept. */
status bench_on_step(void *curve, const struct fit_step *step, struct error *err);
/* From the default start, density multiplier fixed; budget 0: the method's own. journal_file, curve: NULL when not wanted. */
void bench_run_fit(const struct fit_phantom *f, const char *method, uint64_t seed, uint64_t budget,
                   const char *journal_file, struct fit_result *r, struct fit_curve *curve);
/* To standard error: how it ended, fitted and true parameters. */
void bench_tell_fit(const struct fit_phantom *f, const struct fit_result *r);
/* The true parameters are those of a rounded table: not beyond a bound. */
void bench_keep_truth_inside(struct fit_phantom *f);
void bench_photograph(const struct bench *b, struct fit_phantom *f);

/* The parts in files of their own. */
void bench_real(const struct bench *b, bool all_rotations); /* fit_tables.c */
void bench_grazing(const struct bench *b);                  /* fit_grazing.c */

#endif
