/* The cloth of a job on the surfaces that its pictures show. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_CLOTH_H
#define SELVEDGE_OPTIMIZER_SURFACE_CLOTH_H

#include "optimizer/stages/made_cloth.h"

struct job_results;
struct job_setup;

/* The pictures of the document and the cloth that they show. */
struct surface_input {
    const struct stage_tools *tools;
    const struct job_results *results;
    const struct job_setup *setup;
    const struct made_cloth *made;
};

/* As the model sees it: one of both. */
struct surface_cloth {
    struct scene *fibers;
    struct volume_scene volume;
};

/* The cloth of a scene of fibers, or without one (NULL) of on->made->volume_scene, as picture i shows it; these must
 * outlive it. STATUS_FORMAT and STATUS_INVALID (field: option id), naming the picture: a mesh that cannot be used or
 * that bends too tightly. STATUS_NO_MEMORY. Release in any case. */
status surface_cloth_init(const struct surface_input *on, size_t i, const struct scene *fibers,
                          struct surface_cloth *cloth, struct error *err);
void surface_cloth_release(struct surface_cloth *cloth);
/* Checks that the cloth can be laid on the surfaces of all pictures, so that a fault is found before the fit. Errors as
 * above. */
status surface_cloth_check(const struct surface_input *on, struct error *err);

#endif
