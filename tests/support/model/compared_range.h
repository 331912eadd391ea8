/* The range of a model's parameters in which derivatives are compared with differences. It is that of the model, but
 * for the lower bounds of fur.v1 and fur_near.v1: below these, lobes of a degree, a medulla that hardly acts and an
 * alpha near 0, where its derivative vanishes, leave eta, alpha and sigma_ma more noise than the paths of a test take
 * away. At C_T = 0.001 a step of the differences is a fifth of C_T, and its powers bend within it. Tables of the
 * narrowest gamma take twice as long. test_fur has the published fibers that are below.
 */
#ifndef SELVEDGE_TESTS_COMPARED_RANGE_H
#define SELVEDGE_TESTS_COMPARED_RANGE_H

#include "base/angle.h"
#include "base/catalogue/param_info.h"

#include <string.h>

/* The least value of a parameter of the model `id`. */
static inline double compared_range_lower(const char *id, const struct param_info *info)
{
    static const struct {
        const char *symbol;
        double lower;
    } fur[] = {{"C_T", 0.01},
               {"eta", 1.19},
               {"kappa", 0.35},
               {"l", 0.4},
               {"alpha", 0.5 * RAD_PER_DEG},
               {"beta", 2.05 * RAD_PER_DEG},
               {"gamma", 2 * RAD_PER_DEG},
               {"sigma_ms", 0.5},
               {"sigma_ma", 0.01},
               {"g", 0.05}};
    for (size_t k = 0; strncmp(id, "fur", 3) == 0 && k < sizeof fur / sizeof *fur; k++)
        if (strcmp(fur[k].symbol, info->symbol) == 0) return fur[k].lower;
    return info->lower;
}

#endif
