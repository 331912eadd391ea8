#include "base/angle.h"
#include "base/option_id.h"
#include "geometry/volume/tile_crop.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/report/geometry/section_report.h"
#include "optimizer/report/quality.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

static void escaped(const char *text, FILE *out)
{
    for (const char *p = text; *p != '\0'; p++)
        if (*p == '&')
            fputs("&amp;", out);
        else if (*p == '<')
            fputs("&lt;", out);
        else if (*p == '>')
            fputs("&gt;", out);
        else if (*p == '"')
            fputs("&quot;", out);
        else
            fputc(*p, out);
}

/* Writes a row of a table: name, value, meaning. */
__attribute__((format(printf, 4, 5))) static void row(FILE *out, const char *name, const char *hint, const char *format,
                                                      ...)
{
    va_list list;
    fprintf(out, "<tr><td>%s</td><td class=\"number\">", name);
    va_start(list, format);
    vfprintf(out, format, list);
    va_end(list);
    fprintf(out, "</td><td class=\"hint\">%s</td></tr>\n", hint);
}

static void open_table(FILE *out, const char *title) { fprintf(out, "<h2>%s</h2>\n<table>\n", title); }
static void close_table(FILE *out) { fputs("</table>\n", out); }

/* Returns in words whether one class of the fibers has different radii. */
static const char *radii_in_words(const struct report *report)
{
    const struct fiber_set *f = &report->in.made->fiber;
    float first[3] = {0.0f, 0.0f, 0.0f};
    for (size_t i = 0; i < f->n_fiber; i++) {
        float *of_class = &first[f->axis_class[i]];
        if (*of_class == 0.0f) *of_class = f->radius_m[i];
        if (f->radius_m[i] != *of_class) return "every fiber has its own; the table has the mean of a class";
    }
    return report->in.made->geometry.radius_per_axis ? "one for each class" : "one for all fibers";
}

/* Prints the kinds of fibers of a scan that has several. */
static void print_kinds(const struct fiber_kinds *kinds, FILE *out)
{
    if (kinds->n < 2) return;
    fprintf(out, "<p>The scan has %zu kinds of fibers:", kinds->n);
    for (size_t i = 0; i < kinds->n; i++) {
        const struct fiber_kind *k = &kinds->kind[i];
        fprintf(out, "%s radius %.2f", i > 0 ? ";" : "", 1e6 * k->radius_m);
        if (isfinite(k->radius_se_m)) fprintf(out, " &plusmn; %.2f", 1e6 * k->radius_se_m);
        fprintf(out, " um, density %.2f (%.0f %% of the length)", k->density, 100.0 * k->share);
    }
    fputs(". Density 1 is the densest kind in the scan.</p>\n", out);
}

static void print_fibers(const struct report *report, const struct fiber_lengths *l, FILE *out)
{
    static const char *const name[] = {"along x (weft)", "along y (warp)", "along z (pile)"};
    const struct reconstruct_report *g = &report->in.made->geometry;
    fputs("<h2>Fibers</h2>\n<table>\n<tr><th>class</th><th class=\"number\">fibers</th><th class=\"number\">length, "
          "mm</th><th class=\"number\">radius, um</th>",
          out);
    if (report->in.job->scan->given)
        fputs("<th class=\"number\">centers</th><th class=\"number\">chains</th><th class=\"number\">dropped as "
              "short</th>",
              out);
    fputs("</tr>\n", out);
    for (int k = 0; k < 3; k++) {
        double radius = 0.0;
        for (size_t i = 0; i < report->in.made->fiber.n_fiber; i++)
            if (report->in.made->fiber.axis_class[i] == k)
                radius += (double)report->in.made->fiber.radius_m[i] / (double)l->n[k];
        fprintf(out, "<tr><td>%s</td><td class=\"number\">%zu</td><td class=\"number\">%.3g</td><td class=\"number\">",
                name[k], l->n[k], l->total_m[k] * 1e3);
        if (l->n[k] > 0) fprintf(out, "%.2f", radius * 1e6);
        if (l->n[k] > 0 && report->in.job->scan->given && isfinite(g->radius_se_m[k]))
            fprintf(out, " &plusmn; %.2f", g->radius_se_m[k] * 1e6);
        fputs("</td>", out);
        if (report->in.job->scan->given)
            fprintf(out, "<td class=\"number\">%zu</td><td class=\"number\">%zu</td><td class=\"number\">%zu</td>",
                    g->n_center[k], g->n_chain[k], g->n_short_dropped[k]);
        fputs("</tr>\n", out);
    }
    fputs("</table>\n", out);
    if (report->in.job->scan->given)
        fprintf(out, "<p>Radius: %s, with standard errors where it was measured.</p>\n", radii_in_words(report));
    if (report->in.job->scan->given) print_kinds(&g->kinds, out);
    fprintf(out, "<p>Lengths: median %.3g mm, mean %.3g mm, 80 %% between %.3g and %.3g mm, longest %.3g mm.</p>\n",
            l->median_m * 1e3, l->mean_m * 1e3, l->p10_m * 1e3, l->p90_m * 1e3, l->longest_m * 1e3);
    fputs("<figure><img class=\"plot\" src=\"pictures/fiber-lengths.svg\" alt=\"length distribution of the "
          "fibers\"><figcaption>Summed length over the length "
          "of a fiber. Fibers that cross the tile end near its edge; many short ones mean broken "
          "fibers.</figcaption></figure>\n",
          out);
}

