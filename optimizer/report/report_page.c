#include "optimizer/report/report_page.h"
#include "base/files/durable.h"
#include "base/files/file_ledger_json.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/front_page.h"
#include "optimizer/report/letterhead_file.h"
#include "optimizer/report/page_charts.h"
#include "optimizer/report/page_exports.h"
#include "optimizer/report/page_lobes.h"
#include "optimizer/report/page_pictures.h"
#include "optimizer/report/page_style.h"
#include "optimizer/report/page_text.h"
#include "optimizer/report/result/profile_report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_PAGE_BYTES = 256 << 20 }; /* of a report that is taken over */

static void heading(const char *text, FILE *out) { fprintf(out, "<h2>%s</h2>\n", text); }

static void print_time(const char *label, double unix_s, FILE *out)
{
    time_t t = (time_t)unix_s;
    struct tm utc;
    char text[40];
    if (gmtime_r(&t, &utc) != NULL && strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &utc) > 0)
        fprintf(out, "<tr><td>%s</td><td>%s</td></tr>\n", label, text);
}

static void error_row(const json_t *result, const char *label, const char *key, FILE *out)
{
    fprintf(out, "<tr><td>%s</td><td>", label);
    page_percent(result, key, out);
    fputs("</td></tr>\n", out);
}

static void print_errors(const json_t *result, FILE *out)
{
    const json_t *plain = json_object_get(json_object_get(result, "skill"), "plain_brdf");
    heading("Errors", out);
    fputs("<p class=\"hint\">Relative root mean square differences of measured and rendered radiances; after &plusmn; "
          "the "
          "standard error by tracing. The error of a row is its part of them.</p>\n<table>\n",
          out);
    error_row(result, "fitted rows", "fit_rel_rms", out);
    error_row(result, "held-out rows", "heldout_rel_rms", out);
    error_row(json_object_get(result, "cross_validation"), "fitted rows left out one after another", "rel_rms", out);
    error_row(plain, "a plain BRDF, held-out rows", "heldout_rel_rms", out);
    error_row(plain, "a plain BRDF, fitted rows left out one after another", "left_out_rel_rms", out);
    error_row(json_object_get(result, "verdict"), "what the measurements allow", "allowed_rel_rms", out);
    fputs("<tr><td>end of the fit</td><td>", out);
    page_escaped(page_string(result, "reason"), out);
    fputs("</td></tr>\n</table>\n", out);
}

static void print_flags(const json_t *p, FILE *out)
{
    const char *between = "";
    if (json_is_true(json_object_get(p, "fixed"))) {
        fputs("fixed", out);
        between = ", ";
    }
    if (json_is_string(json_object_get(p, "at_bound"))) {
        fprintf(out, "%sat its %s bound", between, page_string(p, "at_bound"));
        between = ", ";
    }
    if (json_is_false(json_object_get(p, "determined"))) {
        fprintf(out, "%snot determined", between);
        between = ", ";
    }
    if (!json_is_string(json_object_get(p, "tied_to"))) return;
    fprintf(out, "%stied to ", between);
    page_escaped(page_string(p, "tied_to"), out);
}

/* The three channels of a color have one meaning, which stands once. */
static bool says_the_same(const json_t *p, const json_t *before)
{
    return before != NULL && strcmp(page_string(p, "meaning"), page_string(before, "meaning")) == 0;
}

static void print_parameters(const char *title, const json_t *list, FILE *out)
{
    size_t i;
    const json_t *p, *before = NULL;
    if (json_array_size(list) == 0) return;
    heading(title, out);
    fputs("<table>\n<thead><tr><th>name</th><th>meaning</th><th class=\"n\">value &plusmn; standard "
          "error</th><th>unit</th><th class=\"n\">allowed</th><th></th></tr></thead>\n",
          out);
    json_array_foreach(list, i, p)
    {
        fputs("<tr><td class=\"key\">", out);
        page_escaped(page_string(p, "name"), out);
        fputs("</td><td class=\"hint\">", out);
        if (!says_the_same(p, before)) page_escaped(page_string(p, "meaning"), out);
        before = p;
        fputs("</td><td class=\"n\">", out);
        page_with_error(json_object_get(p, "value"), json_object_get(p, "standard_error"), 1.0, "", out);
        fputs("</td><td>", out);
        page_escaped(page_string(p, "unit"), out);
        fprintf(out, "</td><td class=\"n\">%.4g &hellip; %.4g</td><td class=\"flag\">", page_number(p, "lower"),
                page_number(p, "upper"));
        print_flags(p, out);
        fputs("</td></tr>\n", out);
    }
    fputs("</table>\n", out);
}

