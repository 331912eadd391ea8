/* Rows of the option table: the fit. Sections whose keys are names of model parameters are read by job_check_fit. */
#include "optimizer/job/document/job_exports.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/options/option_rows.h"

static const char *const gain[] = {
    [JOB_GAIN_NONE] = "none", [JOB_GAIN_GLOBAL] = "global", [JOB_GAIN_PER_PHOTOGRAPH] = "per_photograph", NULL};

/* One number for all channels, or one for each. */
#define VALUES                                                                                                         \
    "{\"type\": \"object\", \"additionalProperties\": {\"anyOf\": [{\"type\": \"number\"}, "                           \
    "{\"type\": \"array\", \"items\": {\"type\": \"number\"}}]}}"
#define TIES                                                                                                           \
    "{\"type\": \"array\", \"items\": {\"anyOf\": [{\"type\": \"array\", \"items\": {\"type\": \"string\"}}, "         \
    "{\"type\": \"object\", \"additionalProperties\": {\"type\": \"number\", \"minimum\": 0.001, \"maximum\": "        \
    "1000}}]}}"
#define BOUNDS                                                                                                         \
    "{\"type\": \"object\", \"additionalProperties\": {\"type\": \"array\", \"items\": {\"type\": \"number\"}, "       \
    "\"minItems\": 2, \"maxItems\": 2}}"
#define PRIORS                                                                                                         \
    "{\"type\": \"object\", \"additionalProperties\": {\"type\": \"object\", \"properties\": {\"mean\": {\"type\": "   \
    "\"number\", \"description\": \"Most likely value\"}, \"se\": {\"type\": \"number\", \"description\": "            \
    "\"Its standard error, in the unit of the parameter\"}}, \"additionalProperties\": false, \"required\": "          \
    "[\"mean\", "                                                                                                      \
    "\"se\"]}}"
/* Several starts allow fewer iterations. */
#define FEWER_ITERATIONS                                                                                               \
    "{\"if\": {\"properties\": {\"starts\": {\"minimum\": 2}}, \"required\": [\"starts\"]}, "                          \
    "\"then\": {\"properties\": {\"max_iterations\": {\"maximum\": 500}}}}"

