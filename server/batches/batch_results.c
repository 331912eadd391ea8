/* The table of results of a batch. */
#include "base/files/foreign_json.h"
#include "optimizer/job/job_folder.h"
#include "server/batches/batch_service.h"
#include "server/batches/batch_view.h"
#include "server/settings/job_paths.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const number[] = {"fit_rel_rms", "fit_rel_rms_se", "heldout_rel_rms", "heldout_rel_rms_se", NULL};
static const char *const shown_member[] = {
    "verdict", "parameters", "model", "fit_rel_rms", "fit_rel_rms_se", "heldout_rel_rms", "heldout_rel_rms_se", NULL};
static const struct foreign_bounds result_bounds = {64 << 20, 2 << 20, 64, shown_member};

static json_t *read_result(struct job_service *v, const char *job_id)
{
    char folder[PATH_BYTES];
    json_t *j = NULL;
    path_join(folder, v->settings->data, "jobs", job_id, NULL);
    foreign_json_read(folder, JOB_FOLDER_RESULTS "/result.json", &result_bounds, &j, NULL);
    return j;
}

/* Copies a member if it is a number, or sets null. */
static void put_number(json_t *out, const json_t *from, const char *key)
{
    json_t *x = json_object_get(from, key);
    json_object_set(out, key, json_is_number(x) ? x : json_null());
}

static json_t *flags_of(const json_t *result)
{
    json_t *flags = json_array(), *one;
    size_t i;
    json_array_foreach(json_object_get(json_object_get(result, "verdict"), "reservations"), i, one)
    {
        json_t *code = json_object_get(one, "code");
        if (json_is_string(code)) json_array_append(flags, code);
    }
    return flags;
}

static json_t *parameters_of(const json_t *result)
{
    json_t *list = json_array(), *one;
    size_t i;
    json_array_foreach(json_object_get(result, "parameters"), i, one)
    {
        json_t *name = json_object_get(one, "name"), *unit = json_object_get(one, "unit"), *p = json_object();
        if (json_is_string(name)) {
            json_object_set(p, "name", name);
            json_object_set(p, "unit", json_is_string(unit) ? unit : json_null());
            put_number(p, one, "value");
            put_number(p, one, "standard_error");
            json_object_set_new(p, "determined", json_boolean(!json_is_false(json_object_get(one, "determined"))));
            json_object_set_new(p, "fixed", json_boolean(json_is_true(json_object_get(one, "fixed"))));
            json_array_append(list, p);
        }
        json_decref(p);
    }
    return list;
}

/* The best of the job's models. */
static json_t *model_of(const json_t *result)
{
    json_t *id = json_object_get(result, "model");
    return json_is_string(id) ? json_incref(id) : json_null();
}

static json_t *row_of(struct job_service *v, const struct job_row *row)
{
    json_t *result = row->state == JOB_SUCCEEDED ? read_result(v, row->id) : NULL;
    json_t *out =
        json_pack("{s:s,s:s,s:s}", "sample", row->sample, "job", row->id, "state", job_state_name(row->state));
    json_object_set_new(out, "verdict", row->verdict[0] != '\0' ? json_string(row->verdict) : json_null());
    json_object_set_new(out, "model", model_of(result));
    for (size_t i = 0; number[i] != NULL; i++) put_number(out, result, number[i]);
    json_object_set_new(out, "flags", flags_of(result));
    json_object_set_new(out, "parameters", parameters_of(result));
    json_object_set_new(out, "error",
                        row->error_code[0] == '\0' ? json_null()
                                                   : json_pack("{s:s,s:s,s:s}", "code", row->error_code, "field",
                                                               row->error_field, "text", row->error_text));
    json_decref(result);
    return out;
}

static bool is_wanted(const char *verdicts, const struct job_row *row)
{
    char code[sizeof row->verdict + 2];
    snprintf(code, sizeof code, ",%s,", row->verdict);
    return verdicts[0] == '\0' || strstr(verdicts, code) != NULL;
}

status batch_results(struct job_service *v, const char *id, const char *verdicts, json_t **table, struct error *err)
{
    struct job_row *row = NULL;
    size_t n = 0;
    status s = batch_jobs(v, id, &row, &n, err);
    if (s != STATUS_OK) return s;
    json_t *list = json_array();
    for (size_t i = 0; i < n; i++)
        if (is_wanted(verdicts, &row[i])) json_array_append_new(list, row_of(v, &row[i]));
    job_rows_free(row, n);
    *table = json_pack("{s:s,s:o}", "batch", id, "samples", list);
    return STATUS_OK;
}

