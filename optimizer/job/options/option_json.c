#include "optimizer/job/options/option_json.h"
#include "optimizer/job/options/option_table.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const kind_name[OPTION_N_KIND] = {
    [OPTION_SECTION] = "section",
    [OPTION_LIST] = "list",
    [OPTION_NUMBER] = "number",
    [OPTION_NUMBERS] = "numbers",
    [OPTION_NUMBER_OR_LIST] = "number_or_numbers",
    [OPTION_COUNT] = "integer",
    [OPTION_COUNTS] = "integers",
    [OPTION_LARGE_COUNT] = "integer",
    [OPTION_BOOL] = "boolean",
    [OPTION_BOOL_OR_LEFT_OUT] = "boolean",
    [OPTION_CHOICE] = "choice",
    [OPTION_SWITCH] = "choice",
    [OPTION_WORD] = "choice",
    [OPTION_TEXT] = "text",
    [OPTION_FILE_NAME] = "file_name",
    [OPTION_FILE_NAMES] = "file_names",
    [OPTION_OWN] = "other",
};

static bool is_choice(enum option_kind kind)
{
    return kind == OPTION_CHOICE || kind == OPTION_SWITCH || kind == OPTION_WORD;
}

static bool is_list(enum option_kind kind) { return kind == OPTION_LIST || kind == OPTION_FILE_NAMES; }

/* Whole numbers without a decimal point. */
static json_t *json_of_number(double x)
{
    return x == rint(x) && fabs(x) < 1e15 ? json_integer((json_int_t)x) : json_real(x);
}

static void put_text(json_t *json, const char *key, const char *text)
{
    if (text != NULL && text[0] != '\0') json_object_set_new(json, key, json_string(text));
}

static void put_range(json_t *json, const struct job_option *row)
{
    switch (row->kind) {
    case OPTION_NUMBER:
    case OPTION_NUMBERS:
    case OPTION_NUMBER_OR_LIST:
    case OPTION_COUNT:
    case OPTION_COUNTS:
        json_object_set_new(json, "lower", json_of_number(row->lower));
        json_object_set_new(json, "upper", json_of_number(row->upper));
        break;
    case OPTION_LARGE_COUNT:
        json_object_set_new(json, "lower", json_of_number(row->lower));
        break;
    default:
        break;
    }
    if (row->kind == OPTION_NUMBERS || row->kind == OPTION_NUMBER_OR_LIST || row->kind == OPTION_COUNTS)
        json_object_set_new(json, "n", json_integer((json_int_t)row->n));
    if (is_list(row->kind)) json_object_set_new(json, "max_items", json_of_number(row->upper));
}

static void put_choices(json_t *json, const struct job_option *row)
{
    json_t *list = json_array();
    for (size_t i = 0; job_option_choice(row, i) != NULL; i++)
        json_array_append_new(list, json_string(job_option_choice(row, i)));
    json_object_set_new(json, "choices", list);
    if (!row->required && row->left_out == NULL)
        json_object_set_new(json, "default", json_string(job_option_choice(row, 0)));
}

static json_t *option_json(const struct job_option *row)
{
    json_t *json =
        json_pack("{s:s,s:s,s:b}", "path", row->path, "kind", kind_name[row->kind], "required", (int)row->required);
    if (row->or_section) json_object_set_new(json, "or_section", json_true());
    put_text(json, "or_word", row->or_word);
    put_text(json, "unit", row->unit);
    put_range(json, row);
    if (is_choice(row->kind)) put_choices(json, row);
    if (row->standard != NULL) json_object_set_new(json, "default", json_loads(row->standard, JSON_DECODE_ANY, NULL));
    put_text(json, "left_out", row->left_out);
    put_text(json, "allowed", row->allowed);
    if (row->schema != NULL) json_object_set_new(json, "schema", json_loads(row->schema, 0, NULL));
    put_text(json, "meaning", row->meaning);
    return json;
}

json_t *job_options_json(void)
{
    json_t *list = json_array();
    JOB_OPTION_EACH(row) json_array_append_new(list, option_json(row));
    return json_pack("{s:o}", "options", list);
}

/* The object of the document in which the key of a path lies; NULL when the document does not have it. */
static const json_t *section_of(const json_t *document, const char *path, const char **key)
{
    char part[80];
    for (const char *dot; (dot = strchr(path, '.')) != NULL; path = dot + 1) {
        snprintf(part, sizeof part, "%.*s", (int)(dot - path), path);
        document = json_object_get(document, part);
    }
    *key = path;
    return document;
}

json_t *job_options_defaults_json(const json_t *document, bool has_rows)
{
    static const char *const of_every_job[] = {"lamp.",       "camera.",       "environment.",
                                               "black_sheet", "fit.nuisance.", "fit."};
    json_t *options = job_options_json(), *defaults = json_object();
    const json_t *option;
    size_t i;
    json_array_foreach(json_object_get(options, "options"), i, option)
    {
        const char *path = json_string_value(json_object_get(option, "path")), *key;
        const json_t *section = section_of(document, path, &key);
        bool applies = section != NULL && (key != path || strcmp(path, "black_sheet") == 0);
        for (size_t k = 0; k < sizeof of_every_job / sizeof of_every_job[0] && has_rows; k++)
            applies = applies || (strncmp(path, of_every_job[k], strlen(of_every_job[k])) == 0 &&
                                  strchr(path + strlen(of_every_job[k]), '.') == NULL);
        json_t *value = json_object_get(option, "default");
        applies = applies && strncmp(path, "cloth.", strlen("cloth.")) != 0;
        if (applies && value != NULL && strchr(path, '[') == NULL && json_object_get(section, key) == NULL)
            json_object_set(defaults, path, value);
    }
    json_decref(options);
    return defaults;
}
