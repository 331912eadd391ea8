#include "optimizer/report/result/export_summary.h"

#include "base/percent_words.h"

#include <math.h>

double export_error_of(const json_t *errors, size_t i)
{
    const json_t *x = json_array_get(errors, i);
    return json_is_number(x) ? json_number_value(x) : NAN;
}

size_t export_worst_row(const json_t *errors)
{
    size_t worst = 0;
    for (size_t i = 1; i < json_array_size(errors); i++)
        if (export_error_of(errors, i) > export_error_of(errors, worst)) worst = i;
    return worst;
}

const char *export_worst_name(const struct report *report, const json_t *errors)
{
    const struct observation_set *rows = &report->in.job->rows->observation;
    const size_t i = export_worst_row(errors);
    return i < rows->n && i < json_array_size(errors) ? rows->item[i].name : "";
}

static double number_of(const json_t *json, const char *key)
{
    const json_t *x = json_object_get(json, key);
    return json_is_number(x) ? json_number_value(x) : NAN;
}

void export_summary_print(const struct report *report, FILE *out)
{
    size_t i, k;
    const json_t *json, *text;
    if (json_array_size(report->exports) == 0) return;
    fputs("\nfiles for other programs: relative RMS difference of their cloth from this job's renderings, over all "
          "rows\n",
          out);
    json_array_foreach(report->exports, i, json)
    {
        const json_t *errors = json_object_get(json, "row_rel_errors");
        char percent[PERCENT_WORDS_BYTES];
        percent_words(number_of(json, "row_rel_rms"), number_of(json, "row_rel_rms_se"), percent);
        fprintf(out, "  %-16s %16s", json_string_value(json_object_get(json, "folder")), percent);
        if (json_array_size(errors) > 0)
            fprintf(out, ", at most %.1f %% in row %s", 100.0 * export_error_of(errors, export_worst_row(errors)),
                    export_worst_name(report, errors));
        if (json_is_true(json_object_get(json, "exact"))) fputs("; exact.xml shows the fitted scattering itself", out);
        fputc('\n', out);
        json_array_foreach(json_object_get(json, "warnings"), k, text)
            fprintf(out, "  %-16s warning: %s\n", "", json_string_value(text));
    }
}
