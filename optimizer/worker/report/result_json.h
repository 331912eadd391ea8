/* results/result.json, and results/summary.txt for people.
 *
 * {"format":1, "sample", "model", "method", "seed", "converged":bool, "reason", "reason_code" (stop_reason.h),
 *  "parameters":[{"name":"C_R.r","unit":""|"deg","value","standard_error","lower","upper","start","at_bound":null|"lower"|"upper","determined":bool,
 *                 "fixed":bool,"tied_to":null|name,"ratio":null|number,"prior":null|{"mean","se"}}],                     file units; standard_error includes photograph noise, Monte-Carlo
 * noise and misfit "correlation":[[...]],                             in fit coordinates; 0 for parameters that are
 * fixed "objective", "objective_se", "fit_rel_rms",       fresh paths at the result, fitted rows
 * (objective.h defines all three) "fit_rel_rms_se", "heldout_rel_rms":number|null,
 * "heldout_rel_rms_se":number|null (both by tracing alone), "misfit_rel_rms",  misfit: per residual, what no noise
 * explains "validation_worst_rel_se",                         largest standard error of a rendered mean, relative to
 * the row's brightness
 *  "rows":[{"name","set":"fit"|"held-out","light_theta_deg","light_phi_deg","camera_theta_deg","camera_phi_deg","cloth_rotation_deg","all_rotations",
 *           "weight","measured":[r,g,b],"measured_se":[3],"rendered":[3],"rendered_se":[3],
 *           "rendering_png":"renderings/x.png","rendering_exr","photograph_png":"photographs/x.png"|null,"gain":null|number,"gain_se":null|number,
 *           "texture":null|{"block_mm","blocks_a_side","measured":[3],"measured_se":[3],"rendered":[3],"rendered_se":[3]}}],  contrasts
 *  "next_photograph":[{"candidate","light_theta_deg",...,"information_nats","standard_error_after":[...],"determines":[names]}],  best first
 *  "certificate":{"worst_rel_error","worst_rel_error_se","worst_parameter","n_path","parameters":[{"name","rel_error","rel_error_se"}]},
 *  "prior_penalty", "nuisance":[{"name","value","standard_error","at_bound":bool}], "fit_rel_rms_with_gains":number|null, "heldout_rel_rms_with_gains":number|null,
 *  "starts":[{"start":[...],"value":[...],"objective","objective_se","prior_penalty","converged","kept","elsewhere","n_path"}],
 *  "models":[{"id","title","kind":"surface"|"volume","best":bool, all of "converged" to "validation_worst_rel_se" and
 *             "n_path_fit" to "n_path_validation", "rows":[{"rendered":[3],"rendered_se":[3]}] in the order of "rows"}],
 *             in the order of the job document; all the rest is of the best model: the one with the lowest error over
 *             the held-out rows (over the fitted rows when none are held out)
 *  "radius":null|{"model","start_um","radius_um" (what was used),"minimum_um","standard_error_um","lower_um","upper_um",
 *             "determined","at_bound","n_path","wall_s","curve":[{"radius_um","objective","objective_se"}]},
 *  "skill":null|{"plain_brdf":{"fit_rel_rms","heldout_rel_rms":number|null,"diffuse":[3],"f0":[3],"sheen":[3],
 *           "transmission":[3],"retro","roughness","sheen_roughness","masking":"correlated"|"separable"} (plain_brdf.h),
 *           "heldout_ratio":number|null},            heldout_rel_rms of the best model over that of the plain BRDF
 *  "geometry":{...reconstruct_report, "input":"volume"|"fibers", "options":{...}} (result_geometry.h),
 *  "png_exposure",                                    all PNG pictures show radiance x this, sRGB
 *  "n_path_fit", "n_step", "fit_wall_s", "n_path_validation", "stages":[{"name","wall_s":number|null}],
 *  "warnings":[...], "program":"selvedge-worker 0.1.0"}
 * Angles in degrees, lengths in micrometres or millimetres as the keys say. Numbers have 17 digits: equal fits give
 * equal bytes.
 */
#ifndef SELVEDGE_OPTIMIZER_RESULT_JSON_H
#define SELVEDGE_OPTIMIZER_RESULT_JSON_H

#include "base/version.h"
#include "optimizer/worker/pipeline_context.h"

#define RESULT_PROGRAM "selvedge-worker " SELVEDGE_VERSION

/* Picture names per observation (without folder and ending), unique; free() the array. */
typedef char picture_name[JOB_MAX_NAME_BYTES + 8];
status result_picture_names(const struct observation_set *o, picture_name **name, struct error *err);
/* Exposure of all PNG pictures: brings the 90th percentile of the measured brightest channels to 0.8. */
double result_png_exposure(const struct observation_set *o);

status result_json_write(struct pipeline_context *c, struct error *err);
status result_summary_write(struct pipeline_context *c, struct error *err);

#endif
