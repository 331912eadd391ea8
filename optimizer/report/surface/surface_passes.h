/* A picture that is rendered in passes, each with more samples of every pixel: the picture so far can be looked at, and
 * an attempt goes on where the one before was interrupted. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_PASSES_H
#define SELVEDGE_OPTIMIZER_SURFACE_PASSES_H

#include "optimizer/report/findings/report.h"
#include "renderer/estimate/render.h"

/* The picture so far: the mean of all samples, and its variance. */
struct surface_passes {
    struct image image;
    size_t n_sample;    /* so far; 0: image is empty */
    struct image first; /* rgb: the mean of n_first of the samples, about half of them; for filters */
    size_t n_first;
    const char *name; /* of the picture: its checkpoint is work/report/<name>.pass */
};

/* Reads the checkpoint of `name`, which must outlive p; where there is none for a picture of this size, it begins with
 * no sample. STATUS_IO, STATUS_NO_MEMORY. */
status surface_passes_start(const struct report *report, const char *name, size_t width, size_t height,
                            struct surface_passes *p, struct error *err);
/* Renders one more pass of q, whose n_sample is the number in the end, adds it, and writes the checkpoint. The passes
 * grow, up to some millions of paths each. The same request ends with the same bits, however often it was interrupted.
 * Errors of render_run; STATUS_STALE, STATUS_IO, STATUS_DISK_FULL. */
status surface_passes_add(struct report *report, const struct render_request *q, const struct progress *progress,
                          struct surface_passes *p, struct error *err);
/* Two means of about half of the samples each, rgb, to be released by the caller. Needs two samples. STATUS_NO_MEMORY.
 */
status surface_passes_halves(const struct surface_passes *p, struct image half[2], struct error *err);
void surface_passes_release(struct surface_passes *p);

#endif
