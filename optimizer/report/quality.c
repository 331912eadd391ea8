#include "optimizer/report/quality.h"
#include "base/files/durable.h"
#include "geometry/fibers/fiber_view.h"
#include "geometry/phantom/phantom.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/geometry/result_geometry.h"
#include "optimizer/report/geometry/section_report.h"
#include "optimizer/report/result/result_pictures.h"
#include "renderer/image/image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TOP_PIXELS = 700 };

static const char style[] =
    ":root { color-scheme: light dark; --ink: #1c1f24; --soft: #5a6068; --line: #d8dbe0; --paper: #fff; --warn: "
    "#fff4d6; "
    "} @media (prefers-color-scheme: dark) { :root { --ink: #e6e8ec; --soft: #a6adb8; --line: #3a404a; --paper: "
    "#14171c; "
    "--warn: #362a0c; } }\n"
    "body { font: 15px/1.45 system-ui, sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em; color: "
    "var(--ink); background: var(--paper); } a { color: inherit; }\n"
    "h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin: 1.8em 0 .5em; border-bottom: 1px solid var(--line); "
    "padding-bottom: .2em; }\n"
    "table { border-collapse: collapse; } th, td { text-align: left; padding: .18em 1.4em .18em 0; vertical-align: "
    "top; }\n"
    "th { font-weight: 600; } td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; }\n"
    "td.hint, p.hint { color: var(--soft); } p.warning { background: var(--warn); border-left: 4px solid #e0a100; "
    "padding: .4em "
    ".8em; margin: .4em 0; }\n"
    "figure { margin: 0 0 1.2em; } figcaption { color: var(--soft); font-size: .9em; } img { max-width: 100%; height: "
    "auto; "
    "max-height: 640px; background: #000; }\n"
    "img.plot { background: none; } .slices { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(320px, "
    "100%), 1fr)); gap: 16px; }\n"
    "@media (max-width: 700px) { body { margin: 1em auto; } th, td, code { overflow-wrap: anywhere; padding-right: "
    ".6em; "
    "font-size: 12px; } }\n";

static status write_text(const struct report *report, const char *name, const char *text, size_t n, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, name, path);
    return worker_folder_replace(report->in.job->tools->folder, path, text, n, err);
}

static json_t *lengths_json(const struct fiber_lengths *l)
{
    const double mm = 1e3;
    json_t *json = json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "n", json_count_list(l->n, 3), "total_mm",
                             json_number_list(l->total_m, 3, mm), "mean_mm", json_number(l->mean_m * mm), "shortest_mm",
                             json_number(l->shortest_m * mm), "p10_mm", json_number(l->p10_m * mm), "median_mm",
                             json_number(l->median_m * mm), "p90_mm", json_number(l->p90_m * mm), "longest_mm",
                             json_number(l->longest_m * mm));
    json_object_set_new(json, "bin_edge_mm", json_number_list(l->edge_m, LENGTH_BINS + 1, mm));
    json_t *classes = json_array();
    for (int k = 0; k < 3; k++) json_array_append_new(classes, json_count_list(l->count[k], LENGTH_BINS));
    json_object_set_new(json, "bin_count", classes);
    return json;
}

static status write_json(struct report *report, const struct fiber_lengths *l, struct error *err)
{
    json_t *json = json_pack("{s:i, s:s, s:o, s:o, s:o, s:s}", "format", 1, "sample", report->in.sample, "geometry",
                             result_geometry_json(report), "lengths", lengths_json(l), "warnings",
                             result_warnings_json(report), "page", "quality.html");
    char *text = json_dumps(json, JSON_REAL_PRECISION(17) | JSON_INDENT(1));
    status s = text != NULL ? write_text(report, "quality.json", text, strlen(text), err)
                            : error_set(err, STATUS_NO_MEMORY, "cannot write the quality report: out of memory");
    free(text);
    json_decref(json);
    return s;
}

/* Writes the file `name` with the output of `print`. */
static status write_printed(struct report *report, const struct fiber_lengths *l, const char *name,
                            void (*print)(struct report *report, const struct fiber_lengths *l, FILE *out),
                            struct error *err)
{
    char *text = NULL;
    size_t n = 0;
    FILE *out = open_memstream(&text, &n);
    if (out == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the quality report: out of memory");
    print(report, l, out);
    status s = fclose(out) == 0 ? write_text(report, name, text, n, err)
                                : error_set(err, STATUS_NO_MEMORY, "cannot write the quality report: out of memory");
    free(text);
    return s;
}

static void print_plot(struct report *report, const struct fiber_lengths *l, FILE *out)
{
    fiber_lengths_plot(l, fmax(report->in.made->fiber.tile_size_m[0], report->in.made->fiber.tile_size_m[1]), out);
}

static void print_sections(struct report *report, const struct fiber_lengths *l, FILE *out)
{
    (void)l;
    section_report_plot(report, out);
}

/* Writes pictures/top.png: the heights of the fibers of one tile, seen from above with y up. */
static status write_top(struct report *report, struct error *err)
{
    size_t n[2];
    uint8_t *grey = NULL, *rgb = NULL;
    double cover,
        pixel_m = fmax(report->in.made->fiber.tile_size_m[0], report->in.made->fiber.tile_size_m[1]) / TOP_PIXELS;
    status s = fiber_top_view(&report->in.made->fiber, pixel_m, n, &grey, &cover, err);
    if (s != STATUS_OK) return s;
    rgb = malloc(3 * n[0] * n[1]);
    if (rgb == NULL) {
        free(grey);
        return error_set(err, STATUS_NO_MEMORY, "cannot draw the cloth from above: out of memory");
    }
    for (size_t y = 0; y < n[1]; y++)
        for (size_t x = 0; x < n[0]; x++)
            for (size_t q = 0; q < 3; q++) rgb[3 * ((n[1] - 1 - y) * n[0] + x) + q] = grey[y * n[0] + x];
    s = result_picture_write(report, "top", rgb, n[0], n[1], err);
    free(grey);
    free(rgb);
    return s;
}

status quality_write(struct report *report, struct error *err)
{
    struct fiber_lengths l;
    status s = fiber_lengths_measure(&report->in.made->fiber, &l, err);
    if (s == STATUS_OK) s = write_top(report, err);
    if (s == STATUS_OK) s = write_printed(report, &l, "pictures/fiber-lengths.svg", print_plot, err);
    if (s == STATUS_OK && section_report_applies(report))
        s = write_printed(report, &l, "pictures/fiber-sections.svg", print_sections, err);
    if (s == STATUS_OK) s = write_json(report, &l, err);
    if (s == STATUS_OK) s = write_text(report, "quality.css", style, strlen(style), err);
    return s == STATUS_OK ? write_printed(report, &l, "quality.html", quality_page, err) : s;
}
