#include "optimizer/report/geometry/result_geometry.h"
#include "base/angle.h"
#include "geometry/cloth/cloth.h"
#include "optimizer/job/document/cloth_json.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/report/geometry/section_report.h"
#include "optimizer/report/geometry/weave_json.h"

#include <jansson.h>
#include <stdlib.h>

static json_t *alignment_json(const struct reconstruct_option *o, const struct reconstruct_report *g)
{
    static const char *const outcome[] = {
        [ALIGN_DONE] = "found", [ALIGN_NO_DIRECTION] = "no_direction", [ALIGN_OTHER_AXES] = "other_axes"};
    if (!o->align) return json_null();
    const struct alignment *a = &g->align;
    const struct main_directions *m = &g->main;
    json_t *json =
        json_pack("{s:s, s:b, s:o, s:o, s:o, s:o, s:o, s:o}", "outcome", outcome[a->outcome], "applied",
                  (int)g->aligned, "n_system", json_count(m->n), "rotation_deg", json_number(a->rotation_deg),
                  "shear_deg", json_number(a->shear_deg), "tilt_deg", json_number(a->tilt_deg), "standard_error_deg",
                  json_number(a->se_deg), "tilt_standard_error_deg", json_number(a->tilt_se_deg));
    json_object_set_new(json, "weft", json_number_list(m->direction[0], 3, 1.0));
    json_object_set_new(json, "warp", json_number_list(m->direction[1], 3, 1.0));
    json_object_set_new(json, "repeat_mm", json_number_list(m->repeat_m, 2, 1e3));
    json_object_set_new(json, "correlation", json_number_list(m->correlation, 2, 1.0));
    json_object_set_new(json, "share", json_number_list(m->share, 2, 1.0));
    return json;
}

static json_t *crop_json(const struct reconstruct_option *o, const struct reconstruct_report *g)
{
    if (!o->crop) return json_null();
    return json_pack("{s:o, s:o, s:o}", "keep", json_number(o->crop_keep), "valid", json_count_list(g->tile.valid, 4),
                     "mismatch", json_number_list(g->tile.mismatch, 2, 1.0));
}

static json_t *seam_density_json(const struct seam_density *s)
{
    return json_pack("{s:o, s:o, s:o}", "across", json_number_list(s->across, 2, 1.0), "neighbour",
                     json_number_list(s->neighbour, 2, 1.0), "ratio", json_number_list(s->ratio, 2, 1.0));
}

static json_t *seam_json(const struct fiber_seam *s)
{
    json_t *json = json_pack("{s:o, s:o, s:o, s:o}", "n_end", json_count_list(s->n_end, 2), "continued",
                             json_number_list(s->share, 2, 1.0), "offset_um", json_number_list(s->offset_m, 2, 1e6),
                             "angle_deg", json_number_list(s->angle_rad, 2, 180.0 / M_PI));
    json_object_set_new(json, "step", json_number_list(s->step, 2, 1.0));
    json_object_set_new(json, "step_inside", json_number_list(s->step_inside, 2, 1.0));
    return json;
}

/* Lengths of the fibers in use, and of the fibers as they were found. */
static json_t *seam_fibers_json(const struct reconstruct_report *g)
{
    const bool scanned = g->n[0] > 0;
    json_t *json = seam_json(&g->seam_fiber);
    json_object_set_new(json, "n_joined", json_count(g->seam_join.n_joined));
    json_object_set_new(json, "found", scanned ? seam_json(&g->seam_found) : json_null());
    json_object_set_new(json, "offset_found_um",
                        scanned ? json_number_list(g->seam_found.offset_m, 2, 1e6) : json_null());
    json_object_set_new(json, "warp_um", scanned ? json_number_list(g->seam_join.warp_m, 2, 1e6) : json_null());
    const struct fiber_tiles *t = &g->tiles;
    json_object_set_new(json, "tiles",
                        t->n_move == 0 ? json_null()
                                       : json_pack("{s:o, s:o, s:o, s:o}", "n_move", json_count(t->n_move), "n_cut_end",
                                                   json_count(t->n_cut_end), "n_free", json_count(t->n_free), "move_um",
                                                   json_number(1e6 * t->move_m)));
    json_object_set_new(json, "shift_um", scanned ? json_number_list(g->seam_join.shift_m, 2, 1e6) : json_null());
    return json;
}

