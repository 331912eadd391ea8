/* The cloth of a job on the surfaces that its pictures show. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_CLOTH_H
#define SELVEDGE_OPTIMIZER_SURFACE_CLOTH_H

#include "optimizer/worker/pipeline_context.h"

/* The cloth of c->scene, which must outlive it, as picture i shows it. STATUS_FORMAT and STATUS_INVALID (field: option
 * id), naming the picture: a mesh that cannot be used or that bends too tightly. STATUS_NO_MEMORY. */
status surface_cloth_new(const struct pipeline_context *c, size_t i, struct scene **bent, struct error *err);
/* Whether the cloth can be laid on the surfaces of all pictures, so that a fault is found before the fit. Errors as
 * above. */
status surface_cloth_check(const struct pipeline_context *c, struct error *err);

#endif
