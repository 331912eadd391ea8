/* Inside the job-document parser: the keys of films and sequins in the section "cloth", and pictures of them. */
#ifndef SELVEDGE_OPTIMIZER_JOB_FILM_H
#define SELVEDGE_OPTIMIZER_JOB_FILM_H

#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/json_field.h"

/* Refuses keys that would change nothing, and values that the surface of a film cannot show. f: the object with the
 * keys, which begin with prefix; size_key: the one without which there is no film. STATUS_INVALID, with the key as the
 * field. */
status job_film_check_keys(const struct json_field *f, const char *prefix, const char *size_key,
                           const struct job_film *film, struct error *err);
/* Fills in the material of a film that has passed the check. */
void job_film_take_material(const struct job_film *film, struct film_material *material);
/* Refuses picture i of the document where the cloth has films and its method cannot show metal. STATUS_INVALID, with
 * the key that chooses the method as the field. */
status job_film_check_picture(const struct job_cloth *cloth, const struct job_surface_picture *p, size_t i,
                              struct error *err);

#endif
