/* The integral of a Gaussian over (u, v, s, t) along the graph of a linear normal on a right triangle (000, section
 * 3.5). */
#ifndef SELVEDGE_RENDERER_TRIANGLE_GAUSSIAN_H
#define SELVEDGE_RENDERER_TRIANGLE_GAUSSIAN_H

/* Corner at `corner`, legs along u and v of the signed lengths leg. normal: at the corner, and at the ends of both
 * legs. */
struct glint_triangle {
    double corner[2], leg[2];
    double normal[3][2];
};

/* The query exp(-(u - center)^T inverse (u - center) / 2 - |n - half|^2 / (2 variance_r)), without a factor. */
struct triangle_query {
    double center[2], inverse[3]; /* uu, uv, vv */
    double half[2], variance_r;
};

/* Returns the integral over u in the triangle. The inner integral, along the axis on which the integrand is narrower,
 * is closed (erf); the outer one is a sum by Gauss and Legendre over pieces no wider than its integrand. */
double triangle_gaussian(const struct glint_triangle *t, const struct triangle_query *q);

#endif