static void rgb_cell(const json_t *rgb, FILE *out)
{
    fputs("<td class=\"n rgb\">", out);
    for (size_t c = 0; c < 3; c++) fprintf(out, "%s%.4f", c > 0 ? " " : "", json_number_value(json_array_get(rgb, c)));
    fputs("</td>", out);
}

/* False for means over all rotations, and where all rows have the same one. */
static bool any_turned(const json_t *rows)
{
    const double first = page_number(json_array_get(rows, 0), "cloth_rotation_deg");
    size_t i;
    const json_t *row;
    json_array_foreach(rows, i, row)
    {
        if (!json_is_true(json_object_get(row, "all_rotations")) && page_number(row, "cloth_rotation_deg") != first)
            return true;
    }
    return false;
}

/* A direction as "polar angle / azimuth". */
static void direction_cell(const json_t *row, const char *theta, const char *phi, FILE *out)
{
    fprintf(out, "<td class=\"n\">%.1f / %.1f</td>", page_number(row, theta), page_number(row, phi));
}

static void print_row(const json_t *row, FILE *out)
{
    fprintf(out, "<tr%s><td>", strcmp(page_string(row, "set"), "fit") == 0 ? "" : " class=\"held\"");
    page_escaped(page_string(row, "name"), out);
    fprintf(out, "</td><td>%s</td>", page_string(row, "set"));
    direction_cell(row, "light_theta_deg", "light_phi_deg", out);
    direction_cell(row, "camera_theta_deg", "camera_phi_deg", out);
    if (json_is_true(json_object_get(row, "all_rotations")))
        fputs("<td class=\"n\">all</td>", out);
    else
        fprintf(out, "<td class=\"n\">%.1f</td>", page_number(row, "cloth_rotation_deg"));
    rgb_cell(json_object_get(row, "measured"), out);
    rgb_cell(json_object_get(row, "rendered"), out);
    fputs("<td class=\"n\">", out);
    page_percent(row, "rel_error", out);
    fputs("</td></tr>\n", out);
}

static void print_rows(const json_t *rows, FILE *out)
{
    size_t i;
    const json_t *row;
    heading("Measured and rendered", out);
    fputs("<p class=\"hint\">Angles in degrees: polar angle / azimuth.</p>\n<table class=\"rows\">\n<thead><tr><th>row"
          "</th><th>set</th><th class=\"n\">lamp</th><th class=\"n\">camera</th><th class=\"n\">turned</th><th "
          "class=\"n\">measured r g b</th><th class=\"n\">rendered r g b</th><th class=\"n\">error</th></tr></thead>\n"
          "<tbody>\n",
          out);
    json_array_foreach(rows, i, row) print_row(row, out);
    fputs("</tbody>\n</table>\n<div class=\"charts\">\n", out);
    page_scatter(rows, out);
    page_errors_over(rows, "light_theta_deg", "angle of the lamp, degrees", out);
    page_errors_over(rows, "camera_theta_deg", "angle of the camera, degrees", out);
    if (any_turned(rows)) page_errors_over(rows, "cloth_rotation_deg", "rotation of the cloth, degrees", out);
    fputs("</div>\n<p class=\"hint\">Rings, and blue lines of the table: held-out rows.</p>\n", out);
}

