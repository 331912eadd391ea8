/* The described cloth of selvedge-phantom: the same section "cloth" as in job documents. */
#ifndef SELVEDGE_OPTIMIZER_PHANTOM_DESCRIBED_H
#define SELVEDGE_OPTIMIZER_PHANTOM_DESCRIBED_H

#include "base/catalogue/cloth_description.h"
#include "geometry/phantom/phantom.h"

/* Reads the section "cloth" from a file of JSON: the section alone or a whole job document. STATUS_INVALID names the
 * field. */
status phantom_described_read(const char *path, struct cloth_description *d, struct error *err);

/* Makes its fibers for a scan with the given voxels: the tile is stretched to whole voxels, and margin_m of void lies
 * below and above. Fills the members of the report that a described cloth has. */
status phantom_described_make(const struct cloth_description *d, double voxel_size_m, double margin_m,
                              struct thread_pool *pool, struct fiber_set *f, struct phantom_report *report,
                              struct error *err);

/* The description of a phantom f with single-ply yarns, with the nearest numbers of the catalogue. It describes the
 * same weave, sections and twist; single fibers lie elsewhere. STATUS_UNSUPPORTED for yarn files. */
status phantom_described_as(const struct phantom_option *o, const struct phantom_report *r, const struct fiber_set *f,
                            struct cloth_description *d, struct error *err);

#endif
