#include "optimizer/report/page_exports.h"

#include "base/angle.h"
#include "optimizer/report/page_text.h"
#include "optimizer/report/result/export_summary.h"

#include <math.h>
#include <string.h>

enum { MOST_COLUMNS = 8, TITLE_BYTES = 160 };
static const double marked_error = 0.1;

/* Formats that have the same error in each row. */
struct column {
    const json_t *errors;
    char title[TITLE_BYTES];
};

static const struct observation_set *rows_of(const struct report *report) { return &report->in.job->rows->observation; }

static void percent_cell(double share, FILE *out)
{
    if (isfinite(share))
        fprintf(out, "<td class=\"n%s\">%.1f %%</td>", share > marked_error ? " flag" : "", 100.0 * share);
    else
        fputs("<td class=\"n\">-</td>", out);
}

static void print_formats(const struct report *report, FILE *out)
{
    size_t i;
    const json_t *json;
    fputs("<table class=\"exports\">\n<thead><tr><th>format</th><th class=\"n\">all rows</th><th class=\"n\">worst "
          "row</th><th></th></tr></thead>\n<tbody>\n",
          out);
    json_array_foreach(report->exports, i, json)
    {
        const json_t *errors = json_object_get(json, "row_rel_errors");
        fprintf(out, "<tr><td>%s</td>", page_string(json, "format"));
        percent_cell(page_number(json, "row_rel_rms"), out);
        percent_cell(export_error_of(errors, export_worst_row(errors)), out);
        fputs("<td>", out);
        page_escaped(export_worst_name(report, errors), out);
        fputs("</td></tr>\n", out);
    }
    fputs("</tbody>\n</table>\n", out);
}

static void print_notes(const struct report *report, FILE *out)
{
    size_t i, k;
    const json_t *json, *text;
    fputs("<ul>\n", out);
    json_array_foreach(report->exports, i, json)
    {
        const char *format = page_string(json, "format");
        if (json_is_true(json_object_get(json, "exact")))
            fprintf(out, "<li>%s: exact.xml shows the fitted scattering itself.</li>\n", format);
        json_array_foreach(json_object_get(json, "warnings"), k, text)
        {
            fprintf(out, "<li class=\"flag\">%s: ", format);
            page_escaped(json_string_value(text), out);
            fputs(".</li>\n", out);
        }
    }
    fputs("</ul>\n", out);
}

static size_t find_columns(const struct report *report, struct column column[MOST_COLUMNS])
{
    size_t i, n = 0;
    const json_t *json;
    json_array_foreach(report->exports, i, json)
    {
        const json_t *errors = json_object_get(json, "row_rel_errors");
        size_t k = 0;
        if (json_array_size(errors) != rows_of(report)->n) continue;
        while (k < n && !json_equal(errors, column[k].errors)) k++;
        if (k == MOST_COLUMNS) continue;
        if (k == n) column[n++] = (struct column){.errors = errors};
        const size_t length = strlen(column[k].title);
        snprintf(column[k].title + length, TITLE_BYTES - length, "%s%.20s", length > 0 ? ", " : "",
                 page_string(json, "format"));
    }
    return n;
}

static void print_row_errors(const struct report *report, FILE *out)
{
    struct column column[MOST_COLUMNS];
    const size_t n = find_columns(report, column);
    if (n == 0) return;
    fputs("<p class=\"hint\">Row by row; angles in degrees: polar angle / azimuth.</p>\n<table "
          "class=\"rows\">\n<thead><tr><th>row</th><th class=\"n\">lamp</th><th class=\"n\">camera</th>",
          out);
    for (size_t k = 0; k < n; k++) fprintf(out, "<th class=\"n\">%s</th>", column[k].title);
    fputs("</tr></thead>\n<tbody>\n", out);
    for (size_t i = 0; i < rows_of(report)->n; i++) {
        const struct configuration *c = &rows_of(report)->item[i].configuration;
        fputs("<tr><td>", out);
        page_escaped(rows_of(report)->item[i].name, out);
        fprintf(out, "</td><td class=\"n\">%.1f / %.1f</td><td class=\"n\">%.1f / %.1f</td>",
                DEG_PER_RAD * c->light_theta_rad, DEG_PER_RAD * c->light_phi_rad, DEG_PER_RAD * c->camera_theta_rad,
                DEG_PER_RAD * c->camera_phi_rad);
        for (size_t k = 0; k < n; k++) percent_cell(export_error_of(column[k].errors, i), out);
        fputs("</tr>\n", out);
    }
    fputs("</tbody>\n</table>\n", out);
}

void page_exports(const struct report *report, FILE *out)
{
    if (json_array_size(report->exports) == 0) return;
    fputs("<h2>Files for other programs</h2>\n<p class=\"hint\">How far the cloth with the materials of these files is "
          "from this job's renderings: root mean square of the relative difference of radiance, computed before the "
          "files were written. Errors above 10 % are marked.</p>\n",
          out);
    print_formats(report, out);
    print_notes(report, out);
    print_row_errors(report, out);
}
