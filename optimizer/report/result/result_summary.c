/* results/summary.txt: the result on one page, for people. */
#include "base/angle.h"
#include "base/percent_words.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/result/export_summary.h"
#include "optimizer/report/result/profile_report.h"
#include "optimizer/report/result/result_json.h"
#include "optimizer/report/result/result_numbers.h"
#include "optimizer/report/result/result_options_json.h"
#include "optimizer/stages/validation/pipeline_choice.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void print_parameters(const struct pipeline_model *m, FILE *out)
{
    fprintf(out, "%-18s %10s %10s  %-22s %s\n", "parameter", "value", "std error", "allowed", "remarks, meaning");
    for (size_t p = 0; p < m->setup->sets.info.n_param; p++) {
        const struct param_info *info = &m->setup->sets.info.param[p];
        const struct fit_parameter *k = &m->setup->parameter[p];
        const struct uncertainty *u = &m->fit->result.uncertainty;
        char allowed[64], error[32];
        bool begins = info->set != NULL && (p == 0 || info->set != m->setup->sets.info.param[p - 1].set);
        if (begins) fprintf(out, "%s%s\n", p > 0 ? "\n" : "", info->set);
        snprintf(error, sizeof error, isnan(u->se_param[p]) ? "-" : "%.4f", param_to_file_unit(info, u->se_param[p]));
        snprintf(allowed, sizeof allowed, "%.4g .. %.4g %s", param_to_file_unit(info, k->lower),
                 param_to_file_unit(info, k->upper), param_unit_name(info->unit));
        const bool new_meaning = p == 0 || info->meaning != m->setup->sets.info.param[p - 1].meaning;
        fprintf(out, "%-18s %10.4f %10s  %-22s %s%s%s%s\n", param_own_name(info),
                param_to_file_unit(info, m->fit->result.param[p]), error, allowed,
                k->fixed                           ? "fixed "
                : m->setup->option->leader[p] != p ? "tied "
                                                   : "",
                u->at_bound[p] ? "at a bound " : "", u->determined[p] ? "" : "not determined by these measurements ",
                new_meaning && info->meaning != NULL ? info->meaning : "");
    }
}

static void print_rows(const struct report *report, const struct pipeline_model *m, FILE *out)
{
    const double deg = DEG_PER_RAD;
    fprintf(out, "\n%-14s %-8s %6s %6s %6s %6s %6s   %-26s %-26s %12s\n", "row", "set", "lamp", "phi", "camera", "phi",
            "turn", "measured r g b", "rendered r g b", "error");
    for (size_t i = 0; i < report->in.job->rows->observation.n; i++) {
        const struct observation *o = &report->in.job->rows->observation.item[i];
        const struct configuration *k = &o->configuration;
        double r[3], se;
        char turn[16], error_words[PERCENT_WORDS_BYTES];
        struct estimate a, b;
        nuisance_show(&m->fit->result.nuisance, &m->validation->replica[0][i], &a);
        nuisance_show(&m->fit->result.nuisance, &m->validation->replica[1][i], &b);
        for (int q = 0; q < 3; q++) r[q] = 0.5 * (a.mean[q] + b.mean[q]);
        snprintf(turn, sizeof turn, "%.1f", k->cloth_rotation_rad * deg);
        const double error = result_row_error(report, m, i, &se);
        percent_words_short(error, se, error_words);
        fprintf(out, "%-14.14s %-8s %6.1f %6.1f %6.1f %6.1f %6s   %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f %12s\n", o->name,
                o->set == JOB_SET_FIT ? "fit" : "held-out", k->light_theta_rad * deg, k->light_phi_rad * deg,
                k->camera_theta_rad * deg, k->camera_phi_rad * deg, k->n_rotation > 1 ? "all" : turn, o->mean_rgb[0],
                o->mean_rgb[1], o->mean_rgb[2], r[0], r[1], r[2], error_words);
    }
}