const struct job_option option_rows_fit[] = {
    {.path = "fit",
     .kind = OPTION_SECTION,
     .may_be_empty = true,
     OF_SECTION(fit),
     .check = job_check_fit,
     .schema = FEWER_ITERATIONS,
     .meaning = "The model, and how it is fitted to the measurements."},
    {.path = "fit.model",
     .kind = OPTION_WORD,
     .id = OPTION_MODEL,
     TEXT_INTO(fit, model[0].id),
     .choice_at = job_model_id,
     .standard = "\"textile.v3\"",
     .meaning = "The scattering model; docs/model.md describes each. `two_lobe.v1` is the published one, with nine "
                "parameters."},
    {.path = "fit.models",
     .kind = OPTION_OWN,
     .left_out = "`model` alone",
     .allowed = "1..8 of the same words, instead of `model`",
     .schema = "{\"type\": \"array\", \"items\": {\"type\": \"string\"}, \"minItems\": 1, \"maxItems\": 8}",
     .meaning = "Several models in one job: each is fitted, all are compared by cross-validation inside the fitted "
                "rows, and the best one "
                "gives the result. A warning says which models these rows do not tell apart."},
    {.path = "fit.method",
     .kind = OPTION_WORD,
     .id = OPTION_METHOD,
     TEXT_INTO(fit, method),
     .choice_at = job_method_id,
     .meaning = "`published_sgd.v1` is the published method, for comparison, by default with the published budget: "
                "six runs of 60 iterations, two replicas, 64 x 64 pixels of 64 samples, 550 times the paths of "
                "`gauss_newton.v1`. It takes no `priors`, no `nuisance`, no `precision` and no `texture` of a weight "
                "above 0. `mean_variance.v1` is the published bisection for `microflake.v1` alone; it takes no starts "
                "and ties "
                "either, and fits no density."},
    {.path = "fit.seed",
     .kind = OPTION_LARGE_COUNT,
     INTO(fit, seed),
     .standard = "1",
     .allowed = "whole number from 0",
     .meaning = "The same seed and document give a bit-identical result."},
    {.path = "fit.max_iterations",
     .kind = OPTION_COUNT,
     INTO(fit, max_iteration),
     RANGE(1, 10000),
     .left_out = "the method's",
     .allowed = "1..10000; with several `starts` 1..500",
     .meaning = "Largest number of iterations of each start. `gauss_newton.v1`: 80; `published_sgd.v1`: 60 for each of "
                "its six runs, of which 11 are needed to see whether it has converged. `mean_variance.v1`: 9 halvings, "
                "at most 20."},
    {.path = "fit.path_budget",
     .kind = OPTION_LARGE_COUNT,
     .id = OPTION_PATH_BUDGET,
     INTO(fit, path_budget),
     .lower = 1000,
     .unit = "paths",
     .left_out = "the method's",
     .allowed = "from 1000",
     .meaning =
         "Light paths of the fit of each model. Left out, the fit ends by itself, after 6 million at the latest (more "
         "with over some 240 fitted rows). A budget below the least that a fit takes gives a warning that names it."},
    {.path = "fit.precision",
     .kind = OPTION_NUMBER,
     .id = OPTION_PRECISION,
     INTO(fit, precision),
     .lower = 0.05,
     .upper = 10,
     .left_out = "no goal",
     .allowed = "0.05..10",
     .meaning = "Goal of `gauss_newton.v1`: the fit ends when the noise of tracing makes so many times the error of "
                "the fitted means that the photographs' stated errors make. `path_budget` is then the most that it "
                "takes. Needs measurements with errors."},
    {.path = "fit.profile_job",
     .kind = OPTION_TEXT,
     .id = OPTION_PROFILE_JOB,
     TEXT_INTO(fit, profile_job),
     .check = job_check_job_id,
     .left_out = "none",
     .allowed = "the id of a job with `profile`",
     .meaning = "A job that fitted models to the profile of a fiber of this cloth. Its determined parameters become "
                "`priors` here, with their standard errors, unless they are fixed, tied or have priors; colors only "
                "where the profile has three channels."},
    {.path = "fit.result_file",
     .kind = OPTION_FILE_NAME,
     .id = OPTION_RESULT_FILE,
     TEXT_INTO(fit, result_file),
     .check = job_check_result_file,
     .left_out = "none",
     .allowed = "`result.json` of another job",
     .meaning = "In a job without measurements: the result that the parameters in `fixed` are from. "
                "Exports then have its rows with their radiances, and renderings its smooth factor. Role: `result`."},
    {.path = "fit.share_camera_paths",
     .kind = OPTION_BOOL,
     INTO(fit, share_camera_paths),
     .standard = "false",
     .meaning =
         "Whether rows that differ in their lamp only are traced with the same paths, in 0.54 to 0.63 of the time for "
         "two of them. Errors contain that their noise goes together. Not with `texture`; without effect on volumes."},
    {.path = "fit.plain_prior",
     .kind = OPTION_NUMBER,
     .id = OPTION_PLAIN_PRIOR,
     INTO(fit, plain_prior),
     RANGE(0, 100),
     .standard = "0",
     .meaning = "How much the fit listens to a plain BRDF of the same rows: 0, not at all; 1, as was best for a dozen "
                "measured rows of a described cloth (docs/model.md, section 5). Not with `nuisance`."},
    {.path = "fit.discrepancy",
     .kind = OPTION_BOOL,
     .id = OPTION_DISCREPANCY,
     INTO(fit, discrepancy),
     .standard = "false",
     .meaning = "Whether the rest that the fibers leave of the measured radiances is kept as a smooth factor on all "
                "renderings, as far as it predicts left-out rows (docs/model.md, section 5). Not with `nuisance`, nor "
                "for volumes."},
    {.path = "fit.fixed",
     .kind = OPTION_OWN,
     .unit = "degrees for angles",
     .left_out = "none",
     .allowed = "inside the model's bounds",
     .schema = VALUES,
     .meaning =
         "`{\"beta_R\": 5}`: parameters that are not fitted, and not in `start`. A colour takes one number or "
         "`[r, g, b]`, or one channel as `\"C_R.g\"`. With several models: in all that have the parameter. With "
         "groups of fibers: `\"warp.C_R\"` of one group, `\"C_R\"` of all; so in `start`, `bounds`, `priors`, `tied`."},
    {.path = "fit.start",
     .kind = OPTION_OWN,
     .id = OPTION_START,
     .unit = "degrees for angles",
     .left_out = "the model's",
     .allowed = "inside the model's bounds",
     .schema = VALUES,
     .meaning = "Values at which the fit starts, written like `fixed`."},
    {.path = "fit.density_multiplier_per_cm",
     .kind = OPTION_NUMBER,
     INTO(fit, density_multiplier_per_cm),
     RANGE(10, 100000),
     .unit = "1/cm",
     .left_out = "4000",
     .meaning = "Volume models: extinction of solid material across its fibers. With `fit_density` it is the start of "
                "the fit; left out, that is a prior's mean, or 4000."},
    {.path = "fit.fit_density",
     .kind = OPTION_BOOL,
     INTO(fit, fit_density),
     .standard = "false",
     .meaning = "Volume models: fit the density too. Needs photographs with the lamp behind the cloth."},
    {.path = "fit.fit_radius",
     .kind = OPTION_BOOL,
     .id = OPTION_FIT_RADIUS,
     .or_section = true,
     INTO(fit, fit_radius),
     .check = job_check_fit_radius,
     .standard = "false",
     .items = "lower_um and upper_um",
     .allowed = "`true`, `false`, or the range to search: `{\"lower_um\": v, \"upper_um\": v}`",
     .meaning = "Find the mean radius of the fibers, too, by up to 11 short fits of the first fiber model, each with "
                "12 % of `path_budget` and at least 21,000 paths a fitted row."},
    {.path = "fit.fit_radius.lower_um",
     .kind = OPTION_NUMBER,
     INTO(fit, radius_lower_um),
     RANGE(0.05, 1000),
     .unit = "um",
     .left_out = "half the cloth's own",
     .meaning = "Smallest radius that is tried."},
    {.path = "fit.fit_radius.upper_um",
     .kind = OPTION_NUMBER,
     .id = OPTION_FIT_RADIUS_UPPER,
     INTO(fit, radius_upper_um),
     RANGE(0.05, 1000),
     .unit = "um",
     .left_out = "twice the cloth's own",
     .allowed = "0.05..1000, at least 1.1 times `lower_um`, at most a quarter of the tile's shorter edge",
     .meaning = "Largest radius that is tried."},
    {.path = "fit.tied",
     .kind = OPTION_OWN,
     .left_out = "none",
     .allowed = "list of groups",
     .schema = TIES,
     .meaning = "`[[\"C_R.r\", \"C_R.g\", \"C_R.b\"]]` (or `[[\"C_R\"]]`): equal values. `[{\"beta_TT\": 1, "
                "\"gamma_TT\": 2}]`: values in these proportions. Only parameters of the same unit can be tied. "
                "With groups of fibers `[\"beta_R\"]` ties the widths of all groups."},
    {.path = "fit.bounds",
     .kind = OPTION_OWN,
     .unit = "degrees for angles",
     .left_out = "the model's",
     .allowed = "inside the model's",
     .schema = BOUNDS,
     .meaning = "`{\"beta_R\": [2, 8]}`: a narrower range of a parameter. With `fit_density` also "
                "`{\"density_multiplier\": [1000, 8000]}` (1/cm), as in `priors`."},
    {.path = "fit.priors",
     .kind = OPTION_OWN,
     .id = OPTION_PRIORS,
     .unit = "degrees for angles",
     .left_out = "none",
     .allowed = "mean inside the model's bounds",
     .schema = PRIORS,
     .meaning =
         "`{\"beta_R\": {\"mean\": 5, \"se\": 1}}`: what is known from elsewhere, Gaussian in the fit coordinate "
         "(docs/model.md, section 5). A prior's mean is also the start, when none is given. One more than three "
         "`se` outside of `bounds` is an error."},
    {.path = "fit.starts",
     .kind = OPTION_COUNT,
     .id = OPTION_STARTS,
     INTO(fit, model[0].option.n_start),
     RANGE(1, JOB_MAX_START),
     .standard = "1",
     .meaning =
         "The fit is made from so many starts, spread over the bounds; the best is kept, all are listed. They share a "
         "`path_budget`. With fitted numbers of the cloth each is a search of its own, judged by left-out rows."},
    {.path = "fit.nuisance",
     .kind = OPTION_SECTION,
     .id = OPTION_NUISANCE,
     .check = job_check_nuisance,
     .left_out = "none",
     .meaning = "Faults of the photographs that are fitted with the parameters."},
    {.path = "fit.nuisance.gain",
     .kind = OPTION_CHOICE,
     INTO(fit, model[0].option.gain),
     .choice = gain,
     .meaning = "Exposure or lamp power is not known exactly: all photographs may be too bright or too dark by one "
                "factor, or each by one of its own. The result lists the factors."},
    {.path = "fit.nuisance.gain_prior_rel",
     .kind = OPTION_NUMBER,
     INTO(fit, model[0].option.gain_prior_rel),
     RANGE(1e-4, 1),
     .standard = "0.05",
     .meaning = "How well the gain is known: standard deviation of its logarithm. Only with a `gain`."},
    {.path = "fit.nuisance.stray_light",
     .kind = OPTION_BOOL,
     INTO(fit, model[0].option.stray_light),
     .standard = "false",
     .meaning = "The same small radiance is added to every photograph (glare, room light). It is fitted and not "
                "negative. Not together with `texture`."},
    {.path = "fit.nuisance.stray_light_prior",
     .kind = OPTION_NUMBER,
     INTO(fit, model[0].option.stray_light_prior),
     RANGE(1e-6, 1),
     .unit = "radiance",
     .standard = "0.01",
     .meaning = "Standard deviation of its half Gaussian. Only with `stray_light`."},
    {.path = "fit.texture",
     .kind = OPTION_SECTION,
     .check = job_check_texture,
     .left_out = "none",
     .meaning = "Photographs only: measure how much the means of blocks of the crop scatter, in photographs and "
                "renderings, and fit that too."},
    {.path = "fit.texture.block_mm",
     .kind = OPTION_NUMBER,
     .id = OPTION_TEXTURE_BLOCK,
     INTO(fit, texture_block_mm),
     RANGE(1e-3, 1e3),
     .required = true,
     .unit = "mm",
     .allowed = "2 to 32 blocks along the crop's edge",
     .meaning =
         "Edge of a block. A whole number of blocks fills the crop: the size that comes nearest to that is used, "
         "and is what the result states."},
    {.path = "fit.texture.weight",
     .kind = OPTION_NUMBER,
     INTO(fit, texture_weight),
     RANGE(0, 1e3),
     .standard = "1",
     .meaning =
         "1: a relative error of the scatter counts like one of brightness. 0: it is only reported. Not together "
         "with `nuisance.stray_light`."},
    {.path = "fit.candidates",
     .kind = OPTION_LIST,
     .or_section = true,
     LIST_INTO(fit, candidate, n_candidate),
     .upper = JOB_MAX_CANDIDATE,
     .check = job_check_candidates,
     .left_out = "none",
     .allowed = "1..1024, or `{\"grid\": true}`",
     .items = "configurations, or {\"grid\": true}",
     .meaning = "Photographs that could be taken. The result ranks them by how much they would narrow the parameters."},
    {.path = "fit.candidates.grid",
     .kind = OPTION_BOOL,
     INTO(fit, candidate_grid),
     .standard = "false",
     .meaning = "Instead of a list: 56 configurations of lamp, camera and cloth, 60 without the black sheet."},
    ANGLES("fit.candidates[]", struct job_candidate, .required = true),
    {.path = "fit.render_px",
     .kind = OPTION_COUNT,
     INTO(results, render_px),
     RANGE(8, 2048),
     .unit = "pixels",
     .left_out = "192; fewer, at least 48, where four samples of each pixel would take more than half of the paths "
                 "of the fit",
     .meaning = "Edge of the renderings in the result."},
    {.path = "fit.render_samples",
     .kind = OPTION_COUNT,
     INTO(results, render_sample),
     RANGE(1, 65536),
     .unit = "per pixel",
     .left_out = "so many that all renderings together take about half of the time of the fit, 4 to 16",
     .meaning = "Samples of the renderings in the result."},
    {.path = "export",
     .kind = OPTION_SECTION,
     .left_out = "none",
     .meaning = "Files for other programs, in the folder `export` of the results (docs/exports.md). They show the best "
                "model, which must be a surface model; the result states how near its materials come."},
#define EXPORT(name, text)                                                                                             \
    {.path = "export." #name,                                                                                          \
     .kind = OPTION_BOOL,                                                                                              \
     INTO(results, exported[EXPORT_##name]),                                                                           \
     .check = job_check_export,                                                                                        \
     .standard = "false",                                                                                              \
     .meaning = (text)},
#include "generated/exports.def"
#undef EXPORT
    {.path = "export.texture_cm",
     .kind = OPTION_NUMBER,
     INTO(results, texture_cm),
     RANGE(2, 20),
     .unit = "cm",
     .standard = "2",
     .meaning = "Edge of textures, to the nearest whole repeat."},
    {.path = "export.texture_px",
     .kind = OPTION_COUNT,
     INTO(results, texture_px),
     RANGE(64, 4096),
     .unit = "pixels",
     .standard = "2048",
     .meaning = "Most pixels along their longer edge."},
    {.path = "export.pdf",
     .id = OPTION_REPORT_PDF,
     .kind = OPTION_BOOL,
     INTO(results, export_pdf),
     .standard = "false",
     .meaning = "The report as PDF, too: `report.pdf`. Needs the program WeasyPrint on the machine of the service."},
    {.path = "export.report_file",
     .kind = OPTION_FILE_NAME,
     .id = OPTION_REPORT_FILE,
     TEXT_INTO(results, report_file),
     .check = job_check_report_file,
     .left_out = "none",
     .allowed = "`report.html` of another job",
     .meaning = "With `fit.result_file`: the report that is taken over, as for its PDF. Role: `report`."},
    {.path = NULL},
};
