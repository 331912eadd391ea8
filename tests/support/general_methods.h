/* The methods of descent that fit every model (method_catalogue.h, only_model), for tests that walk the registry. */
#ifndef SELVEDGE_TESTS_GENERAL_METHODS_H
#define SELVEDGE_TESTS_GENERAL_METHODS_H

#include "optimizer/fit/descent/descent.h"

/* NULL-terminated, in the order of the registry. */
const struct descent_method *const *general_methods(void);

#endif