/* Writes the error of fitted rows that were left out one after another. */
static void percent_left_out(const struct pipeline_model *m, char text[PERCENT_WORDS_BYTES])
{
    const struct cross_validation *v = &m->fit->result.cross_validation;
    if (v->n_fold > 0)
        percent_words(v->rel_rms, v->rel_rms_se, text);
    else
        snprintf(text, PERCENT_WORDS_BYTES, "too few rows");
}

static void print_channels(const char *label, const struct objective_channels *v, FILE *out)
{
    if (!isfinite(v->rel_rms[0])) return;
    fprintf(out, "%-43s", label);
    for (int c = 0; c < 3; c++) {
        char text[PERCENT_WORDS_BYTES];
        percent_words(v->rel_rms[c], v->rel_rms_se[c], text);
        fprintf(out, "%s%s", c > 0 ? ", " : "", text);
    }
    fputc('\n', out);
}

static void print_errors(const struct report *report, const struct pipeline_model *m, FILE *out)
{
    const struct validation *v = m->validation;
    char text[PERCENT_WORDS_BYTES];
    percent_words(v->fit.rel_rms, v->fit.rel_rms_se, text);
    fprintf(out, "relative RMS error over the fitted rows    %s\n", text);
    percent_left_out(m, text);
    fprintf(out, "fitted rows left out one after another     %s%s\n", text,
            report->in.made->number.n > 0 ? " (numbers of the cloth held)" : "");
    percent_words(v->held_out.rel_rms, v->held_out.rel_rms_se, text);
    if (isfinite(v->held_out.rel_rms)) fprintf(out, "relative RMS error over the held-out rows  %s\n", text);
    print_channels("red, green, blue apart, fitted rows", &v->fit_channels, out);
    print_channels("red, green, blue apart, held-out rows", &v->held_out_channels, out);
}

/* Writes a table of all models when there are several. */
static void print_comparison(const struct report *report, FILE *out)
{
    const bool gains = report->model[0].setup->option->gain == JOB_GAIN_PER_PHOTOGRAPH;
    fprintf(out, "%-24s %16s %16s %16s %9s %9s\n", "model", "fitted", "rows left out", "held out", "paths", "time");
    for (size_t i = 0; i < report->n_model; i++) {
        const struct pipeline_model *m = &report->model[i];
        const struct objective_value *f = gains ? &m->validation->fit_with_gains : &m->validation->fit,
                                     *h = gains ? &m->validation->held_out_with_gains : &m->validation->held_out;
        char fitted[PERCENT_WORDS_BYTES], left_out[PERCENT_WORDS_BYTES], held_out[PERCENT_WORDS_BYTES];
        percent_words(f->rel_rms, f->rel_rms_se, fitted);
        percent_words(h->rel_rms, h->rel_rms_se, held_out);
        percent_left_out(m, left_out);
        fprintf(out, "%-24s %16s %16s %16s %9.3g %7.0f s  %s%s\n", m->setup->appearance.id, fitted, left_out, held_out,
                (double)m->fit->result.n_path, m->fit->result.wall_s, i == report_best_model(report) ? "best" : "",
                m->fit->result.converged ? "" : " NOT CONVERGED");
    }
    fprintf(out, "relative RMS errors%s; the best model was chosen by %s; what follows is of the best model\n\n",
            gains ? ", each photograph with its own gain" : "",
            pipeline_choice(report->model, report->n_model) == CHOICE_CROSS_VALIDATION
                ? "fitted rows left out one after another"
                : "the fitted rows, which are too few to leave some out");
}

/* The plain BRDF beside the fit's own errors, where it was measured. */
static void print_skill(const struct report *report, FILE *out)
{
    if (!report->skill.measured) return;
    fprintf(out, "a plain BRDF fitted to the same rows       %.3g %% fitted", 100.0 * report->skill.fit_rel_rms);
    if (isfinite(report->skill.left_out_rel_rms))
        fprintf(out, ", %.3g %% of rows left out", 100.0 * report->skill.left_out_rel_rms);
    if (isfinite(report->skill.heldout_rel_rms))
        fprintf(out, ", %.3g %% held out", 100.0 * report->skill.heldout_rel_rms);
    fprintf(out, "\n");
}

