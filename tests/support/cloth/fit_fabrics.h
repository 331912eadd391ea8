/* The cloths on which fits are judged, with their true parameters. */
#ifndef SELVEDGE_TESTS_FIT_FABRICS_H
#define SELVEDGE_TESTS_FIT_FABRICS_H

#include "geometry/phantom/phantom.h"
#include "optimizer/fit/objective/coordinate.h"
#include "renderer/scattering/scattering.h"

struct fit_fabric {
    const char *name;
    enum phantom_weave weave;
    const char *model_id;
    double truth[FIT_MAX_PARAM]; /* file units */
};

/* Gabardine, Silk and Fleece with the parameters of the fiber model in Table 5.3 of the fabric thesis; three cloths
 * with mid-range parameters; and Gabardine with those of the volume model and of microflakes from the same table. The
 * last element has a NULL name. */
extern const struct fit_fabric fit_fabric[];
/* Returns NULL when no cloth has that name. */
const struct fit_fabric *fit_fabric_find(const char *name);

#endif