/* All options that were given or chosen, under their names in the job document. */
static json_t *options_json(const struct reconstruct_option *o)
{
    json_t *json = json_pack("{s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "axes", o->axes, "s", json_number(o->s),
                             "t", json_number(o->t), "h", json_count(o->h), "eps_d", json_number(o->eps_d), "eps_J",
                             json_number(o->eps_j), "link_sigma_voxel", json_number(o->link_sigma_voxel),
                             "min_vertices", json_count(o->min_vertex), "smooth_alpha", json_number(o->smooth_alpha));
    json_object_set_new(json, "density_low", json_number(o->density_low));
    json_object_set_new(json, "density_high", json_number(o->density_high));
    json_object_set_new(json, "matrix", json_number_list(o->matrix, 9, 1.0));
    bool cropped = false;
    for (int i = 0; i < 6; i++) cropped = cropped || o->crop_voxel[i] > 0;
    json_object_set_new(json, "crop_voxel", cropped ? json_count_list(o->crop_voxel, 6) : json_null());
    return json;
}

/* The named groups of fibers; null when the cloth has one set of parameters. */
static json_t *groups_json(const struct report *report)
{
    size_t n_fiber[FIBER_MAX_GROUP] = {0};
    if (report->in.job->cloth->n_group < 2) return json_null();
    json_t *list = json_array();
    for (size_t i = 0; i < report->in.made->fiber.n_fiber; i++) n_fiber[report->in.made->fiber.group[i]]++;
    for (size_t g = 0; g < report->in.job->cloth->n_group; g++)
        json_array_append_new(
            list, json_pack("{s:s, s:o}", "name", report->in.job->cloth->group[g], "n_fiber", json_count(n_fiber[g])));
    return list;
}

/* The weave that the photograph shows, and the numbers that the job has taken from it. */
static json_t *texture_json(const struct report *report)
{
    double px_per_mm = report->in.job->cloth->texture_px_per_mm;
    json_t *json = weave_guess_json(&report->in.texture->guess, isnan(px_per_mm) ? 0.0 : px_per_mm),
           *taken = json_array();
    for (size_t i = 0; i < report->in.texture->n_taken; i++)
        json_array_append_new(taken, json_string(report->in.texture->taken[i]));
    json_object_set_new(json, "taken", taken);
    json_object_set_new(json, "photograph", json_string(report->in.job->cloth->texture));
    json_object_set_new(json, "contradicts_draft", json_boolean(report->in.texture->contradicts));
    return json;
}

/* What no line explains, and which lines may be no fibers. */
static void set_faults(json_t *json, const struct scan_grade *g)
{
    const struct scan_coverage *c = &g->coverage;
    const bool where = isfinite(c->unexplained_density);
    json_object_set_new(json, "score", json_number(g->score));
    json_object_set_new(json, "unexplained_share", json_number(1.0 - c->explained_share));
    json_object_set_new(json, "unexplained_density", json_number(c->unexplained_density));
    json_object_set_new(json, "unexplained_slices", where ? json_count_list(c->slice, 3) : json_null());
    json_object_set_new(json, "dense_explained_share", json_number(c->kind[COVERAGE_DENSE_KIND].explained_share));
    json_object_set_new(json, "light_explained_share", json_number(c->kind[COVERAGE_LIGHT_KIND].explained_share));
    json_object_set_new(json, "light_share", json_number(c->kind[COVERAGE_LIGHT_KIND].share));
    json_object_set_new(json, "particle_share", json_number(g->likeness.particle_share));
    json_object_set_new(json, "double_share", json_number(g->double_share));
    json_object_set_new(json, "section_misfit", json_number(g->section.surface));
    json_object_set_new(json, "several_share", json_number(g->section.several_share));
    json_object_set_new(json, "pieces_per_fiber", json_number(g->likeness.fragments));
}

/* The grade of the scan: how clearly it shows the fibers, and how much of it they explain. */
static json_t *grade_json(const struct scan_grade *g)
{
    json_t *json = json_pack("{s:s, s:o, s:o, s:o, s:o, s:o}", "verdict", grade_verdict_name(g->verdict), "contrast",
                             json_number(g->contrast), "valley_depth", json_number(g->valley_depth), "beside_share",
                             json_number(g->beside_share), "safe_share", json_number(g->safe_share), "n_dropped",
                             json_count(g->n_dropped));
    set_faults(json, g);
    return json;
}

