#include "optimizer/report/geometry/section_report.h"
#include "base/angle.h"
#include "geometry/fibers/shape/section_summary.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/report/geometry/fiber_lengths.h"

#include <math.h>

bool section_report_applies(const struct report *report) { return report->in.made->fiber.shape != NULL; }

/* Summary without the error that all radii share. */
static status make_summary(const struct report *report, struct section_summary *s)
{
    const struct reconstruct_report *g = &report->in.made->geometry;
    double shared_m = INFINITY;
    for (int a = 0; a < 3 && report->in.job->scan->given; a++)
        if (isfinite(g->radius_se_m[a])) shared_m = fmin(shared_m, g->radius_se_m[a]);
    return section_summary_make(&report->in.made->fiber, isfinite(shared_m) ? shared_m : 0.0, s, NULL);
}

json_t *section_report_json(const struct report *report)
{
    struct section_summary s;
    if (!section_report_applies(report) || make_summary(report, &s) != STATUS_OK) return json_null();
    json_t *json = json_object();
    const struct {
        const char *key;
        double value;
    } figure[] = {{"measured_share", s.measured_share},
                  {"axis_ratio_p10", s.ratio_p10},
                  {"axis_ratio_median", s.ratio_median},
                  {"axis_ratio_p90", s.ratio_p90},
                  {"axis_ratio_error", s.ratio_se_median},
                  {"angle_error_deg", angle_to_deg(s.angle_se_median_rad)},
                  {"flat_share", s.flat_share},
                  {"radius_variation", s.variation},
                  {"lumen_told_share", s.lumen_share},
                  {"lumen_p10", s.lumen_p10},
                  {"lumen_median", s.lumen_median},
                  {"lumen_p90", s.lumen_p90},
                  {"lumen_error", s.lumen_se_median},
                  {"radius_variation_error", s.variation_se_median}};
    for (size_t i = 0; i < sizeof figure / sizeof *figure; i++)
        json_object_set_new(json, figure[i].key, json_number(figure[i].value));
    json_object_set_new(json, "n_varying_radius", json_count(s.n_varying));
    json_object_set_new(json, "bin_edge", json_number_list(s.bin_edge, SECTION_N_BIN + 1, 1.0));
    json_object_set_new(json, "bin_share", json_number_list(s.bin_share, SECTION_N_BIN, 1.0));
    return json;
}

/* ---- for people ---- */

static void open_row(FILE *out, const char *name) { fprintf(out, "<tr><td>%s</td><td class=\"number\">", name); }
static void close_row(FILE *out, const char *hint) { fprintf(out, "</td><td class=\"hint\">%s</td></tr>\n", hint); }

static void print_ratios(const struct section_summary *s, FILE *out)
{
    open_row(out, "ratio of the axes");
    fprintf(out, "%.2f (%.2f &hellip; %.2f)", s->ratio_median, s->ratio_p10, s->ratio_p90);
    close_row(out, "long over short axis: median over the length, and 80 % of it");
    open_row(out, "length of flat sections");
    fprintf(out, "%.0f %%", 100.0 * s->flat_share);
    close_row(out, "share with a ratio above 1.15; discs come out as up to 1.1");
    open_row(out, "error of a ratio");
    fprintf(out, "%.3f", s->ratio_se_median);
    close_row(out, "median standard error at a place of a fiber, by the noise of the scan");
    if (!isfinite(s->angle_se_median_rad)) return;
    open_row(out, "error of the turn");
    fprintf(out, "%.1f&deg;", angle_to_deg(s->angle_se_median_rad));
    close_row(out, "the same of the long axis about the fiber, where the section is flat");
}

static void print_lumens(const struct section_summary *s, FILE *out)
{
    open_row(out, "width of the lumens");
    fprintf(out, "%.2f (%.2f &hellip; %.2f)", s->lumen_median, s->lumen_p10, s->lumen_p90);
    close_row(out, "over that of the fiber: median over the length, and 80 % of it");
    open_row(out, "error of a lumen");
    fprintf(out, "%.3f", s->lumen_se_median);
    close_row(out, "median standard error of this width for one fiber");
    open_row(out, "length whose lumen the scan tells");
    fprintf(out, "%.0f %%", 100.0 * s->lumen_share);
    close_row(out, "elsewhere fibers may be hollow or solid");
}

