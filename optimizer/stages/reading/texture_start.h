/* Start values of a described cloth from the photograph that shows its weave: values that the job leaves out and the
 * photograph shows with some confidence. Each value that is taken is listed in texture_guess.taken. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_START_H
#define SELVEDGE_OPTIMIZER_TEXTURE_START_H

#include "optimizer/stages/job_inputs.h"

/* From this confidence on something is taken over. */
#define TEXTURE_WORTH_TAKING 0.3

/* Widths of the yarns, of a draft that has come from the photograph. Without the scale of the photograph
 * (cloth.texture_px_per_mm): cover_warp and cover_weft. With it: the threads per centimetre where the job states
 * neither them nor a cover; the flatness of kinds of single yarn, so that they are as wide as seen; and the crimp that
 * bends warp and weft equally sharply, if both distances were taken. Numbers that do not have their standard value
 * stay. STATUS_INVALID, field "cloth.texture_px_per_mm": a scale that gives impossible threads. */
status texture_take_widths(struct job_cloth *cloth, struct texture_guess *texture, struct error *err);

/* Starts the parameters C_TT of named kinds of yarn at the colors of the photograph, with cloth.texture_colors. The
 * brightness is taken from the fitted rows that are lit from the front. A value, a start, a prior or a tie of the job
 * stays. */
void texture_take_colors(const struct stage_tools *tools, struct job_inputs *in);

/* Single-scattering albedo of a thick layer that reflects the share R of diffuse light, by the two-stream approximation
 * for isotropic scattering: R = (1 - s) / (1 + s), albedo = 1 - s^2. */
double texture_albedo(double reflectance);

#endif
