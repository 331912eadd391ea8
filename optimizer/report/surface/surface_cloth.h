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

/* The cloth on a surface: `fibers` for surface models, `volume` for volume models. The other member is unused. */
struct surface_cloth {
    struct scene *fibers;
    struct volume_scene volume;
};

/* Lays the cloth on the surface of picture i: the scene `fibers`, or on->made->volume_scene if `fibers` is NULL. This
 * scene must outlive the result. STATUS_FORMAT and STATUS_INVALID (field: option id), naming the picture: a mesh that
 * cannot be used or that bends too tightly. STATUS_NO_MEMORY. Release in any case. */
status surface_cloth_init(const struct surface_input *on, size_t i, const struct scene *fibers,
                          struct surface_cloth *cloth, struct error *err);
void surface_cloth_release(struct surface_cloth *cloth);
/* Checks that the cloth can be laid on the surfaces of all pictures, so that a fault is found before the fit. Errors as
 * above. */
status surface_cloth_check(const struct surface_input *on, struct error *err);

#endif