static status print_fit(struct report *report, const json_t *data, FILE *out, struct error *err)
{
    const json_t *result = json_object_get(data, "result"), *rows = json_object_get(result, "rows");
    print_errors(result, out);
    print_parameters("Fitted parameters", json_object_get(result, "parameters"), out);
    print_parameters("Numbers of the cloth", json_object_get(result, "cloth_numbers"), out);
    print_rows(rows, out);
    const bool table = report->in.photographs->n_photograph == 0;
    heading(table ? "Lobes" : "Pictures", out);
    status s = table ? page_lobes(report, result, out, err) : page_pictures(report, rows, out, err);
    heading("Course of the fit", out);
    page_curve(json_object_get(data, "curve"), out);
    heading("Correlation of the parameters", out);
    fputs("<p class=\"hint\">In fit coordinates; blue: positive, red: negative.</p>\n", out);
    page_correlation(json_object_get(result, "parameters"), json_object_get(result, "correlation"), out);
    heading("Gradient certificate", out);
    page_object(json_object_get(result, "certificate"), out);
    return s;
}

/* The cloth on surfaces, and the parameters if they were given. */
static status print_surfaces(struct report *report, const json_t *result, FILE *out, struct error *err)
{
    const json_t *list = json_object_get(result, "pictures");
    if (report->in.kind == JOB_OF_PICTURES)
        print_parameters("Given parameters", json_object_get(result, "parameters"), out);
    if (json_array_size(list) == 0) return STATUS_OK;
    heading("The cloth on surfaces", out);
    return page_surface_pictures(report, list, out, err);
}

/* Models that were fitted to the profile of a fiber, the best one first. */
static void print_profile(const struct report *report, const json_t *result, FILE *out)
{
    size_t i;
    const json_t *m, *profile = json_object_get(result, "profile");
    heading("Profile of the fiber", out);
    page_object(json_object_get(profile, "table"), out);
    for (int best = 1; best >= 0; best--) json_array_foreach(json_object_get(profile, "models"), i, m)
        {
            if (json_is_true(json_object_get(m, "best")) != (best == 1)) continue;
            char title[160];
            snprintf(title, sizeof title, "%s%s", page_string(m, "id"), best ? ", the best model" : "");
            heading(title, out);
            profile_page(report, i, out);
            print_parameters("Fitted parameters", json_object_get(m, "parameters"), out);
        }
}

static void print_inputs(const json_t *inputs, FILE *out)
{
    size_t i;
    const json_t *input;
    heading("Inputs", out);
    fputs("<table>\n<thead><tr><th>file</th><th>role</th><th class=\"n\">bytes</th><th>SHA-256</th></tr></thead>\n",
          out);
    json_array_foreach(inputs, i, input)
    {
        fputs("<tr><td>", out);
        page_escaped(page_string(input, "name"), out);
        fprintf(out, "</td><td>%s</td><td class=\"n\">%.0f</td><td><code>%s</code></td></tr>\n",
                page_string(input, "role"), page_number(input, "size"), page_string(input, "sha256"));
    }
    fputs("</table>\n", out);
}

static void print_settings(const json_t *data, FILE *out)
{
    const json_t *result = json_object_get(data, "result");
    if (json_is_object(json_object_get(result, "geometry"))) {
        heading("Geometry", out);
        page_object(json_object_get(result, "geometry"), out);
    }
    heading("Settings: the job document", out);
    page_object(json_object_get(data, "document"), out);
    heading("Settings that have their defaults", out);
    page_object(json_object_get(data, "defaults"), out);
    print_inputs(json_object_get(data, "inputs"), out);
    heading("Program and dates", out);
    fputs("<table>\n<tr><td>program</td><td>", out);
    page_escaped(page_string(data, "program"), out);
    fputs("</td></tr>\n", out);
    if (json_is_number(json_object_get(result, "seed")))
        fprintf(out, "<tr><td>seed</td><td>%.0f</td></tr>\n", page_number(result, "seed"));
    print_time("this attempt began", page_number(data, "started_unix_s"), out);
    print_time("written", page_number(data, "written_unix_s"), out);
    fputs("</table>\n", out);
}

static void print_list(const char *title, const json_t *texts, FILE *out)
{
    size_t i;
    const json_t *text;
    if (json_array_size(texts) == 0) return;
    heading(title, out);
    fputs("<ul>\n", out);
    json_array_foreach(texts, i, text)
    {
        fputs("<li>", out);
        page_escaped(json_string_value(text), out);
        fputs("</li>\n", out);
    }
    fputs("</ul>\n", out);
}

