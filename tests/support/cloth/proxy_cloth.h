/* A small weave laid flat or in folds, with an appearance that is known in closed form, for tests and benches of
 * previews of the smooth surface (renderer/preview/proxy). Errors fail the test or end the program. */
#ifndef SELVEDGE_TESTS_PROXY_CLOTH_H
#define SELVEDGE_TESTS_PROXY_CLOTH_H

#include "renderer/preview/proxy/proxy_request.h"
#include "tests/support/cloth/dual_cloth.h"

/* L = V cos_i / (cos_i + cos_o) on the side of the light, and a part of it through the cloth. */
#define PROXY_CLOTH_VALUE 0.6

struct proxy_cloth {
    struct dual_cloth flat;
    struct scene *bent;
    struct appearance_table look;
    struct configuration view; /* lamp of 10 cm at 25 cm from the side, camera 30 cm away, 40 mm wide */
    struct proxy_request q;    /* 64 x 64 pixels, 4 x 4 rays */
};

/* folds: three folds of 40 mm, hung; otherwise a flat square of 60 mm over a black sheet. */
void proxy_cloth_init(struct proxy_cloth *c, bool folds);
void proxy_cloth_release(struct proxy_cloth *c);

#endif