/* The error of the fibers alone, where the renderings have a factor besides. */
static void print_discrepancy(const struct report *report, FILE *out)
{
    const struct pipeline_model *m = &report->model[report_best_model(report)];
    if (pipeline_discrepancy(m->validation) == NULL) return;
    fprintf(out, "the fibers alone, without the discrepancy  %.3g %% fitted",
            100.0 * m->validation->discrepancy.fit_rel_rms);
    if (isfinite(m->validation->discrepancy.heldout_rel_rms))
        fprintf(out, ", %.3g %% held out", 100.0 * m->validation->discrepancy.heldout_rel_rms);
    fprintf(out, "\n");
}

/* The cloth and the scanner of the trial's phantom. */
static void print_trial_fibers(const struct scan_trial *t, FILE *out)
{
    fprintf(out, "         a phantom of these fibers (radii spread by %.1f %%", 100.0 * t->radius_spread);
    if (t->axis_ratio > 1.0) fprintf(out, ", ratios of axes %.2f +- %.2f", t->axis_ratio, t->axis_ratio_spread);
    if (t->lumen > 0.0) fprintf(out, ", lumens %.2f +- %.2f of the width", t->lumen, t->lumen_spread);
    fprintf(out, "%s) was scanned and reconstructed:\n", t->axis_ratio > 1.0 || t->lumen > 0.0 ? "" : ", solid discs");
}

static void print_cloth(const struct report *report, FILE *out)
{
    fprintf(out, "cloth    %zu fibers, %zu vertices, tile %.3f x %.3f mm\n", report->in.made->fiber.n_fiber,
            report->in.made->fiber.n_vertex, 1e3 * report->in.made->fiber.tile_size_m[0],
            1e3 * report->in.made->fiber.tile_size_m[1]);
    if (report->in.job->scan->given)
        fprintf(out, "         the scan shows single fibers: %s, %.0f %% of their length is sure\n",
                grade_verdict_name(report->in.made->geometry.grade.verdict),
                100.0 * report->in.made->geometry.grade.safe_share);
    if (report->in.job->scan->given)
        fprintf(out,
                "         they explain the material to %.3f (Dice); density steps at the seams x %.2f, y %.2f of those "
                "inside\n",
                report->in.made->geometry.dice, report->in.made->geometry.seam_density.ratio[0],
                report->in.made->geometry.seam_density.ratio[1]);
    if (report->in.made->geometry.trial.made) {
        print_trial_fibers(&report->in.made->geometry.trial, out);
        fprintf(out,
                "         such a scan can give %.1f %% of the length, axes to %.2f voxels, %.2f pieces a fiber, %.3f "
                "merges, radii to %.1f %%\n",
                100.0 * report->in.made->geometry.trial.recall, report->in.made->geometry.trial.axis_rms_voxel,
                report->in.made->geometry.trial.fragments, report->in.made->geometry.trial.merges,
                100.0 * report->in.made->geometry.trial.radius_rms);
    }
    fprintf(out, "         quality.html shows how good the geometry is\n\n");
}

static void print_verdict(const struct verdict *v, FILE *out)
{
    if (v->code == VERDICT_NONE) return;
    fprintf(out, "verdict  %s\n         %s\n", v->words, v->text);
    for (size_t i = 0; i < v->n_reservation; i++) fprintf(out, "         - %s\n", v->reservation[i].text);
    fputc('\n', out);
}

static void print_warnings(struct report *report, FILE *out)
{
    char text[600];
    for (size_t i = 0; worker_status_warning(report->in.job->tools->status, i, text, sizeof text); i++)
        fprintf(out, "%swarning: %s\n", i == 0 ? "\n" : "", text);
}