/* Prints the confidence in the fibers. */
static void print_errors(const struct report *report, FILE *out)
{
    const struct reconstruct_report *g = &report->in.made->geometry;
    if (report->in.made->fiber.n_fiber > 0 && isnan(report->in.job->scan->radius_um)) {
        row(out, "spread of the radii", "standard deviation between fibers over the mean, without errors", "%.1f %%",
            100.0 * g->radius_spread);
        row(out, "error of the radius of a fiber", "typical standard error", "%.2f um", g->single_radius_se_m * 1e6);
    }
    if (report->in.made->fiber.n_fiber > 0 && g->axis_position_se_m > 0.0)
        row(out, "error of the axes", "standard errors of position and direction by the noise of the scan",
            "%.2f um, %.2f&deg;", g->axis_position_se_m * 1e6, angle_to_deg(g->axis_direction_se_rad));
}

/* The diameter that the scales of all steps follow from. */
static void print_diameter(const struct report *report, FILE *out)
{
    const struct reconstruct_report *g = &report->in.made->geometry;
    const bool given = !isnan(report->in.job->scan->fiber_diameter_voxel);
    row(out, "fiber diameter",
        given ? "given by the job; from 7 voxels on, touching fibers can be separated"
              : "measured before tracing; from 7 voxels on, touching fibers can be separated",
        "%.1f voxels", g->fiber_diameter_voxel);
    if (isfinite(g->other_diameter_voxel))
        row(out, "diameter that was not taken", given ? "what the scan itself shows" : "the next best one",
            "%.1f voxels", g->other_diameter_voxel);
}

static void print_scan(const struct report *report, FILE *out)
{
    const struct reconstruct_report *g = &report->in.made->geometry;
    open_table(out, "Against the scan");
    row(out, "fibers in the scan", "whether it shows single fibers", "%s", grade_verdict_name(g->grade.verdict));
    row(out, "length that is sure", "share of the traced length where the density shows single fibers", "%.0f %%",
        100.0 * g->grade.safe_share);
    row(out, "contrast of the fibers", "measured over expected, median; 1 if the scan shows them", "%.2f",
        g->grade.contrast);
    if (isfinite(g->grade.valley_depth))
        row(out, "valley between neighbours", "median fall of the density; small also between fibers that touch",
            "%.0f %%", 100.0 * g->grade.valley_depth);
    row(out, "material that no fiber explains", "away from every traced fiber and denser than the void around it",
        "%.1f %%", 100.0 * (1.0 - g->grade.coverage.explained_share));
    if (g->grade.faults & GRADE_UNEXPLAINED)
        row(out, "where it is", "slices across x, y, z with the most of it, and its density over the densest",
            "%zu, %zu, %zu; %.2f", g->grade.coverage.slice[0], g->grade.coverage.slice[1], g->grade.coverage.slice[2],
            g->grade.coverage.unexplained_density);
    row(out, "length that may be no fibers",
        "shorter than 5 diameters with both ends inside of the scan; within another one", "%.1f, %.1f %%",
        100.0 * g->grade.likeness.particle_share, 100.0 * g->grade.double_share);
    if (isfinite(g->grade.section.surface))
        row(out, "sections that no single fiber has", "variation of densities around the axes; above 10 % for yarns",
            "%.1f %%", 100.0 * g->grade.section.surface);
    if (isfinite(g->grade.section.several_share))
        row(out, "length in lines that hold several fibers", "densities vary inside of them", "%.1f %%",
            100.0 * g->grade.section.several_share);
    row(out, "pieces of a fiber", "by the ends that lie in the middle of material", "%.2f",
        g->grade.likeness.fragments);
    row(out, "material explained (Dice)", "overlap of fibers and kept voxels; 1 is complete", "%.3f", g->dice);
    row(out, "voxels of material", "density of at least eps_d", "%zu", g->n_material_voxel);
    row(out, "voxels kept", "those with a clear direction", "%zu", g->n_kept_voxel);
    row(out, "gaps bridged", "missed centers within a fiber", "%zu", g->n_gap_bridged);
    row(out, "pieces joined", "of one fiber, end to end", "%zu", g->n_joined);
    print_diameter(report, out);
    print_errors(report, out);
    row(out, "material along x, y, z", "by the directions of its voxels, also where single fibers are not resolved",
        "%.1f, %.1f, %.1f %%", 100.0 * g->axis_share[0], 100.0 * g->axis_share[1], 100.0 * g->axis_share[2]);
    row(out, "direction noise, filtered", "mean angle from voxel to voxel along the fiber", "%.2f&deg;",
        g->direction_noise_deg[0]);
    row(out, "direction noise, transferred", "after taking the fibers' directions", "%.2f&deg;",
        g->direction_noise_deg[1]);
    row(out, "change by the transfer", "mean angle between the two", "%.2f&deg;", g->direction_change_mean_deg);
    row(out, "noise of the scan", "standard deviation over the step from void to material", "%.3f", g->noise.scan_sd);
    if (g->noise.smooth_voxel > 0.0)
        row(out, "smoothing of the scan", "standard deviation of the Gaussian, because of the noise", "%.2f voxels",
            g->noise.smooth_voxel);
    row(out, "lumens", "of hollow fibers; unknown: the scan is too coarse or too noisy to show them", "%s",
        lumen_answer_name(g->lumens));
    row(out, "separability", "of void and material: 0.64 noise alone, above 0.8 clear", "%.2f", g->separability);
    close_table(out);
}

