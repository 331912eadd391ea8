/* Names of the descent methods: pure data, so that the daemon can check job documents without linking the methods
 * themselves. A test compares this list with the registry (descent.h).
 */
#ifndef SELVEDGE_OPTIMIZER_METHOD_NAMES_H
#define SELVEDGE_OPTIMIZER_METHOD_NAMES_H

#define METHOD_GAUSS_NEWTON "gauss_newton.v1"
#define METHOD_PUBLISHED_SGD "published_sgd.v1"

/* NULL-terminated; the first is the default. */
const char *const *method_name_list(void);

#endif
