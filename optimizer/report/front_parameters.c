#include "optimizer/report/front_page.h"
#include "optimizer/report/page_text.h"
#include "optimizer/report/result/profile_report.h"

#include <string.h>

/* Lines of the table, so that the page has room for the figures. */
enum { MAX_LINE = 10 };

static void cell(const json_t *p, bool percent, const char *span, FILE *out)
{
    fprintf(out, "<td class=\"n\"%s>", span);
    page_with_error(json_object_get(p, "value"), json_object_get(p, "standard_error"), percent ? 100.0 : 1.0,
                    percent ? " %" : "", out);
    if (!percent && page_string(p, "unit")[0] != '\0') {
        fputc(' ', out);
        page_escaped(strcmp(page_string(p, "unit"), "deg") == 0 ? "°" : page_string(p, "unit"), out);
    }
    fputs("</td>", out);
}

/* The remarks of n values together: what holds for one of them is said. */
static void remark(const json_t *list, size_t first, size_t n, FILE *out)
{
    bool fixed = true, bound = false, unknown = false;
    for (size_t i = first; i < first + n; i++) {
        const json_t *p = json_array_get(list, i);
        fixed = fixed && json_is_true(json_object_get(p, "fixed"));
        bound = bound || json_is_string(json_object_get(p, "at_bound"));
        unknown = unknown || json_is_false(json_object_get(p, "determined"));
    }
    fprintf(out, "<td class=\"flag\">%s</td></tr>\n",
            fixed     ? "given"
            : unknown ? "not determined"
            : bound   ? "at the edge of its range"
                      : "");
}

static void name_cell(const struct param_info *info, FILE *out)
{
    fputs("<tr><td>", out);
    if (info->set != NULL) {
        page_escaped(info->set, out);
        fputs(": ", out);
    }
    page_escaped(info->meaning != NULL ? info->meaning : info->name, out);
    fputs(" <small>", out);
    page_escaped(param_own_symbol(info), out);
    fputs("</small></td>", out);
}

/* One line: a color of three values, or one value. Returns the number of values. */
static size_t line(const struct param_info *info, size_t n_info, const json_t *list, size_t i, FILE *out)
{
    const bool color = info[i].channel == 0 && i + 2 < n_info && strcmp(info[i].symbol, info[i + 2].symbol) == 0;
    /* a share of light reads best in per cent */
    const bool percent = info[i].kind == PARAM_COLOUR && info[i].unit == PARAM_UNIT_NONE && info[i].upper <= 1.0;
    const size_t n = color ? 3 : 1;
    name_cell(&info[i], out);
    for (size_t k = 0; k < n; k++) cell(json_array_get(list, i + k), percent, color ? "" : " colspan=\"3\"", out);
    remark(list, i, n, out);
    return n;
}

static size_t lines(const struct param_info *info, size_t n_info, const json_t *list, size_t n_line, FILE *out)
{
    for (size_t i = 0; i < n_info && i < json_array_size(list);) {
        if (n_line >= MAX_LINE) return n_line + 1;
        i += line(info, n_info, list, i, out);
        n_line++;
    }
    return n_line;
}

static const struct pipeline_model *best_model(const struct report *report)
{
    return &report->model[report->in.kind == JOB_OF_PICTURES ? 0 : report_best_model(report)];
}

void front_parameters(const struct report *report, const json_t *result, FILE *out)
{
    const struct pipeline_model *m = best_model(report);
    const json_t *list = json_object_get(result, "parameters"), *number = json_object_get(result, "cloth_numbers");
    if (json_array_size(list) == 0 && json_array_size(number) == 0) return;
    fprintf(out,
            "<h2>%s</h2>\n<table class=\"words\">\n<thead><tr><th>meaning</th><th class=\"n\">red</th><th "
            "class=\"n\">green</th><th class=\"n\">blue</th><th></th></tr></thead>\n<tbody>\n",
            report->in.kind == JOB_OF_PICTURES ? "Given parameters" : "Parameters, with their standard errors");
    size_t n_line = lines(m->setup->sets.info.param, m->setup->sets.info.n_param, list, 0, out);
    if (n_line <= MAX_LINE) n_line = lines(report->in.made->number.info, json_array_size(number), number, n_line, out);
    fputs("</tbody>\n</table>\n", out);
    if (n_line > MAX_LINE) fputs("<p class=\"hint\">The other parameters are in the appendix.</p>\n", out);
}
