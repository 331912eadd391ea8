/* A photograph of cloth, and the guesses that its analysis gives (weave_detect.h). */
#ifndef SELVEDGE_GEOMETRY_WEAVE_GUESS_H
#define SELVEDGE_GEOMETRY_WEAVE_GUESS_H

#include "geometry/weave/weave_contrast.h"
#include "geometry/weave/weave_draft.h"

#include <stddef.h>

/* A photograph, row 0 at the top; linear radiances. Not owned. */
struct weave_picture {
    const float *rgb; /* height x width x 3 */
    size_t width, height;
};

/* A color that the photograph shows, in its own radiance units. */
struct weave_yarn_color {
    double rgb[3];
};

struct weave_guess {
    struct weave_draft draft; /* in pixels of the photograph */
    double middle_px[2];  /* a crossing of warp 0 and weft 0 near the middle of the photograph; pixel centers at 0.5 */
    double spacing_px[2]; /* distance of neighbouring warps, of neighbouring wefts, at right angles to them */
    double direction_deg[2];  /* of the warps, -45 to 135, of the wefts, -90 to 90; 0: to the right, 90: down */
    double texture_period_px; /* of the strongest line of the texture */
    double cover[2];          /* width over spacing, of warp and weft */
    struct weave_yarn_color warp, weft; /* where they are on top */
    double contrast[WEAVE_SCALES];      /* at half of, at and at twice the period (weave_contrast.h) */
    /* From 0 to 1, that it is right: yarns: spacing and direction; draft: they and the draft. */
    double yarns_confidence, draft_confidence, cover_confidence, color_confidence;
};

#endif
