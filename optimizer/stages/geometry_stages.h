/* The stages "volume" to "directions": from a scan, a fiber file or a described cloth to fibers and voxels. Each has a
 * function that does the work and stores it under JOB/work/<stage>/, and one that reads the output of a finished stage
 * back from there. Outputs are owned by the caller. */
#ifndef SELVEDGE_OPTIMIZER_GEOMETRY_STAGES_H
#define SELVEDGE_OPTIMIZER_GEOMETRY_STAGES_H

#include "geometry/cloth/cloth.h"
#include "geometry/reconstruct/reconstruct.h"
#include "optimizer/stages/run/stage_tools.h"

struct job_scan;
struct job_cloth;
struct model_setup;

struct volume_input {
    const struct stage_tools *tools;
    const struct job_scan *scan;
};
struct volume_output {
    struct reconstruct_option option;
    struct reconstruct_report geometry;
    struct volume volume;
};
status stage_volume(const struct volume_input *in, struct volume_output *out, struct error *err);
status stage_volume_load(const struct volume_input *in, struct volume_output *out, struct error *err);

struct orientation_input {
    const struct stage_tools *tools;
    const struct volume_output *volume;
};
struct orientation_output {
    struct reconstruct_option option; /* with the values that the stage has chosen; so of the later stages */
    struct reconstruct_report geometry;
    struct direction_volume direction;
};
status stage_orientation(const struct orientation_input *in, struct orientation_output *out, struct error *err);
status stage_orientation_load(const struct orientation_input *in, struct orientation_output *out, struct error *err);

struct fibers_input {
    const struct stage_tools *tools;
    const struct job_scan *scan;
    const struct job_cloth *cloth;
    const struct volume_output *volume; /* unused without a scan, as the next one */
    const struct orientation_output *orientation;
};
struct fibers_output {
    struct reconstruct_option option;
    struct reconstruct_report geometry;
    struct fiber_set fiber;
    struct cloth_report cloth; /* of a described cloth */
};
status stage_fibers(const struct fibers_input *in, struct fibers_output *out, struct error *err);
status stage_fibers_load(const struct fibers_input *in, struct fibers_output *out, struct error *err);

struct directions_input {
    const struct stage_tools *tools;
    const struct job_scan *scan;
    size_t n_model;
    const struct model_setup *model;
};
/* Comes with option, geometry and fiber of the stage "fibers" and the direction of "orientation", which the stage
 * takes over and changes in place: a scan may have gigabytes of them. */
struct directions_output {
    struct reconstruct_option option;
    struct reconstruct_report geometry;
    struct fiber_set fiber;
    struct fiber_set traced; /* before the ends are joined across the seams of the tile */
    struct direction_volume direction;
};
status stage_directions(const struct directions_input *in, struct directions_output *out, struct error *err);
status stage_directions_load(const struct directions_input *in, struct directions_output *out, struct error *err);

#endif