/* The quality that such a scan can give; null unless a trial was asked for and could be made. */
static json_t *trial_json(const struct scan_trial *t)
{
    if (!t->made) return json_null();
    json_t *json = json_pack("{s:o, s:o, s:o}", "n_voxel", json_count_list(t->n_voxel, 3), "n_true",
                             json_count(t->n_true), "n_found", json_count(t->n_found));
    const struct {
        const char *key;
        double value;
    } figure[] = {{"signal_to_noise", t->snr > 0.0 ? t->snr : NAN},
                  {"noise_sd_voxel", t->noise_sd_voxel},
                  {"blur_sd_voxel", t->blur_sd_voxel},
                  {"radius_spread", t->radius_spread},
                  {"axis_ratio", t->axis_ratio},
                  {"axis_ratio_spread", t->axis_ratio_spread},
                  {"lumen", t->lumen},
                  {"lumen_spread", t->lumen_spread},
                  {"recall", t->recall},
                  {"recall_error", t->recall_se},
                  {"precision", t->precision},
                  {"fragments", t->fragments},
                  {"fragments_error", t->fragments_se},
                  {"merges", t->merges},
                  {"axis_rms_voxel", t->axis_rms_voxel},
                  {"direction_mean_deg", t->direction_mean_deg},
                  {"direction_p95_deg", t->direction_p95_deg},
                  {"radius_bias", t->radius_bias},
                  {"radius_rms", t->radius_rms},
                  {"lumen_rms", t->lumen_rms},
                  {"voxel_direction_mean_deg", t->voxel_direction_mean_deg},
                  {"voxel_direction_p95_deg", t->voxel_direction_p95_deg}};
    for (size_t i = 0; i < sizeof figure / sizeof *figure; i++)
        json_object_set_new(json, figure[i].key, json_number(figure[i].value));
    return json;
}

static json_t *kinds_of_fibers_json(const struct fiber_kinds *kinds)
{
    json_t *list = json_array();
    for (size_t i = 0; i < kinds->n; i++) {
        const struct fiber_kind *k = &kinds->kind[i];
        json_array_append_new(list, json_pack("{s:o, s:o, s:o, s:o, s:o}", "density", json_number(k->density), "share",
                                              json_number(k->share), "n_fiber", json_count(k->n_fiber), "radius_um",
                                              json_number(1e6 * k->radius_m), "radius_error_um",
                                              json_number(1e6 * k->radius_se_m)));
    }
    return list;
}

static void set_radii(json_t *json, const struct reconstruct_report *g)
{
    const double um = 1e6;
    json_object_set_new(json, "radius_um", json_number_list(g->radius_m, 3, um));
    json_object_set_new(json, "radius_se_um", json_number_list(g->radius_se_m, 3, um));
    json_object_set_new(json, "radius_profile_um", json_number(g->profile_radius_m * um));
    json_object_set_new(json, "radius_spread", json_number(g->radius_spread));
    json_object_set_new(json, "radius_error_um", json_number(g->single_radius_se_m * um));
    json_object_set_new(json, "kinds", kinds_of_fibers_json(&g->kinds));
    json_object_set_new(json, "section_axis_ratio", json_number(g->axis_ratio));
    json_object_set_new(json, "section_axis_ratio_spread", json_number(g->axis_ratio_spread));
}

static void set_densities(json_t *json, const struct reconstruct_report *g)
{
    json_object_set_new(json, "density_low", json_number(g->density_low));
    json_object_set_new(json, "density_high", json_number(g->density_high));
    json_object_set_new(json, "separability", json_number(g->separability));
    json_object_set_new(json, "noise_sd", json_number(g->noise.scan_sd));
    json_object_set_new(json, "noise_smoothing_voxel", json_number(g->noise.smooth_voxel));
    json_object_set_new(json, "smoothed_noise_sd", json_number(g->noise.mapped_sd));
}

static void set_directions(json_t *json, const struct reconstruct_report *g)
{
    json_object_set_new(json, "direction_noise_deg", json_number_list(g->direction_noise_deg, 2, 1.0));
    json_object_set_new(json, "direction_change_mean_deg", json_number(g->direction_change_mean_deg));
    json_object_set_new(json, "axis_share", json_number_list(g->axis_share, 3, 1.0));
}

