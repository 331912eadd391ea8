#include "tests/support/model/model_furnace.h"
#include "tests/support/model/fiber_angles.h"

#include <math.h>

void model_furnace(const struct scattering_model *m, const struct scattering_state *s, const struct model_furnace *q,
                   double theta_rad, bool from_light, double sum[3])
{
    const int n_view = m->near_field ? q->n_view : 1;
    sum[0] = sum[1] = sum[2] = 0;
    for (int view = 0; view < n_view; view++)
        for (int i = 0; i < q->n_theta; i++)
            for (int j = 0; j < q->n_phi; j++) {
                double theta = M_PI * ((i + 0.5) / q->n_theta - 0.5), phi = 2 * M_PI * (j + 0.5) / q->n_phi;
                double at = q->azimuth_rad, other = phi, c = cos(theta);
                if (m->near_field) { /* the azimuth of wo is the place of the view, and phi that of wi beyond it */
                    double place = scattering_view_azimuth_rad(m, view, n_view);
                    at = from_light ? place + phi : place;
                    other = from_light ? place : place + phi;
                }
                float one[3], all[3], rgb[3];
                direction(theta_rad, at, one);
                direction(theta, other, all);
                m->eval(s, from_light ? one : all, from_light ? all : one, rgb, NULL);
                const bool by_width = !from_light && m->width != NULL;
                double widths = by_width ? (double)(m->width(s, all, NULL) / m->width(s, one, NULL)) : 1;
                for (int k = 0; k < 3; k++)
                    sum[k] += (double)rgb[k] * widths * c * c * (M_PI / q->n_theta) * (2 * M_PI / q->n_phi) / n_view;
            }
}
