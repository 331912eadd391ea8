/* The cloths that fits are judged on, with parameters in file units. */
#ifndef SELVEDGE_TESTS_FIT_FABRICS_H
#define SELVEDGE_TESTS_FIT_FABRICS_H

#include "geometry/phantom/phantom.h"
#include "renderer/scattering/scattering.h"

struct fit_fabric {
    const char *name;
    enum phantom_weave weave;
    const char *model_id;
    double truth[SCATTERING_MAX_PARAM]; /* file units */
};

/* Gabardine, Silk, Fleece: fabric thesis, Table 5.3, fiber model; three mid-range sets; Gabardine of the volume model
 * and of microflakes from the same table. NULL-named end. */
extern const struct fit_fabric fit_fabric[];
/* NULL when there is none of that name. */
const struct fit_fabric *fit_fabric_find(const char *name);

#endif