/* ---- a described cloth: its numbers, and the cloth that was made by them ---- */

static json_t *numbers_json(const struct cloth_description *d, const double *number)
{
    json_t *list = json_array();
    for (size_t i = 0; i < d->n_number; i++) {
        const struct cloth_number *n = &d->number[i];
        json_array_append_new(list, json_pack("{s:s, s:o, s:s, s:b, s:o, s:o}", "name", n->name, "value",
                                              json_number(number != NULL ? number[i] : n->value), "unit", n->info->unit,
                                              "fitted", (int)n->fitted, "lower", json_number(n->lower), "upper",
                                              json_number(n->upper)));
    }
    return list;
}

static json_t *kinds_json(const struct cloth_description *d, const struct cloth_report *r)
{
    json_t *list = json_array();
    for (size_t k = 0; k < d->n_kind; k++)
        json_array_append_new(
            list, json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "fibers_in_section", json_count(d->kind[k].n_fiber),
                            "plies", json_count(d->kind[k].n_ply), "width_um", json_number(1e6 * r->yarn_width_m[k]),
                            "height_um", json_number(1e6 * r->yarn_height_m[k]), "surface_angle_deg",
                            json_number(DEG_PER_RAD * r->surface_angle_rad[k]), "n_fiber", json_count(r->n_fiber[k]),
                            "length_mm", json_number(1e3 * r->length_m[k])));
    return list;
}

/* {weave, seed, numbers: [{name, value, unit, fitted, lower, upper}], made: {...}, description: the section "cloth" of
 * a job that takes this cloth}. number: the values; NULL: the values of d. */
static json_t *cloth_json(const struct cloth_description *d, const double *number, const struct cloth_report *r)
{
    json_t *made =
        json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "tile_yarns", json_count_list(r->n_yarn, 2),
                  "yarn_spacing_um", json_number_list(r->yarn_spacing_m, 2, 1e6), "thickness_um",
                  json_number(1e6 * r->thickness_m), "thickness_without_hairs_um",
                  json_number(1e6 * r->body_thickness_m), "cover", json_number(r->cover), "volume_fraction",
                  json_number(r->volume_fraction), "overlap_mean", json_number(r->overlap_mean), "overlap_max",
                  json_number(r->overlap_max), "strain_p95", json_number(r->strain_p95), "yarns", kinds_json(d, r));
    json_t *json = json_pack("{s:s, s:I, s:o, s:o}", "weave", d->weave[0] != '\0' ? d->weave : "draft", "seed",
                             (json_int_t)d->seed, "numbers", numbers_json(d, number), "made", made);
    if (d->n_weft > 0) json_object_set_new(json, "draft", cloth_draft_json(d));
    json_object_set_new(json, "description", cloth_section_json(d, number));
    return json;
}

/* The cloth of the fitted numbers, with the tile of the final fit; before the fit, the tile of the document. */
static json_t *described_json(const struct report *report)
{
    const bool fitted = report->in.made->i_shown > 0;
    struct cloth_description *d = malloc(sizeof *d);
    struct error unused;
    if (d == NULL) return json_null();
    const status s = cloth_description_enlarge(report->in.job->cloth->description,
                                               fitted ? report->in.job->cloth->final_tiles : 1, d, &unused);
    json_t *json =
        s == STATUS_OK ? cloth_json(d, fitted ? report->in.made->shown : NULL, &report->in.made->report) : json_null();
    free(d);
    return json;
}

