/* Energy of a scattering model by quadrature over the directions of one side. */
#ifndef SELVEDGE_TESTS_MODEL_FURNACE_H
#define SELVEDGE_TESTS_MODEL_FURNACE_H

#include "renderer/scattering/scattering.h"

struct model_furnace {
    int n_theta, n_phi; /* midpoints in both angles */
    int n_view;         /* of a near field: offsets of the view across the fiber, over which the mean is taken */
    double azimuth_rad; /* of the one direction, without a near field */
};

/* Integral of S cos th over all directions of one side, per channel: over all that light leaves to, of light that comes
 * from theta_rad (from_light), or over all that it comes from, of what leaves to theta_rad. There light counts by the
 * width that the section shows to it, over that which it shows to the view, for models that state it (fabric thesis,
 * equation 2.11). */
void model_furnace(const struct scattering_model *m, const struct scattering_state *s, const struct model_furnace *q,
                   double theta_rad, bool from_light, double sum[3]);

#endif