static void print_summary(struct report *report, FILE *out)
{
    const struct pipeline_model *m = &report->model[report_best_model(report)];
    fprintf(out, "%s\n\n", report->in.sample);
    print_verdict(&report->verdict, out);
    if (report->n_model > 1) print_comparison(report, out);
    fprintf(out, "model    %s (%s)\nmethod   %s\n", m->setup->appearance.id, m->setup->appearance.title,
            report->in.job->fit->method);
    fprintf(out, "fit      %s: %s\n", m->fit->result.converged ? "converged" : "NOT CONVERGED", m->fit->result.reason);
    fprintf(out, "         %zu steps, %.3g paths, %.0f s\n", m->fit->result.n_step, (double)m->fit->result.n_path,
            m->fit->result.wall_s);
    print_cloth(report, out);
    result_numbers_print(report, m, out);
    if (report->in.job->fit->fit_radius)
        fprintf(out, "radius   %.4g +- %.2g um, it was %.4g um%s%s\n\n", 1e6 * report->in.radius->radius_m,
                1e6 * report->in.radius->se_m, 1e6 * report->in.radius->start_m,
                report->in.radius->curve.determined ? "" : " not determined",
                report->in.radius->curve.at_bound ? " (at the edge of its range)" : "");
    print_errors(report, m, out);
    print_skill(report, out);
    print_discrepancy(report, out);
    fprintf(out, "rendered means have standard errors below %.2f %%\n\n", 100.0 * m->validation->worst_rel_se);
    print_parameters(m, out);
    result_summary_options(report, m, out);
    print_rows(report, m, out);
    export_summary_print(report, out);
    print_warnings(report, out);
}

/* Prints the summary of a job that ends with the geometry. */
static void print_geometry(struct report *report, FILE *out)
{
    fprintf(out, "%s\n\n", report->in.sample);
    print_verdict(&report->verdict, out);
    fprintf(out, "geometry only: the job has no photographs\n");
    print_cloth(report, out);
    print_warnings(report, out);
}

/* Prints the summary of a job that renders given parameters. */
static void print_pictures(struct report *report, FILE *out)
{
    const struct pipeline_model *m = report->model;
    fprintf(out, "%s\n\n", report->in.sample);
    print_verdict(&report->verdict, out);
    fprintf(out, "model    %s (%s), with given parameters: the job has no photographs\n", m->setup->appearance.id,
            m->setup->appearance.title);
    print_cloth(report, out);
    print_parameters(m, out);
    const size_t n = report->in.results->n_surface_picture;
    if (n > 0) fprintf(out, "\n%zu picture%s in the folder pictures\n", n, n == 1 ? "" : "s");
    export_summary_print(report, out);
    print_warnings(report, out);
}

/* Prints the summary of a job with the profile of a fiber. */
static void print_profile(struct report *report, FILE *out)
{
    fprintf(out, "%s\n\n", report->in.sample);
    print_verdict(&report->verdict, out);
    for (size_t i = 0; i < report->n_model; i++) {
        profile_print(report, i, out);
        print_parameters(&report->model[i], out);
        fputs("\n", out);
    }
    print_warnings(report, out);
}

status result_summary_write(struct report *report, struct error *err)
{
    char path[WORKER_PATH_BYTES], *text = NULL;
    size_t n = 0;
    FILE *out = open_memstream(&text, &n);
    if (out == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the summary: out of memory");
    if (report->in.kind == JOB_OF_PROFILE)
        print_profile(report, out);
    else if (report->in.kind == JOB_OF_GEOMETRY)
        print_geometry(report, out);
    else if (report->in.kind == JOB_OF_PICTURES)
        print_pictures(report, out);
    else
        print_summary(report, out);
    fclose(out);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "summary.txt", path);
    status s = worker_folder_replace(report->in.job->tools->folder, path, text, n, err);
    free(text);
    return s;
}