/* A field of the CSV. One that a spreadsheet would take for a formula gets an apostrophe. */
static void write_text(FILE *out, const char *text)
{
    bool formula = text[0] != '\0' && strchr("=+-@\t\r", text[0]) != NULL;
    bool quote = formula || strpbrk(text, ",\"\r\n") != NULL;
    if (quote) fputc('"', out);
    if (formula) fputc('\'', out);
    for (const char *c = text; *c != '\0'; c++) {
        if (*c == '"') fputc('"', out);
        fputc(*c, out);
    }
    if (quote) fputc('"', out);
}

static void write_member(FILE *out, const json_t *object, const char *key)
{
    const json_t *x = json_object_get(object, key);
    fputc(',', out);
    if (json_is_string(x)) write_text(out, json_string_value(x));
    if (json_is_number(x)) fprintf(out, "%.9g", json_number_value(x));
}

/* The codes of a row's reservations between blanks, in one field. */
static void write_flags(FILE *out, const json_t *flags)
{
    char *text = NULL;
    size_t n_text = 0, i;
    json_t *one;
    FILE *list = open_memstream(&text, &n_text);
    if (list == NULL) return;
    json_array_foreach(flags, i, one) fprintf(list, "%s%s", i == 0 ? "" : " ", json_string_value(one));
    fputc(',', out);
    if (fclose(list) == 0) write_text(out, text);
    free(text);
}

static const json_t *parameter_named(const json_t *row, const char *name)
{
    json_t *one;
    size_t i;
    json_array_foreach(json_object_get(row, "parameters"), i,
                       one) if (strcmp(json_string_value(json_object_get(one, "name")), name) == 0) return one;
    return NULL;
}

static void write_row(FILE *out, const json_t *row, const json_t *names)
{
    static const char *const member[] = {"job",         "state",          "verdict",         "model",
                                         "fit_rel_rms", "fit_rel_rms_se", "heldout_rel_rms", "heldout_rel_rms_se"};
    json_t *value;
    const char *name;
    size_t i;
    write_text(out, json_string_value(json_object_get(row, "sample")));
    for (i = 0; i < sizeof member / sizeof member[0]; i++) write_member(out, row, member[i]);
    write_flags(out, json_object_get(row, "flags"));
    json_object_foreach((json_t *)(uintptr_t)names, name, value)
    {
        const json_t *p = parameter_named(row, name);
        write_member(out, p, "value");
        write_member(out, p, "standard_error");
        fprintf(out, ",%s",
                p == NULL                                         ? ""
                : json_is_true(json_object_get(p, "fixed"))       ? "fixed"
                : json_is_false(json_object_get(p, "determined")) ? "no"
                                                                  : "yes");
    }
    write_member(out, json_object_get(row, "error"), "text");
    fputs("\r\n", out);
}

char *batch_results_csv(const json_t *table)
{
    char *text = NULL;
    size_t n_text = 0, i, k;
    json_t *names = json_object(), *row, *p, *value;
    const char *name;
    FILE *out = open_memstream(&text, &n_text);
    if (out == NULL) {
        json_decref(names);
        return NULL;
    }
    json_array_foreach(json_object_get(table, "samples"), i, row)
        json_array_foreach(json_object_get(row, "parameters"), k, p)
            json_object_set(names, json_string_value(json_object_get(p, "name")), json_true());
    fputs("sample,job,state,verdict,model,fit_rel_rms,fit_rel_rms_se,heldout_rel_rms,heldout_rel_rms_se,flags", out);
    json_object_foreach(names, name, value)
    {
        static const char *const suffix[] = {"", "_se", "_determined"};
        char column[200];
        for (k = 0; k < 3; k++) {
            snprintf(column, sizeof column, "%.160s%s", name, suffix[k]);
            fputc(',', out);
            write_text(out, column);
        }
    }
    fputs(",error\r\n", out);
    json_array_foreach(json_object_get(table, "samples"), i, row) write_row(out, row, names);
    json_decref(names);
    if (fclose(out) == 0) return text;
    free(text);
    return NULL;
}
