/* A complex number from its parts, as CMPLX of C11, which clang does not have with the headers of Debian 12. */
#ifndef SELVEDGE_RENDERER_COMPLEX_PARTS_H
#define SELVEDGE_RENDERER_COMPLEX_PARTS_H

#include <complex.h>

/* In place of re + I * im, which multiplies im by 0 as well. C17, 6.2.5, paragraph 13: a complex number is laid out
 * like an array of its two parts. */
static inline double complex complex_of(double re, double im)
{
    const union {
        double part[2];
        double complex z;
    } both = {{re, im}};
    return both.z;
}

/* A product without the checks for infinities that C asks for. */
static inline double complex complex_product(double complex a, double complex b)
{
    return complex_of(creal(a) * creal(b) - cimag(a) * cimag(b), creal(a) * cimag(b) + cimag(a) * creal(b));
}

#endif
