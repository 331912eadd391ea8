/* Bessel functions J and Hankel functions of the first kind H of the orders 0 and 1 for complex arguments, which waves
 * in a plane consist of.
 *
 * Below |z| = 17: Miller's recurrence downwards, with the sum over all orders = exp(-i z), and Neumann's series of Y in
 * J (Abramowitz and Stegun 1964, 9.1.46, 9.1.88). Beyond: Hankel's asymptotic series (9.2.5 to 9.2.10), whose smallest
 * term is about exp(-2 |z|) there.
 */
#ifndef SELVEDGE_RENDERER_CYLINDER_FUNCTIONS_H
#define SELVEDGE_RENDERER_CYLINDER_FUNCTIONS_H

#include <complex.h>

struct cylinder_functions {
    double complex j[2], h[2];
};

/* z != 0 with a real part of at least 0 and an imaginary part in [0, 20]; |z| of at least 1e-6. Errors are about 1e-14
 * of the larger of |J| and |H|. */
void cylinder_functions_at(double complex z, struct cylinder_functions *f);

#endif