void section_report_table(const struct report *report, FILE *out)
{
    struct section_summary s;
    if (!section_report_applies(report) || make_summary(report, &s) != STATUS_OK) return;
    fputs("<h2>Sections of the fibers</h2>\n<table>\n", out);
    if (s.measured_share > 0.0) print_ratios(&s, out);
    open_row(out, "fibers whose radius varies");
    fprintf(out, "%zu of %zu", s.n_varying, report->in.made->fiber.n_fiber);
    close_row(out, "along the fiber; the others have one radius each");
    if (s.n_varying > 0) {
        open_row(out, "variation of their radius");
        fprintf(out, "%.1f %%", 100.0 * s.variation);
        if (isfinite(s.variation_se_median)) fprintf(out, " (error %.1f %%)", 100.0 * s.variation_se_median);
        close_row(out, "standard deviation along a fiber, mean over these fibers");
    }
    if (report->in.job->scan->given && report->in.made->geometry.lumen_share > 0.0) {
        open_row(out, "lumens");
        fprintf(out, "%.1f %%", 100.0 * report->in.made->geometry.lumen_share);
        close_row(out, "share of the material that was filled because the fibers are hollow");
    }
    if (s.lumen_share > 0.0) print_lumens(&s, out);
    fputs("</table>\n", out);
    if (s.measured_share > 0.0)
        fputs("<figure><img class=\"plot\" src=\"pictures/fiber-sections.svg\" alt=\"distribution of the ratio of the "
              "axes\"><figcaption>Share of the length over the ratio of the axes of the section. Fitted "
              "models see round fibers of the same area, but for elliptical_oriented.v1, which sees the "
              "ellipses.</figcaption></figure>\n",
              out);
}

enum { WIDTH = 640, HEIGHT = 240, LEFT = 64, RIGHT = 16, TOP = 16, BOTTOM = 44 };

void section_report_plot(const struct report *report, FILE *out)
{
    struct section_summary s;
    double most = 0.0;
    const double bar = (double)(WIDTH - LEFT - RIGHT) / SECTION_N_BIN;
    fprintf(out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\" "
            "font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n" SVG_DARK_STYLE
            "<rect width=\"%d\" height=\"%d\" "
            "fill=\"#fff\"/>\n",
            WIDTH, HEIGHT, WIDTH, HEIGHT, WIDTH, HEIGHT);
    const bool made = make_summary(report, &s) == STATUS_OK;
    for (int b = 0; b < SECTION_N_BIN && made; b++) most = fmax(most, s.bin_share[b]);
    const double step = most > 0.5 ? 0.2 : most > 0.2 ? 0.1 : 0.05;
    for (double y = 0.0; y <= most && made; y += step) {
        const double at = HEIGHT - BOTTOM - y / most * (HEIGHT - TOP - BOTTOM);
        fprintf(out,
                "<line x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\" stroke=\"#ddd\"/><text x=\"%d\" y=\"%.1f\" "
                "text-anchor=\"end\">%.0f %%</text>\n",
                LEFT, at, WIDTH - RIGHT, at, LEFT - 6, at + 4.0, 100.0 * y);
    }
    for (int b = 0; b < SECTION_N_BIN && most > 0.0; b++) {
        const double height = s.bin_share[b] / most * (HEIGHT - TOP - BOTTOM);
        fprintf(out,
                "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"#3f7fb5\"><title>%.1f %% at %.1f to "
                "%.1f</title></rect>\n",
                LEFT + b * bar + 0.5, HEIGHT - BOTTOM - height, bar - 1.0, height, 100.0 * s.bin_share[b],
                s.bin_edge[b], s.bin_edge[b + 1]);
    }
    for (int b = 0; b <= SECTION_N_BIN && made; b += 5)
        fprintf(out, "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%.1f%s</text>\n", LEFT + b * bar,
                HEIGHT - BOTTOM + 16, s.bin_edge[b], b == SECTION_N_BIN ? "+" : "");
    fprintf(out, "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">long over short axis of the section</text>\n</svg>\n",
            (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 8);
}
