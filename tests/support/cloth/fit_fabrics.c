#include "tests/support/cloth/fit_fabrics.h"

#include <string.h>

#define TWO_LOBE "two_lobe.v1"

const struct fit_fabric fit_fabric[] = {
    {"mid1", PHANTOM_PLAIN, TWO_LOBE, {0.15, 0.08, 0.05, 0.9, 0.6, 0.4, 5, 15, 20}},
    {"gabardine", PHANTOM_TWILL_2_2, TWO_LOBE, {0.185, 0.047, 0.069, 0.999, 0.330, 0.354, 2.141, 10, 23.548}},
    {"mid2", PHANTOM_TWILL_2_2, TWO_LOBE, {0.3, 0.25, 0.2, 0.7, 0.75, 0.5, 3, 20, 15}},
    {"silk", PHANTOM_SATIN_5, TWO_LOBE, {0.745, 0.008, 0.070, 0.620, 0.553, 0.562, 1, 10, 19.823}},
    {"mid3", PHANTOM_SATIN_5, TWO_LOBE, {0.06, 0.06, 0.1, 0.4, 0.6, 0.85, 7, 12, 30}},
    {"fleece", PHANTOM_FELT, TWO_LOBE, {0.040, 0.087, 0.087, 0.452, 0.725, 0.948, 7.238, 10, 25.989}},
    {"volume",
     PHANTOM_TWILL_2_2,
     "phase_two_lobe.v1",
     {0.110, 0.035, 0.048, 0.868, 0.633, 0.592, 5.034, 10, 23.902, 0.993, 0.651, 0.698, 4000}},
    {"microflake", PHANTOM_TWILL_2_2, "microflake.v1", {0.967, 0.160, 0.230, 0.013, 4000}},
    {0},
};

const struct fit_fabric *fit_fabric_find(const char *name)
{
    for (const struct fit_fabric *f = fit_fabric; f->name != NULL; f++)
        if (strcmp(f->name, name) == 0) return f;
    return NULL;
}