/* All reservations of the verdict: the first page has room for some. */
static void print_reservations(const json_t *verdict, FILE *out)
{
    json_t *texts = json_array();
    size_t i;
    const json_t *reservation;
    json_array_foreach(json_object_get(verdict, "reservations"), i, reservation)
        json_array_append(texts, json_object_get(reservation, "text"));
    print_list("Reservations", texts, out);
    json_decref(texts);
}

/* Everything that a reader may ask for after the first two pages. */
static status print_appendix(struct report *report, const json_t *data, FILE *out, struct error *err)
{
    const json_t *result = json_object_get(data, "result");
    status s = STATUS_OK;
    fputs("<h2 class=\"appendix\">Appendix: details</h2>\n<p class=\"hint\">", out);
    if (json_is_string(json_object_get(result, "model"))) {
        page_escaped(page_string(result, "model"), out);
        if (page_string(result, "method")[0] != '\0') fputs(", ", out);
        page_escaped(page_string(result, "method"), out);
        fputs(". ", out);
    }
    fputs("The same as data: report.json.</p>\n", out);
    print_reservations(json_object_get(result, "verdict"), out);
    print_list("Warnings", json_object_get(result, "warnings"), out);
    if (report->in.kind == JOB_OF_FIT) s = print_fit(report, data, out, err);
    if (report->in.kind == JOB_OF_PROFILE)
        print_profile(report, result, out);
    else if (s == STATUS_OK)
        s = print_surfaces(report, result, out, err);
    page_exports(report, out);
    json_t *statements = file_ledger_sentences(json_object_get(result, "files"));
    print_list("Statements of the files", statements, out);
    json_decref(statements);
    print_settings(data, out);
    return s;
}

static status print_page(struct report *report, const json_t *data, FILE *out, struct error *err)
{
    json_t *head = letterhead_file_read(report);
    fputs("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
          "content=\"width=device-width, initial-scale=1\">\n<link rel=\"icon\" href=\"data:,\">\n"
          "<title>",
          out);
    page_escaped(report->in.sample, out);
    fputs(" - report</title>\n<style>\n", out);
    page_style(strcmp(page_string(head, "paper"), "letter") == 0, out);
    fputs("</style>\n</head>\n<body>\n", out);
    status s = front_pages(report, data, head, out, err);
    json_decref(head);
    if (s == STATUS_OK) s = print_appendix(report, data, out, err);
    fputs("</body>\n</html>\n", out);
    return s;
}

static status write_text(const struct report *report, const char *name, const char *text, size_t n, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, name, path);
    return worker_folder_replace(report->in.job->tools->folder, path, text, n, err);
}

/* Takes the page over from another job. */
static status take_page(const struct report *report, struct error *err)
{
    char path[WORKER_PATH_BYTES], *text = NULL;
    size_t n = 0;
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_INPUT, report->in.results->report_file, path);
    status s = file_read_all(path, MOST_PAGE_BYTES, &text, &n, err);
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_REPORT_FILE);
    if (s == STATUS_OK) s = write_text(report, "report.html", text, n, err);
    free(text);
    return s;
}

static status write_page(struct report *report, const json_t *data, struct error *err)
{
    if (report->in.results->report_file[0] != '\0') return take_page(report, err);
    char *text = NULL;
    size_t n = 0;
    FILE *out = open_memstream(&text, &n);
    if (out == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the report: out of memory");
    status s = print_page(report, data, out, err);
    if (fclose(out) != 0 && s == STATUS_OK)
        s = error_set(err, STATUS_NO_MEMORY, "cannot write the report: out of memory");
    if (s == STATUS_OK) s = write_text(report, "report.html", text, n, err);
    free(text);
    return s;
}

status report_write(struct report *report, struct error *err)
{
    json_t *data = NULL;
    status s = report_data(report, &data, err);
    char *text = s == STATUS_OK ? json_dumps(data, JSON_REAL_PRECISION(17) | JSON_INDENT(1)) : NULL;
    if (s == STATUS_OK && text == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot write the report: out of memory");
    if (s == STATUS_OK) s = write_text(report, "report.json", text, strlen(text), err);
    if (s == STATUS_OK) s = write_page(report, data, err);
    free(text);
    json_decref(data);
    return s;
}
