#include "optimizer/report/front_page.h"
#include "base/files/durable.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/cloth_drawing.h"
#include "optimizer/report/page_charts.h"
#include "optimizer/report/page_pictures.h"
#include "optimizer/report/page_text.h"
#include "optimizer/report/result/profile_report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Reservations that the first page shows, and the number from which on its picture is lower to make room. */
enum { MAX_RESERVATION = 3, MANY_RESERVATION = 2 };

/* ---- the picture ---- */

/* The row that looks most directly at the cloth under a lamp most directly above it; NULL without rows. */
static const json_t *frontal_row(const json_t *rows)
{
    const json_t *row, *best = NULL;
    double least = INFINITY;
    size_t i;
    json_array_foreach(rows, i, row)
    {
        const double off = page_number(row, "light_theta_deg") + page_number(row, "camera_theta_deg");
        if (off < least) best = row;
        least = fmin(off, least);
    }
    return best;
}

static status draw_cloth(const struct report *report, const json_t *rows, FILE *out, struct error *err)
{
    const json_t *row = frontal_row(rows), *rendered = json_object_get(row, "rendered");
    double color[3] = {0.8, 0.78, 0.74};
    uint8_t *rgb = NULL;
    size_t width, height;
    for (size_t c = 0; c < 3 && row != NULL; c++) color[c] = fmax(json_number_value(json_array_get(rendered, c)), 0.0);
    fputs("<div class=\"drawing\">", out);
    status s = cloth_drawing(report, color, &rgb, &width, &height, err);
    if (s != STATUS_OK) return s;
    s = page_bytes_image(report, rgb, width, height, "drawing of the cloth", out, err);
    fputs("</div>", out);
    free(rgb);
    if (row == NULL)
        fputs("<figcaption>Drawing of the fibers from above. The tile is repeated.</figcaption>", out);
    else
        fprintf(out,
                "<figcaption>Drawing of the fibers from above, in the color of the twin with the lamp at %.0f and the "
                "camera at %.0f degrees. The tile is repeated.</figcaption>",
                page_number(row, "light_theta_deg"), page_number(row, "camera_theta_deg"));
    return s;
}

/* One picture of the cloth: the best that the job has made, else a drawing. */
static status print_cloth(struct report *report, const json_t *result, FILE *out, struct error *err)
{
    const json_t *rows = json_object_get(result, "rows"), *surfaces = json_object_get(result, "pictures");
    bool written = false;
    if (report->in.kind == JOB_OF_PROFILE) return STATUS_OK;
    fputs("<figure class=\"cloth\">", out);
    status s = page_picture_file(report, "pictures/hero.png", "the cloth", out, &written, err);
    if (s == STATUS_OK && !written) s = page_front_surface(report, json_array_get(surfaces, 0), out, &written, err);
    if (s == STATUS_OK && !written) s = draw_cloth(report, rows, out, err);
    fputs("</figure>\n", out);
    return s;
}

/* ---- verdict and numbers ---- */

static void print_verdict(const json_t *verdict, FILE *out)
{
    const json_t *list = json_object_get(verdict, "reservations");
    const size_t n = json_array_size(list);
    if (!json_is_object(verdict)) return;
    fprintf(out, "<div class=\"verdict %s\"><b>Verdict: ", page_string(verdict, "code"));
    page_escaped(page_string(verdict, "words"), out);
    fputs(".</b>\n<p>", out);
    page_escaped(page_string(verdict, "text"), out);
    fputs("</p>\n", out);
    if (n > 0) fputs("<ul>", out);
    for (size_t i = 0; i < n && i < MAX_RESERVATION; i++) {
        fputs("<li>", out);
        page_escaped(page_string(json_array_get(list, i), "text"), out);
        fputs("</li>\n", out);
    }
    if (n > 0) fputs("</ul>", out);
    if (n > MAX_RESERVATION) fprintf(out, "<p>%zu more in the appendix.</p>", n - MAX_RESERVATION);
    fputs("</div>\n", out);
}

static void open_number(const char *label, FILE *out) { fprintf(out, "<div><dt>%s</dt><dd>", label); }
static void close_number(FILE *out) { fputs("</dd></div>\n", out); }