/* The way from the scan to the fibers. */
static void set_scan(json_t *json, const struct report *report)
{
    const struct reconstruct_report *g = &report->in.made->geometry;
    const double um = 1e6;
    const struct reconstruct_option *o = report->in.option;
    json_object_set_new(json, "from_job",
                        report->in.job->scan->geometry_job[0] != '\0' ? json_string(report->in.job->scan->geometry_job)
                                                                      : json_null());
    json_object_set_new(json, "n_voxel", json_count_list(g->n, 3));
    json_object_set_new(json, "voxel_size_um", json_number_list(g->voxel_size_m, 3, um));
    json_object_set_new(json, "file_voxel_size_um", json_number_list(g->file_voxel_size_m, 3, um));
    set_densities(json, g);
    json_object_set_new(json, "hollow_fibers", json_boolean(g->lumen_share > 0.0));
    json_object_set_new(json, "lumens", json_string(lumen_answer_name(g->lumens)));
    json_object_set_new(json, "lumen_share", json_number(g->lumen_share));
    json_object_set_new(json, "lumen_evidence", json_number(g->lumen.middle_share));
    json_object_set_new(json, "lumen_enclosed", json_number(g->lumen.enclosed_share));
    json_object_set_new(json, "fiber_diameter_voxel", json_number(g->fiber_diameter_voxel));
    json_object_set_new(json, "fiber_diameter_noise_share", json_number(g->diameter_noise_share));
    json_object_set_new(json, "fiber_diameter_other_voxel", json_number(g->other_diameter_voxel));
    json_object_set_new(json, "traced_voxel_um", json_number(g->trace_edge_voxel * g->voxel_size_m[0] * um));
    json_object_set_new(json, "n_material_voxel", json_count(g->n_material_voxel));
    json_object_set_new(json, "n_kept_voxel", json_count(g->n_kept_voxel));
    json_object_set_new(json, "n_class_voxel", json_count_list(g->n_class_voxel, 3));
    json_object_set_new(json, "n_center", json_count_list(g->n_center, 3));
    json_object_set_new(json, "n_chain", json_count_list(g->n_chain, 3));
    json_object_set_new(json, "n_short_dropped", json_count_list(g->n_short_dropped, 3));
    json_object_set_new(json, "n_gap_bridged", json_count(g->n_gap_bridged));
    json_object_set_new(json, "n_joined", json_count(g->n_joined));
    set_radii(json, g);
    json_object_set_new(json, "axis_position_error_um", json_number(g->axis_position_se_m * um));
    json_object_set_new(json, "axis_direction_error_deg", json_number(g->axis_direction_se_rad / RAD_PER_DEG));
    json_object_set_new(json, "radius_per_axis", json_boolean(g->radius_per_axis));
    json_object_set_new(json, "radius_score", json_number_list(g->radius_score, 3, 1.0));
    json_object_set_new(json, "dice", json_number(g->dice));
    json_object_set_new(json, "grade", grade_json(&g->grade));
    json_object_set_new(json, "trial", trial_json(&g->trial));
    set_directions(json, g);
    json_object_set_new(json, "alignment", alignment_json(o, g));
    json_object_set_new(json, "crop", crop_json(o, g));
    json_object_set_new(json, "seam_density", seam_density_json(&g->seam_density));
    json_object_set_new(json, "options", options_json(o));
}

json_t *result_geometry_json(const struct report *report)
{
    const struct reconstruct_report *g = &report->in.made->geometry;
    const double um = 1e6, mm = 1e3;
    json_t *json = json_pack("{s:s, s:o, s:o, s:o}", "input",
                             report->in.job->scan->given                  ? "volume"
                             : report->in.job->cloth->description != NULL ? "cloth"
                                                                          : "fibers",
                             "n_fiber", json_count(report->in.made->fiber.n_fiber), "n_vertex",
                             json_count(report->in.made->fiber.n_vertex), "tile_mm",
                             json_number_list(report->in.made->fiber.tile_size_m, 2, mm));
    json_object_set_new(json, "total_length_mm", json_number(g->total_length_m * mm));
    double radius = 0.0;
    for (size_t i = 0; i < report->in.made->fiber.n_fiber; i++)
        radius += (double)report->in.made->fiber.radius_m[i] / (double)report->in.made->fiber.n_fiber;
    json_object_set_new(json, "mean_radius_um", json_number(radius * um));
    json_object_set_new(json, "sections", section_report_json(report));
    json_object_set_new(json, "groups", groups_json(report));
    json_object_set_new(json, "seam_fibers", seam_fibers_json(g));
    if (report->in.job->cloth->description != NULL) json_object_set_new(json, "cloth", described_json(report));
    if (report->in.texture->found) json_object_set_new(json, "texture", texture_json(report));
    if (report->in.job->scan->given) set_scan(json, report);
    return json;
}

json_t *result_warnings_json(struct report *report)
{
    json_t *list = json_array();
    char text[600];
    for (size_t i = 0; worker_status_warning(report->in.job->tools->status, i, text, sizeof text); i++)
        json_array_append_new(list, json_string(text));
    return list;
}
