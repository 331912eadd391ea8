/* Weights of the sheared filter at one receiver, for the files of this folder. y in units of the lamp's half side, x
 * in receivers. */
#ifndef SELVEDGE_RENDERER_SHEARED_KERNEL_H
#define SELVEDGE_RENDERER_SHEARED_KERNEL_H

#include "renderer/preview/sheared_filter.h"

#include <math.h>

struct sheared_kernel {
    enum sheared_lamp lamp;
    float over_var[2]; /* of w_x along each edge: 1 / (2 sigma_x^2), per square receiver */
    float shift[2];    /* eta: lamp's half sides per receiver */
    float wide[2];     /* sigma_x eta sqrt(2): how far the shift goes within w_x; 0: nothing is known */
};

/* False: nothing was met here, so there is no filter. */
static inline bool sheared_kernel_at(const struct light_field *f, enum sheared_lamp lamp, size_t i_receiver,
                                     struct sheared_kernel *k)
{
    const double sqrt_2 = 1.4142135623730951, least_sigma = 0.25, most_sigma = 0.5 * SHEARED_REACH;
    double low = (double)f->slope[i_receiver][0], high = (double)f->slope[i_receiver][1], l = f->half_side_mm;
    *k = (struct sheared_kernel){.lamp = lamp};
    if (!(low > 0.0)) return false;
    for (int a = 0; a < 2; a++) {
        double sigma = 0.5 * l * low * high / ((high - low) * f->cell[a]); /* infinite for one slope */
        double eta = 0.5 * (low + high) / (low * high) * f->cell[a] / l;
        sigma = fmin(fmax(sigma, least_sigma), most_sigma);
        k->over_var[a] = (float)(0.5 / (sigma * sigma));
        k->shift[a] = (float)eta;
        k->wide[a] = (float)(sigma * eta * sqrt_2);
    }
    return true;
}

static inline float sheared_weight_x(const struct sheared_kernel *k, int a, float offset)
{
    return expf(-offset * offset * k->over_var[a]);
}

/* Weight of a ray whose occluder meets the lamp of the receiver at x at y = y' - eta (x - x'). For the square lamp it
 * makes up for the places of the lamp near its edge, which fewer neighbours have rays for. */
static inline float sheared_weight_y(const struct sheared_kernel *k, int a, float y)
{
    if (!(fabsf(y) <= 1)) return 0;
    if (k->lamp == SHEARED_GAUSSIAN_LAMP) return expf(-2 * y * y);
    if (!(k->wide[a] > 0)) return 1;
    return 2 * erff(1 / k->wide[a]) / (erff((1 - y) / k->wide[a]) + erff((1 + y) / k->wide[a]));
}

/* The mean of the receiver's own rays. */
static inline float sheared_own(const struct light_field *f, size_t i_receiver)
{
    size_t n = f->n_side * f->n_side, sum = 0;
    for (size_t i = 0; i < n; i++) sum += f->lit[i_receiver * n + i];
    return (float)sum / (float)n;
}

/* Place on the lamp of a ray, in half sides. */
static inline float sheared_place(const struct light_field *f, size_t i_receiver, int a, size_t i)
{
    return 2 * ((float)i + f->jitter[i_receiver][a]) / (float)f->n_side - 1;
}

#endif
