/* The catalogue of models, descent methods and stop reasons as JSON, for users and for tools that write tables of it:
 *
 * {"models":[{"id","title","kind":"surface"|"volume",
 *             "parameters":[{"name","symbol","kind","unit","channel":null|0..2,"lower","upper","start","coordinate",
 *                            "meaning"}]}],
 * "methods":[{"id","title","takes":["priors","nuisance","texture","precision","starts","ties","density"],
 *              "default_path_budget":n|null,
 *              "default_max_iterations","max_iterations_with_starts"}],
 * "stop_reasons":[{"id","meaning"}]}
 *
 * Numbers are in the units of files; the words come from base/catalogue/param_info.h. */
#ifndef SELVEDGE_OPTIMIZER_CATALOGUE_JSON_H
#define SELVEDGE_OPTIMIZER_CATALOGUE_JSON_H

#include <jansson.h>

/* Returns a new reference, or NULL when memory ran out. */
json_t *catalogue_json(void);

#endif
