/* Models whose tables take 0.03 to 0.4 s each time they are made. Tests that make tables at many points compare these
 * models at fewer of them, and at all in the long variant (`make test-long`). */
#ifndef SELVEDGE_TESTS_DEAR_TABLES_H
#define SELVEDGE_TESTS_DEAR_TABLES_H

#include "base/catalogue/param_info.h"
#include "tests/support/agreement.h"

#include <string.h>

/* False for every model in the long variant. */
static inline bool has_dear_tables(const char *id)
{
    static const char *const dear[] = {"elliptical.v1", "elliptical_oriented.v1",   "microfacet_ellipse.v1", "fur.v1",
                                       "fur_near.v1",   "dielectric_diffraction.v1"};
    for (size_t i = 0; i < sizeof dear / sizeof *dear; i++)
        if (strcmp(id, dear[i]) == 0) return !is_long_variant();
    return false;
}

/* Whether the parameter is of a colour's other channels than the one whose turn it is. A model treats the channels
 * alike, so that one of them stands for all where tables are dear. */
static inline bool is_other_channel(const char *id, const struct param_info *info, size_t turn)
{
    return has_dear_tables(id) && info->channel >= 0 && info->channel != (int)(turn % 3);
}

#endif