/* The cloth and the scanner of the phantom. */
static void print_trial_fibers(const struct scan_trial *t, FILE *out)
{
    row(out, "radii of the phantom", "standard deviation over the mean, as traced", "%.1f %%",
        100.0 * t->radius_spread);
    if (t->axis_ratio > 1.0)
        row(out, "sections of the phantom", "ratio of the axes of the ellipses, and its standard deviation",
            "%.2f &plusmn; %.2f", t->axis_ratio, t->axis_ratio_spread);
    if (t->lumen > 0.0)
        row(out, "lumens of the phantom", "width over that of the fiber, and its standard deviation",
            "%.2f &plusmn; %.2f", t->lumen, t->lumen_spread);
    if (!(t->axis_ratio > 1.0) && !(t->lumen > 0.0))
        row(out, "sections of the phantom", "those of the scan are neither flat nor hollow", "solid discs");
}

/* The quality that such a scan can give. */
static void print_trial(const struct scan_trial *t, bool asked, FILE *out)
{
    if (!t->made && !asked) return;
    open_table(out, "What this scan can give");
    if (!t->made) {
        row(out, "length found again", "a phantom of these fibers cannot be reconstructed", "none");
        close_table(out);
        return;
    }
    row(out, "length found again", "of a phantom of these fibers with the noise and blur of the scan",
        "%.1f %% &plusmn; %.1f", 100.0 * t->recall, 100.0 * (isfinite(t->recall_se) ? t->recall_se : 0.0));
    row(out, "axes", "root mean square distance from the true ones", "%.2f voxels", t->axis_rms_voxel);
    row(out, "pieces of a fiber", "1: no fiber is broken", "%.2f &plusmn; %.2f", t->fragments,
        isfinite(t->fragments_se) ? t->fragments_se : 0.0);
    row(out, "merges", "joins of different fibers, per fiber", "%.3f", t->merges);
    row(out, "radius of a fiber", "mean error, and root mean square", "%+.1f %%, %.1f %%", 100.0 * t->radius_bias,
        100.0 * t->radius_rms);
    row(out, "directions of voxels", "mean error, and what 95 % stay below", "%.1f&deg;, %.1f&deg;",
        t->voxel_direction_mean_deg, t->voxel_direction_p95_deg);
    if (isfinite(t->lumen_rms))
        row(out, "width of a lumen", "root mean square error, over the width of the fiber", "%.3f", t->lumen_rms);
    print_trial_fibers(t, out);
    row(out, "noise of the phantom", "signal-to-noise, and the blur that correlates it", "%.1f, %.2f voxels", t->snr,
        t->noise_sd_voxel);
    row(out, "blur of the phantom", "standard deviation", "%.2f voxels", t->blur_sd_voxel);
    close_table(out);
}

