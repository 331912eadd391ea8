/* The catalogue of descent methods: their ids, the terms that they support and their defaults. It is pure data from
 * methods.def, so that a program can check a job document without linking the methods. A new method is a row there and
 * a file in optimizer/fit/descent; the registry of methods follows from the same rows.
 */
#ifndef SELVEDGE_BASE_METHOD_CATALOGUE_H
#define SELVEDGE_BASE_METHOD_CATALOGUE_H

#include <stddef.h>
#include <stdint.h>

/* Terms of the objective, and ends of a fit, that not every method knows. */
enum method_ability {
    METHOD_TAKES_PRIORS = 1,    /* Gaussian priors of parameters */
    METHOD_TAKES_NUISANCE = 2,  /* gains and stray light of the photographs, which have priors of their own */
    METHOD_TAKES_TEXTURE = 4,   /* contrasts of the photographs, with a weight above 0 */
    METHOD_TAKES_PRECISION = 8, /* a goal of precision */
    METHOD_TAKES_STARTS = 16,   /* start values, and several starts */
    METHOD_TAKES_TIES = 32,     /* parameters tied to others */
    METHOD_TAKES_DENSITY = 64,  /* a density that is fitted */
    METHOD_N_ABILITY = 7
};

struct method_info {
    const char *id;               /* "gauss_newton.v1": never used again for another method */
    const char *title;            /* one line for people, with the source */
    unsigned takes;               /* of method_ability */
    const char *only_model;       /* id of the only model that it fits; NULL: it fits every model */
    uint64_t default_path_budget; /* of one fit; 0: follows from the method's schedule */
    size_t default_max_iteration;
    /* With several starts: the random keys of one start (fit_run.h) suffice for these. A method without starts has this
     * limit always. */
    size_t max_iteration_of_starts;
};

/* The i-th method, NULL behind the last. The first is the default. */
const struct method_info *method_catalogue_at(size_t i);
/* NULL when no method has that id. */
const struct method_info *method_catalogue_find(const char *id);
/* The first method that takes all of these (of method_ability); NULL when none does. */
const struct method_info *method_catalogue_taking(unsigned abilities);

/* The rows: method_gauss_newton, ... */
#define DESCENT_METHOD(name, ...) extern const struct method_info method_##name;
#include "base/catalogue/methods.def"

#endif
