/* Which fiber goes on where another one ends: in this copy of the tile or in the next. Fibers that are cut at a face of
 * the tile end where their continuation begins, and both are one closed tube. Inside of struct scene. */
#ifndef SELVEDGE_RENDERER_SCENE_ENDS_H
#define SELVEDGE_RENDERER_SCENE_ENDS_H

#include "renderer/scene/scene_data.h"

/* An end of a fiber at which another one goes on. */
struct scene_link {
    uint32_t i_segment, i_other;
    int8_t copy[2]; /* tiles from the segment's copy to the other's */
    bool after;     /* the end of the fiber's last segment, and not the beginning of its first */
    bool other_after;
};

struct scene_ends {
    size_t n;
    struct scene_link *link; /* in the order of segments, the beginning of a fiber before its end */
};

/* Looks at vertices, radii and flags of the segments. STATUS_NO_MEMORY. */
status scene_ends_new(const struct scene *s, struct scene_ends **ends, struct error *err);
void scene_ends_free(struct scene_ends *ends);
/* NULL: the fiber ends there. */
const struct scene_link *scene_ends_find(const struct scene_ends *ends, uint32_t i_segment, bool after);

#endif
