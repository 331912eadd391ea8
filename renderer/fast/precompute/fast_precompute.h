/* Makes the tables of the fast renderer from a flat cloth and the scattering of its fibers (fabric thesis, section
 * 6.4). Takes minutes; the same request gives the same bits for any number of threads.
 */
#ifndef SELVEDGE_RENDERER_FAST_PRECOMPUTE_H
#define SELVEDGE_RENDERER_FAST_PRECOMPUTE_H

#include "base/thread_pool.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scene/scene.h"

struct fast_precompute_request {
    const struct scene *scene;            /* flat */
    const struct scattering_model *model; /* one that looks alike from all sides around the fiber */
    const double *param;                  /* max(n_set, 1) * model->n_param, internal units */
    size_t n_set;                         /* for the material groups; 0 and 1: one for all fibers */
    uint32_t order;                       /* of the harmonics; 0: 4 */
    uint32_t n_path;    /* of a cell that is seen often; rarely seen ones have fewer. 0: 50,000, as published */
    double cell_paths;  /* edge of a cell over the mean free path; 0: 2 */
    bool no_visibility; /* leave out what the segments see: n_row is 0 */
    /* Make the table of light that is scattered more than deep_traced times (deep_light.h); 0: leave it out. */
    uint32_t deep_traced;
    uint32_t deep_edge; /* of its grids, from 2 to DEEP_LIGHT_MOST_EDGE; 0: 12 */
    double deep_paths;  /* 0: 8 million */

    /* A file that keeps what is finished, at least journal_every_s apart, and from which an interrupted call goes on to
     * the same bits; the caller removes it in the end. NULL: none. A file of another request is overwritten. */
    const char *journal_path;
    double journal_every_s;
};

/* A number that differs for another cloth, other parameters, or another request. */
uint64_t fast_tables_checksum(const struct fast_precompute_request *q);

/* Reads the file of the tables that an earlier call made for the same request. STATUS_CONFLICT: they were made for
 * another cloth, other parameters or another request; besides what fast_tables_read returns. t: nothing to release on
 * failure. */
status fast_precompute_kept(const struct fast_precompute_request *q, const char *path, struct fast_tables *t,
                            struct error *err);

/* STATUS_INVALID, field "model": a model that distinguishes directions around the fiber; a bent scene; what
 * parameter_sets_init refuses. STATUS_CANCELLED, STATUS_NO_MEMORY; of the journal STATUS_IO, STATUS_DISK_FULL. t:
 * nothing to release on failure. */
status fast_precompute(const struct fast_precompute_request *q, struct thread_pool *pool,
                       const struct progress *progress, struct fast_tables *t, struct error *err);

#endif
