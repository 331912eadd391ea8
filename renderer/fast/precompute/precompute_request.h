/* A request for the tables of the fast renderer (fast_precompute.h). */
#ifndef SELVEDGE_RENDERER_PRECOMPUTE_REQUEST_H
#define SELVEDGE_RENDERER_PRECOMPUTE_REQUEST_H

#include "renderer/scattering/scattering.h"
#include "renderer/scene/scene.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct fast_precompute_request {
    const struct scene *scene;            /* flat */
    const struct scattering_model *model; /* one that looks alike from all sides around the fiber */
    const double *param;                  /* max(n_set, 1) * model->n_param, internal units */
    size_t n_set;                         /* for the material groups; 0 and 1: one for all fibers */
    uint32_t order;                       /* of the harmonics; 0: 4 */
    uint32_t n_path;    /* of a cell that is seen often; rarely seen ones have fewer. 0: 50,000, as published */
    double cell_paths;  /* edge of a cell over the mean free path; 0: 2 */
    bool no_visibility; /* leave out the visibility of segments: n_row is 0 */
    /* Make the table of light that is scattered more than deep_traced times (deep_light.h); 0: leave it out. */
    uint32_t deep_traced;
    uint32_t deep_edge; /* of its grids, from 2 to DEEP_LIGHT_MOST_EDGE; 0: 12 */
    double deep_paths;  /* 0: 8 million */

    /* A file of finished parts, written at least journal_every_s apart, and from which an interrupted call goes on to
     * the same bits; the caller removes it in the end. NULL: none. A file of another request is overwritten. */
    const char *journal_path;
    double journal_every_s;
};

#endif
