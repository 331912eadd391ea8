/* Tables of light transport for the pictures of a job that are not rendered path by path: the tables of renderer/fast,
 * and the averages of dual scattering and of diffusion (renderer/quick). */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_TABLES_H
#define SELVEDGE_OPTIMIZER_SURFACE_TABLES_H

#include "optimizer/job/document/job_results.h"
#include "optimizer/report/findings/report.h"
#include "renderer/estimate/render.h"
#include "renderer/fast/deep_fit.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/preview/appearance_table.h"
#include "renderer/quick/diffusion_tables.h"
#include "renderer/quick/dual_tables.h"

struct surface_tables {
    struct fast_tables tables, studio; /* of measurements, over the job's sheet; of studio pictures, without a sheet */
    struct dual_tables averages;
    struct diffusion_tables pile;
    struct appearance_table look; /* of previews of the smooth surface */
    bool present; /* false: no picture asks for tables, or the model's fibers are flat, which a warning says */
    bool has_studio;
    bool averaged; /* the same of the averages */
    bool piled;    /* the same of the pile */
    bool looked;   /* the same of the look */
};

/* The method of one picture. */
struct surface_method {
    enum job_picture_method method; /* the document's, or JOB_PICTURE_PATH where there are no tables */
    struct fast_option fast;
    struct dual_option dual;
    struct diffusion_option diffusion;
    const struct appearance_table *look; /* of JOB_PICTURE_SHEARED */
};

/* What a picture by tables has of its own (renderer/fast/deep_fit.h). */
struct surface_fit {
    bool made; /* false: the picture takes no deep light from tables */
    struct deep_fit deep;
    struct fast_option fast; /* with its factor */
};

/* Paths of a path-traced picture that take as long as the tables; 0 when no picture asks for tables of renderer/fast:
 * averages take a second. */
double surface_tables_paths(const struct job_results *results);
/* The same of one sample of a picture, with its reference. */
double surface_sample_paths(const struct job_surface_picture *p);
/* Reads the tables of the best model from the job's folder, work/report/fast.tables and studio.tables, if the files
 * have the tables of this cloth with these parameters. Otherwise makes and stores them, and goes on from the files
 * fast.journal and studio.journal beside them that an interrupted attempt has left. Makes averages. Errors of
 * fast_precompute, fast_tables_write, dual_tables_init and diffusion_tables_make. */
status surface_tables_get(struct report *report, const struct progress *progress, struct surface_tables *t,
                          struct error *err);
void surface_tables_release(struct surface_tables *t);
/* t must outlive the result. */
struct surface_method surface_tables_method(const struct surface_tables *t, const struct job_surface_picture *p);
/* Sets the method in the source of the picture's radiance. */
void surface_method_apply(const struct surface_method *m, struct radiance_input *input);

/* Fits the factor on deep light to paths of the picture of q, which then uses it; fit must outlive it. Other methods
 * have none. Errors of deep_fit_make. */
status surface_fit_make(const struct report *report, struct render_request *q, const struct progress *progress,
                        struct surface_fit *fit, struct error *err);

/* "tables" of the picture's entry: what is known of their error. */
void surface_fit_put(json_t *entry, const struct surface_fit *fit);

#endif
