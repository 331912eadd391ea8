/* Common functions of the parts of bench_fit: options, one fit, output. A function that fails ends the program. */
#ifndef SELVEDGE_TESTS_BENCH_FIT_H
#define SELVEDGE_TESTS_BENCH_FIT_H

#include "optimizer/fit/descent/descent.h"
#include "tests/support/cloth/fit_phantom.h"

enum { BENCH_N_MODEL = 4, BENCH_MAX_STEP = 600 };

#define BENCH_NOISE 0.005 /* of photographs, relative */

struct bench {
    struct thread_pool *pool;
    const char *folder;
    uint64_t row_paths; /* paths for each row of a measured table when all rows are printed; 0: they are not printed */
    uint64_t photograph_paths, kept_paths, score_paths, curve_paths;
    uint64_t path_budget, sgd_budget;
    const char *fabric;  /* for "curve" and "published" */
    const char *journal; /* file of the published method's estimates; NULL: not kept */
    const char *sample;  /* NULL: all measured tables */
    const char *model;   /* NULL: all four on measured tables */
    /* File of the yarn for measured tables. NULL: yarns/cotton1.txt of SELVEDGE_DATA; "none": smooth yarns. */
    const char *yarn;
    double flatness; /* width over height of the yarns for measured tables */
    bool prepare;
};

/* The models that are compared: two surface models and two volume models. */
extern const struct bench_model_name {
    const char *name, *id;
} bench_model[BENCH_N_MODEL];

struct fit_curve {
    size_t n, n_param;
    double wall_s[BENCH_MAX_STEP], paths[BENCH_MAX_STEP], objective[BENCH_MAX_STEP],
        param[BENCH_MAX_STEP][FIT_MAX_PARAM];
};

/* Prints one JSON object with the name fit.<of>.<what>, or fit.<of> when `what` is empty. */
void bench_print(const char *of, const char *what, double value, const char *unit, const char *better);
/* True for the name of one of bench_model, and for NULL, which means all. */
bool bench_has_model(const char *name);
/* True when --model selects model k. */
bool bench_takes_model(const struct bench *b, size_t k);
/* Appends a step to a struct fit_curve. Steps after the first BENCH_MAX_STEP are dropped. */
status bench_on_step(void *curve, const struct fit_step *step, struct error *err);
/* Runs a fit from the default start with the density multiplier fixed. budget 0: the method's default. journal_file and
 * curve may be NULL. */
void bench_run_fit(const struct fit_phantom *f, const char *method, uint64_t seed, uint64_t budget,
                   const char *journal_file, struct fit_result *r, struct fit_curve *curve);
/* Prints to standard error how the fit ended, and the fitted and true parameters. */
void bench_print_fit(const struct fit_phantom *f, const struct fit_result *r);
/* Moves true parameters that are outside of a bound onto it; they come from a table of rounded numbers. */
void bench_keep_truth_inside(struct fit_phantom *f);
void bench_photograph(const struct bench *b, struct fit_phantom *f);

/* The parts of bench_fit in other files. */
void bench_real(const struct bench *b, bool all_rotations); /* fit_tables.c */
void bench_grazing(const struct bench *b);                  /* fit_grazing.c */
void bench_analytic(void);                                  /* fit_analytic.c */

#endif