/* A length in millimetres, of a metre and more in metres. */
static void print_length(double mm, FILE *out)
{
    fprintf(out, mm < 1000.0 ? "%.3g mm" : "%.3g m", mm < 1000.0 ? mm : mm / 1000.0);
}

static void print_tile(const json_t *geometry, FILE *out)
{
    const json_t *tile = json_object_get(geometry, "tile_mm");
    fprintf(out, "%.3g &times; %.3g mm", json_number_value(json_array_get(tile, 0)),
            json_number_value(json_array_get(tile, 1)));
}

static void print_fit_numbers(const json_t *result, FILE *out)
{
    static const char *const label[][2] = {{"held_out", "error, rows held out"},
                                           {"cross_validation", "error, each row left out"},
                                           {"fitted", "error, fitted rows"}};
    const json_t *verdict = json_object_get(result, "verdict"), *item;
    const char *judged = page_string(verdict, "judged_by"), *text = label[2][1];
    size_t i, n_fit = 0, n_rows = json_array_size(json_object_get(result, "rows")), n_known = 0, n_free = 0;
    for (size_t k = 0; k < 3; k++)
        if (strcmp(judged, label[k][0]) == 0) text = label[k][1];
    json_array_foreach(json_object_get(result, "rows"), i, item) n_fit += strcmp(page_string(item, "set"), "fit") == 0;
    json_array_foreach(json_object_get(result, "parameters"), i, item)
    {
        const bool is_free = !json_is_true(json_object_get(item, "fixed"));
        n_free += is_free;
        n_known += is_free && json_is_true(json_object_get(item, "determined"));
    }
    open_number(text, out);
    page_percent(verdict, "rel_rms", out);
    close_number(out);
    open_number("parameters determined", out);
    fprintf(out, "%zu of %zu", n_known, n_free);
    close_number(out);
    open_number("measurements", out);
    fprintf(out, "%zu", n_rows);
    if (n_fit < n_rows) fprintf(out, ", %zu held out", n_rows - n_fit);
    close_number(out);
}

static void print_numbers(const struct report *report, const json_t *result, FILE *out)
{
    const json_t *geometry = json_object_get(result, "geometry");
    if (report->in.kind == JOB_OF_PROFILE) return;
    fputs("<dl class=\"numbers\">\n", out);
    if (report->in.kind == JOB_OF_FIT) print_fit_numbers(result, out);
    if (json_is_object(geometry)) {
        open_number("fibers in the tile", out);
        fprintf(out, "%.0f", page_number(geometry, "n_fiber"));
        close_number(out);
    }
    if (report->in.kind != JOB_OF_FIT && json_is_object(geometry)) {
        open_number("tile", out);
        print_tile(geometry, out);
        close_number(out);
        open_number("mean fiber radius", out);
        fprintf(out, "%.3g µm", page_number(geometry, "mean_radius_um"));
        close_number(out);
        open_number("length of all fibers", out);
        print_length(page_number(geometry, "total_length_mm"), out);
        close_number(out);
    }
    fputs("</dl>\n", out);
}

/* Two sentences on how the twin was made and judged, for readers who know nothing of it. */
static void print_method(const struct report *report, const json_t *result, FILE *out)
{
    const char *judged = page_string(json_object_get(result, "verdict"), "judged_by");
    if (report->in.kind != JOB_OF_FIT) return;
    fprintf(out,
            "<p class=\"hint\">The twin consists of the cloth's fibers and of a model of how they scatter light. Its "
            "parameters were chosen so that rendered pictures agree with the measurements. %s The error is the root "
            "mean square of the relative differences between measured and rendered light; values after &plusmn; are "
            "standard errors.</p>\n",
            strcmp(judged, "held_out") == 0 ? "It was judged by measurements that were held out."
            : strcmp(judged, "cross_validation") == 0
                ? "It was judged by leaving out one measurement after another."
                : "It was judged by the same measurements, because there are no others.");
}

/* ---- the second page ---- */

