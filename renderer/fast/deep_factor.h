/* A factor on deep light by what a hit shows. The table of deep light has means over a tile; in valleys between yarns
 * and on the sides of yarns there is less of it, and on a bent cloth light goes from fold to fold. For one picture the
 * factor is a linear function of DEEP_FACTOR terms: of depth in the cloth, and of the angles between fiber, normal,
 * view and light. It is fitted to some paths of the same view that go on beyond the traced hits (deep_fit.h). */
#ifndef SELVEDGE_RENDERER_DEEP_FACTOR_H
#define SELVEDGE_RENDERER_DEEP_FACTOR_H

#include <stdbool.h>

enum { DEEP_FACTOR_ANGLE = 11, DEEP_FACTOR = 4 + 2 * DEEP_FACTOR_ANGLE };

struct deep_factor {
    float weight[3][DEEP_FACTOR]; /* of the terms, of each channel */
};

/* A hit in the frame of the flat cloth. Unit vectors. */
struct deep_seen {
    float depth; /* below the highest fiber, over the thickness of the cloth */
    float tangent[3], normal[3], wo[3];
};

/* term[0] is 1. */
void deep_factor_terms(const struct deep_seen *at, const float wi[3], float term[DEEP_FACTOR]);
/* Multiplies the deep light of one direction, within bounds that fitted functions leave only where nothing was seen. */
void deep_factor_apply(const struct deep_factor *f, const float term[DEEP_FACTOR], float rgb[3]);

#endif
