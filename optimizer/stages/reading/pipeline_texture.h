/* The photograph that shows the weave of a described cloth: it gives the draft where the job has none, and is compared
 * with it where it has one. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_TEXTURE_H
#define SELVEDGE_OPTIMIZER_PIPELINE_TEXTURE_H

#include "optimizer/stages/job_inputs.h"

/* The cloth of the document, which the photograph completes. */
struct texture_input {
    const struct stage_tools *tools;
    struct job_cloth *cloth;
};

/* Fills in *texture. Without weave and draft in the job it replaces the draft of in->cloth->description, and
 * the numbers that texture_start.h names; else a contradiction becomes a warning, and so does a photograph without a
 * weave. Errors with the field "cloth.texture": the file cannot be read, or the draft is to come from it and it
 * shows no weave (STATUS_INVALID). Nothing happens without such a photograph. */
status pipeline_read_texture(const struct texture_input *in, struct texture_guess *texture, struct error *err);

#endif