/* Writes a cell with a figure, or with a dash when there is none. */
static void figure(FILE *out, double v)
{
    if (isfinite(v))
        fprintf(out, "<td class=\"number\">%.2f</td>", v);
    else
        fputs("<td class=\"number\">&ndash;</td>", out);
}

/* how: the text about the fibers behind each label. */
static void print_seam_fibers(const struct fiber_seam *s, const char *how, FILE *out)
{
    fprintf(out, "<tr><td>fiber ends that continue in the next tile%s</td>", how);
    for (int a = 0; a < 2; a++)
        if (s->n_end[a] > 0)
            fprintf(out, "<td class=\"number\">%.0f %% of %zu</td>", 100.0 * s->share[a], s->n_end[a]);
        else
            fputs("<td class=\"number\">no ends</td>", out);
    fprintf(out, "</tr>\n<tr><td>their mean offset%s, um</td>", how);
    for (int a = 0; a < 2; a++) figure(out, s->offset_m[a] * 1e6);
    fprintf(out, "</tr>\n<tr><td>mean angle between them%s, degrees</td>", how);
    for (int a = 0; a < 2; a++) figure(out, s->angle_rad[a] * 180.0 / M_PI);
    fprintf(out, "</tr>\n<tr><td>step of the section that fibers fill%s (0 to 1; within the tile)</td>", how);
    for (int a = 0; a < 2; a++) fprintf(out, "<td class=\"number\">%.2f (%.2f)</td>", s->step[a], s->step_inside[a]);
    fputs("</tr>\n", out);
}

static void print_seam(const struct report *report, FILE *out)
{
    const struct reconstruct_report *g = &report->in.made->geometry;
    fputs("<h2>Tile and seams</h2>\n<table>\n<tr><th></th><th class=\"number\">across x</th><th "
          "class=\"number\">across y</th></tr>\n",
          out);
    fprintf(out, "<tr><td>edge of the tile, mm</td><td class=\"number\">%.4f</td><td class=\"number\">%.4f</td></tr>\n",
            report->in.made->fiber.tile_size_m[0] * 1e3, report->in.made->fiber.tile_size_m[1] * 1e3);
    if (report->in.job->scan->given) {
        fputs("<tr><td>density step at the seam over that of neighbouring slices (1: no seam)</td>", out);
        for (int a = 0; a < 2; a++) figure(out, g->seam_density.ratio[a]);
        fputs("</tr>\n", out);
    }
    const bool joined = g->seam_join.n_joined > 0;
    print_seam_fibers(&g->seam_fiber, joined ? ", joined" : "", out);
    if (joined) {
        print_seam_fibers(&g->seam_found, ", as found", out);
        fputs("<tr><td>move of the yarns at the seam by a smooth warp of the tile (root mean square), um</td>", out);
        for (int a = 0; a < 2; a++) figure(out, g->seam_join.warp_m[a] * 1e6);
        fputs("</tr>\n<tr><td>mean move of the joined ends in addition, um</td>", out);
        for (int a = 0; a < 2; a++) figure(out, g->seam_join.shift_m[a] * 1e6);
        fputs("</tr>\n", out);
    }
    if (report->in.option->crop) {
        fprintf(out, "<tr><td>mismatch of the best box (0 is a repeat, 1 is chance; used up to %.1f)</td>",
                TILE_MOST_MISMATCH);
        for (int a = 0; a < 2; a++) figure(out, g->tile.mismatch[a]);
        fputs("</tr>\n", out);
    }
    fputs("</table>\n", out);
    if (joined)
        fprintf(out, "<p>%zu pairs of ends were brought together across the seams.</p>\n", g->seam_join.n_joined);
}

