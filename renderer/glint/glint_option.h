/* Numbers of a surface with glints, and the footprint of a pixel on it. Lengths are in micrometres of the surface. */
#ifndef SELVEDGE_RENDERER_GLINT_OPTION_H
#define SELVEDGE_RENDERER_GLINT_OPTION_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

enum glint_kind {
    GLINT_NOISE, /* a smooth surface with a Gaussian spectrum: equal correlation lengths or, brushed, unequal ones */
    GLINT_SCRATCHES, /* straight grooves of random place and direction on such a surface */
    GLINT_FLAKES     /* flat flakes, whose normals have a Beckmann distribution */
};

/* Zero where not given: then the value in parentheses holds. STATUS_INVALID for values out of range. */
struct glint_option {
    enum glint_kind kind;
    uint64_t seed;
    uint32_t n_texel; /* texels along an edge of the map, a power of two from 32 to 2,048 (512) */
    float texel_um;   /* edge of a texel on the surface (1) */
    float slope;      /* root mean square of the slope |grad h|; Beckmann's alpha of flakes; 0 to 0.5 (0.1) */
    float roughness;  /* sigma_r: standard deviation of each coordinate of an unresolved normal, 0.001 to 0.2 (0.005) */
    float length_um[2];  /* correlation lengths along u and v: h correlates as exp(-(u / l_u)^2 - (v / l_v)^2); at least
                          * two texels (12 texels each) */
    float flake_um;      /* mean distance of neighbouring flakes, at least two texels (16 texels) */
    float scratch_share; /* share of the surface that grooves cover, 0 to 1 (0.3) */
    float step_texel;    /* distance of elements: 0.5, 1 or 2 texels (1; 0.5 for the least error) */
    bool is_plain;       /* flat elements in place of curved ones, for comparison */
};

/* The Gaussian weight of the places that a pixel sees; the covariance is uu, uv, vv and may be 0. */
struct glint_footprint {
    float center_um[2];
    float covariance_um2[3];
};

/* Uniform numbers that a sample takes. */
enum { GLINT_N_NUMBER = 6 };

/* Replaces zeros by the standard values. STATUS_INVALID names the option that is out of range. */
status glint_option_complete(const struct glint_option *given, struct glint_option *complete, struct error *err);

#endif