static status print_geometry(struct report *report, const json_t *geometry, FILE *out, struct error *err)
{
    const bool scan = report->in.job->scan->given;
    bool written;
    if (!json_is_object(geometry)) return STATUS_OK;
    fputs("<figure>", out);
    status s =
        page_picture_file(report, scan ? "pictures/slice-z.png" : "pictures/top.png",
                          scan ? "a slice of the scan with its fibers" : "fibers from above", out, &written, err);
    fprintf(out, "<figcaption>%s %.0f fibers of ",
            scan ? "A slice of the scan; red crosses mark the fibers that were found."
                 : "One tile from above, brighter is higher.",
            page_number(geometry, "n_fiber"));
    print_length(page_number(geometry, "total_length_mm"), out);
    fputs(" together in a tile of ", out);
    print_tile(geometry, out);
    fprintf(out, ", with a mean radius of %.3g µm.</figcaption></figure>\n", page_number(geometry, "mean_radius_um"));
    return s;
}

static status print_figures(struct report *report, const json_t *result, FILE *out, struct error *err)
{
    const json_t *rows = json_object_get(result, "rows");
    const bool fit = report->in.kind == JOB_OF_FIT && json_array_size(rows) > 0;
    if (report->in.kind == JOB_OF_PROFILE) {
        fputs("<h2>Measured and fitted</h2>\n", out);
        profile_charts(report, report_best_model(report), 2, out);
        return STATUS_OK;
    }
    fprintf(out, "<h2>%s</h2>\n<div class=\"pair\">\n", fit ? "Measured and rendered; geometry" : "Geometry");
    if (fit) {
        fputs("<figure>", out);
        page_scatter(rows, out);
        fputs("<figcaption>Rendered over measured radiance, a point for each measurement and color. On the line both "
              "agree. Rings: rows that the fit has not seen.</figcaption></figure>\n",
              out);
    }
    status s = print_geometry(report, json_object_get(result, "geometry"), out, err);
    fputs("</div>\n", out);
    return s;
}

static void print_head(const struct report *report, const json_t *data, const json_t *head, FILE *out)
{
    const json_t *result = json_object_get(data, "result");
    const time_t t = (time_t)page_number(data, "written_unix_s");
    struct tm day;
    char text[40] = "";
    if (gmtime_r(&t, &day) != NULL) strftime(text, sizeof text, "%Y-%m-%d", &day);
    fputs("<header class=\"letterhead\">", out);
    if (page_string(head, "logo")[0] != '\0') {
        fputs("<img alt=\"logo\" src=\"", out);
        page_escaped(page_string(head, "logo"), out);
        fputs("\">", out);
    }
    fputs("<span class=\"name\">", out);
    page_escaped(page_string(head, "laboratory"), out);
    fprintf(out, "</span><span class=\"date\">%s</span></header>\n<h1>", text);
    page_escaped(report->in.sample, out);
    fputs("</h1>\n<p class=\"subtitle\">", out);
    page_escaped(report->in.kind == JOB_OF_FIT        ? "Digital twin of a cloth, fitted to measurements"
                 : report->in.kind == JOB_OF_PROFILE  ? "Scattering of a single fiber"
                 : report->in.kind == JOB_OF_PICTURES ? "Pictures of a cloth with given parameters"
                                                      : "Geometry of a cloth",
                 out);
    if (json_is_string(json_object_get(result, "model"))) {
        fputs(". Model: ", out);
        page_escaped(page_string(result, "model"), out);
    }
    fputs("</p>\n", out);
}

status front_pages(struct report *report, const json_t *data, const json_t *head, FILE *out, struct error *err)
{
    const json_t *result = json_object_get(data, "result");
    const size_t n = json_array_size(json_object_get(json_object_get(result, "verdict"), "reservations"));
    fprintf(out, "<section class=\"front%s\">\n", n >= MANY_RESERVATION ? " many" : "");
    print_head(report, data, head, out);
    status s = print_cloth(report, result, out, err);
    print_verdict(json_object_get(result, "verdict"), out);
    print_numbers(report, result, out);
    fputs("</section>\n<section class=\"front\">\n", out);
    if (report->in.kind != JOB_OF_GEOMETRY) front_parameters(report, result, out);
    if (s == STATUS_OK) s = print_figures(report, result, out, err);
    print_method(report, result, out);
    fputs("</section>\n", out);
    return s;
}