static void print_chosen(const struct report *report, FILE *out)
{
    const struct reconstruct_report *g = &report->in.made->geometry;
    const struct reconstruct_option *o = report->in.option;
    open_table(out, "Parameters, given or chosen");
    row(out, job_option_key(OPTION_VOXEL_SIZE), "", "%.4g, %.4g, %.4g", o->voxel_size_m[0] * 1e6,
        o->voxel_size_m[1] * 1e6, o->voxel_size_m[2] * 1e6);
    row(out, job_option_key(OPTION_AXES), "", "%s", o->axes);
    row(out, job_option_key(OPTION_MATRIX), g->aligned ? "from the fibers' directions" : "",
        "%.5f %.5f %.5f<br>%.5f %.5f %.5f<br>%.5f %.5f %.5f", o->matrix[0], o->matrix[1], o->matrix[2], o->matrix[3],
        o->matrix[4], o->matrix[5], o->matrix[6], o->matrix[7], o->matrix[8]);
    if (o->align && g->align.outcome == ALIGN_DONE)
        row(out, "weft turned, warp sheared, tilted", "before alignment, with standard errors in and out of the plane",
            "%.2f&deg;, %.2f&deg;, %.2f&deg; (%.2f, %.2f)", g->align.rotation_deg, g->align.shear_deg,
            g->align.tilt_deg, g->align.se_deg, g->align.tilt_se_deg);
    if (o->crop_voxel[3] > 0)
        row(out, job_option_key(OPTION_CROP_BOX), o->crop ? "chosen to tile" : "", "%zu %zu %zu, %zu %zu %zu",
            o->crop_voxel[0], o->crop_voxel[1], o->crop_voxel[2], o->crop_voxel[3], o->crop_voxel[4], o->crop_voxel[5]);
    row(out, "volume in use", "voxels", "%zu x %zu x %zu", g->n[0], g->n[1], g->n[2]);
    row(out, job_option_key(OPTION_DENSITY_LOW), "scanner value of void", "%.6g", g->density_low);
    row(out, job_option_key(OPTION_DENSITY_HIGH), "scanner value of solid fiber", "%.6g", g->density_high);
    row(out, job_option_key(OPTION_FILTER_S), "direction filter", "%.4g", o->s);
    row(out, job_option_key(OPTION_FILTER_T), "direction filter", "%.4g", o->t);
    row(out, job_option_key(OPTION_FILTER_LENGTH), "direction filter", "%zu", o->h);
    row(out, job_option_key(OPTION_FILTER_DENSITY), "threshold", "%.4g", o->eps_d);
    row(out, job_option_key(OPTION_FILTER_ANSWER), "threshold", "%.4g", o->eps_j);
    row(out, job_option_key(OPTION_LINK_REACH), "", "%.3g", o->link_sigma_voxel);
    row(out, job_option_key(OPTION_LEAST_VERTICES), "", "%zu", o->min_vertex);
    close_table(out);
}

static void print_pictures(const struct report *report, FILE *out)
{
    static const struct {
        const char *file, *text;
    } slice[] = {{"slice-x.png", "Middle slice across x: y to the right, z up"},
                 {"slice-y.png", "Middle slice across y: x to the right, z up"},
                 {"slice-z.png", "Middle slice across z: x to the right, y up"}};
    fputs("<h2>Pictures</h2>\n<div class=\"slices\">\n", out);
    for (int i = 0; i < 3 && report->in.job->scan->given; i++)
        fprintf(out,
                "<figure><a href=\"pictures/%s\"><img src=\"pictures/%s\" alt=\"%s\"></a><figcaption>%s. Red crosses: "
                "fibers that pass through.</figcaption></figure>\n",
                slice[i].file, slice[i].file, slice[i].text, slice[i].text);
    fputs("<figure><a href=\"pictures/top.png\"><img src=\"pictures/top.png\" alt=\"fibers from "
          "above\"></a><figcaption>The fibers of one tile from above, "
          "brighter is higher.</figcaption></figure>\n</div>\n",
          out);
}

void quality_page(struct report *report, const struct fiber_lengths *l, FILE *out)
{
    char text[600];
    fputs("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
          "content=\"width=device-width, initial-scale=1\">\n"
          "<link rel=\"icon\" href=\"data:,\">\n<link rel=\"stylesheet\" href=\"quality.css\">\n<title>Geometry of ",
          out);
    escaped(report->in.sample, out);
    fputs("</title>\n</head>\n<body>\n<h1>Geometry of ", out);
    escaped(report->in.sample, out);
    fprintf(out, "</h1>\n<p>%zu fibers from %s. The same in numbers: <a href=\"quality.json\">quality.json</a>.</p>\n",
            report->in.made->fiber.n_fiber,
            report->in.job->scan->given                  ? "a scan"
            : report->in.job->cloth->description != NULL ? "a description of the cloth"
                                                         : "a fiber file");
    for (size_t i = 0; worker_status_warning(report->in.job->tools->status, i, text, sizeof text); i++) {
        fputs("<p class=\"warning\">", out);
        escaped(text, out);
        fputs("</p>\n", out);
    }
    print_fibers(report, l, out);
    section_report_table(report, out);
    if (report->in.job->scan->given) print_scan(report, out);
    print_trial(&report->in.made->geometry.trial, report->in.job->scan->trial, out);
    print_seam(report, out);
    print_pictures(report, out);
    if (report->in.job->scan->given) print_chosen(report, out);
    fputs("</body>\n</html>\n", out);
}
