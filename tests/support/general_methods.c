#include "tests/support/general_methods.h"

enum { MOST_METHODS = 8 };

const struct descent_method *const *general_methods(void)
{
    static const struct descent_method *general[MOST_METHODS + 1];
    size_t n = 0;
    for (const struct descent_method *const *m = descent_registry(); *m != NULL && n < MOST_METHODS; m++)
        if ((*m)->info->only_model == NULL) general[n++] = *m;
    general[n] = NULL;
    return general;
}
