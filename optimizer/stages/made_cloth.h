/* The cloth ready for ray tracing: its fibers, its voxels for volume models, and the scenes of both. The stage "scene"
 * makes it. The search for the fiber radius and the numbers of a cloth that are fitted make it anew. */
#ifndef SELVEDGE_OPTIMIZER_MADE_CLOTH_H
#define SELVEDGE_OPTIMIZER_MADE_CLOTH_H

#include "geometry/cloth/cloth.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/reconstruct/reconstruct.h"
#include "optimizer/stages/job_inputs.h"
#include "renderer/scene/scene.h"
#include "renderer/transport/volume/volume_scene.h"

/* Owns its members. */
struct made_cloth {
    struct reconstruct_report geometry;
    struct fiber_set fiber;
    struct fiber_set traced;      /* the fibers of a scan before their ends are joined across seams; else empty */
    struct fiber_set uncorrected; /* the fibers before the job's corrections; empty without these */
    struct cloth_report report;   /* of a described cloth */
    struct direction_volume direction;
    struct scene *scene;
    struct scene *section_scene;      /* the fibers with their flat sections; NULL where all models see `scene` */
    struct volume_scene volume_scene; /* of `direction`; only when a volume model is fitted */
    bool has_volume_scene;
    struct cloth_numbers number;    /* of the job, with the priors that the scan's own errors give */
    size_t i_shown;                 /* model whose cloth this is, plus 1; 0: the cloth of the start values */
    double shown[CLOTH_MAX_NUMBER]; /* all numbers of the cloth shown; unset while i_shown is 0 */
};

/* The sections of the document, the rows and the models that a cloth is made and traced for. */
struct cloth_job {
    const struct stage_tools *tools;
    const struct job_scan *scan;
    const struct job_cloth *cloth;
    const struct job_setup *setup;
    const struct job_fit *fit;
    const struct measured_rows *rows;
    size_t n_model;
    const struct model_setup *model;
    const struct cloth_numbers *number;
    uint64_t seed; /* of all random numbers of the job */
};

void made_cloth_release(struct made_cloth *made);
/* Relative error of the radius of scanned fibers that all of them share. 0 where the radius was given, or is fitted to
 * the photographs. */
double made_cloth_radius_error(const struct cloth_job *job, const struct made_cloth *made);

/* Stage "scene". out comes with geometry, fiber, traced, report and direction, which it takes over from the stages
 * before it. */
status stage_scene(const struct cloth_job *in, struct made_cloth *out, struct error *err);

/* Builds the scenes for ray tracing from the present fibers, and releases earlier ones. The second function builds
 * them for surface models only. */
status made_cloth_make_scene(const struct cloth_job *job, struct made_cloth *made, struct error *err);
status made_cloth_make_surface_scene(const struct cloth_job *job, struct made_cloth *made, struct error *err);
/* The scene of other fibers as a model sees them, with the options of the job; the caller frees it. */
status made_cloth_fiber_scene(const struct cloth_job *job, size_t i_model, const struct fiber_set *f,
                              struct scene **scene, struct error *err);
/* The scene of the fibers as a model sees them: with their flat sections where it states the width that a section
 * shows, else as round tubes. And the volume's scene when there is one. */
struct appearance_scene made_cloth_scene(const struct made_cloth *made, const struct model_setup *m);

#endif
