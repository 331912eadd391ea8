#include "optimizer/job/options/option_reader.h"
#include "optimizer/job/checks/job_consistency.h"
#include "optimizer/job/checks/job_faults.h"
#include "optimizer/job/checks/option_checks.h"
#include "optimizer/job/document/job_file_name.h"
#include "optimizer/job/document/json_field.h"
#include "optimizer/job/options/option_section.h"
#include "optimizer/job/options/option_table.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_KEY = 64, MAX_CHOICE = 40 };

/* A document while it is read. */
struct reading {
    struct job_document *doc;
    struct job_sections section;  /* of doc, for checks */
    struct job_fault_list *fault; /* all faults go there; NULL: reading ends at the first */
};

static status read_section(const struct json_field *f, const char *pattern, void *base, struct reading *r,
                           struct error *err);

/* The struct that the row's offsets are of: its section, or `base`, an element of a list. */
static void *base_of(const struct job_option *row, void *base, const struct reading *r)
{
    const struct job_document *doc = r->doc;
    void *const at[JOB_N_SECTION] = {
        [JOB_SECTION_none] = base,        [JOB_SECTION_scan] = doc->scan,       [JOB_SECTION_cloth] = doc->cloth,
        [JOB_SECTION_setup] = doc->setup, [JOB_SECTION_rows] = doc->rows,       [JOB_SECTION_profile] = doc->profile,
        [JOB_SECTION_fit] = doc->fit,     [JOB_SECTION_results] = doc->results,
    };
    return at[row->section];
}

/* Number of faults found so far where all are collected. */
static size_t n_fault(const struct reading *r) { return r->fault != NULL ? r->fault->n + r->fault->n_more : 0; }

/* Ends reading with an error, or keeps it with the other faults and goes on. */
static status stop_or_keep(status s, const struct error *fault, struct reading *r, struct error *err)
{
    if (s == STATUS_OK) return s;
    if (r->fault == NULL || s == STATUS_NO_MEMORY) {
        if (err != NULL) *err = *fault;
        return s;
    }
    job_faults_add(r->fault, fault);
    return STATUS_OK;
}

static status no_memory(struct error *err)
{
    return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
}

/* Index of the word among the choices of the row. */
static status read_choice(const struct job_option *row, const struct json_field *f, const char *key, size_t *index,
                          struct error *err)
{
    const char *name[MAX_CHOICE + 1];
    size_t n = 0;
    while (n < MAX_CHOICE && (name[n] = job_option_choice(row, n)) != NULL) n++;
    name[n] = NULL;
    const char *given = json_string_value(json_object_get(f->object, key));
    if (row->removed_word != NULL && given != NULL && strcmp(given, row->removed_word) == 0) {
        char path[JSON_PATH_BYTES];
        json_field_path(f, key, path);
        return error_set_field(err, STATUS_INVALID, path, "'%s' is '%s', which %s", path, given, row->removed_why);
    }
    return json_field_choice(f, key, name, index, err);
}

static status read_word(const struct job_option *row, const struct json_field *f, const char *key, void *target,
                        struct error *err)
{
    size_t index = 0;
    status s = read_choice(row, f, key, &index, err);
    if (s != STATUS_OK) return s;
    if (row->kind == OPTION_SWITCH)
        *(bool *)target = index == 1;
    else if (row->kind == OPTION_CHOICE)
        memcpy(target, &(unsigned){(unsigned)index}, sizeof(unsigned));
    else
        snprintf(target, row->n, "%s", job_option_choice(row, index));
    return STATUS_OK;
}

static status read_number_or_list(const struct job_option *row, const struct json_field *f, const char *key,
                                  double *target, struct error *err)
{
    if (json_is_array(json_object_get(f->object, key)))
        return json_field_number_array(f, key, row->n, row->lower, row->upper, target, err);
    status s = json_field_number(f, key, row->lower, row->upper, &target[0], err);
    for (size_t i = 1; i < row->n; i++) target[i] = target[0];
    return s;
}

static status read_bool(const struct job_option *row, const struct json_field *f, const char *key, void *base,
                        struct reading *r, struct error *err)
{
    void *target = (char *)base + row->at;
    const json_t *value = json_object_get(f->object, key);
    struct json_field sub = {.object = value};
    bool given = false;
    json_field_path(f, key, sub.path);
    if (row->or_section && json_is_object(value)) {
        *(bool *)target = true;
        return read_section(&sub, row->path, base, r, err);
    }
    if (row->or_section && !json_is_boolean(value))
        return error_set_field(err, STATUS_INVALID, sub.path, "'%s' must be true, false or an object of %s", sub.path,
                               row->items);
    status s = json_field_bool(f, key, &given, err);
    if (s != STATUS_OK) return s;
    if (row->kind == OPTION_BOOL_OR_LEFT_OUT)
        *(int *)target = given;
    else
        *(bool *)target = given;
    return STATUS_OK;
}

/* Allocates the elements of a list, which must be neither empty nor too long. Sets the count to 0. */
static status new_list(const struct job_option *row, const struct json_field *list, void *base, char **element,
                       struct error *err)
{
    size_t n = json_array_size(list->object);
    if (!json_is_array(list->object) || n == 0 || n > (size_t)row->upper)
        return error_set_field(err, STATUS_INVALID, list->path, "'%s' must be a list of 1 to %d %s", list->path,
                               (int)row->upper, row->items);
    *element = calloc(n, row->element_bytes);
    if (*element == NULL) return no_memory(err);
    memcpy((char *)base + row->at, element, sizeof *element);
    *(size_t *)((char *)base + row->count_at) = 0;
    return STATUS_OK;
}

static status read_file_names(const struct job_option *row, const struct json_field *list, void *base,
                              struct error *err)
{
    char *name, path[JSON_PATH_BYTES];
    status s = new_list(row, list, base, &name, err);
    for (size_t i = 0; s == STATUS_OK && i < json_array_size(list->object); i++, name += row->element_bytes) {
        const char *text = json_string_value(json_array_get(list->object, i));
        snprintf(path, sizeof path, "%.140s[%zu]", list->path, i);
        if (text == NULL)
            return error_set_field(err, STATUS_INVALID, path, "'%s' must be a text: the name of an input file", path);
        s = job_check_file_name(path, text, err);
        if (s != STATUS_OK) return s;
        snprintf(name, row->element_bytes, "%s", text);
        ++*(size_t *)((char *)base + row->count_at);
    }
    return s;
}

static status default_section(const char *pattern, void *base, struct reading *r, struct error *err);

static status read_list(const struct job_option *row, const struct json_field *list, void *base, struct reading *r,
                        struct error *err)
{
    char *element, pattern[JSON_PATH_BYTES];
    const char *word = json_string_value(list->object);
    if (row->or_section && json_is_object(list->object)) return read_section(list, row->path, base, r, err);
    if (row->or_word != NULL && word != NULL && strcmp(word, row->or_word) == 0) {
        *(bool *)((char *)base + row->word_at) = true;
        return STATUS_OK;
    }
    status s = new_list(row, list, base, &element, err);
    snprintf(pattern, sizeof pattern, "%s[]", row->path);
    for (size_t i = 0; s == STATUS_OK && i < json_array_size(list->object); i++, element += row->element_bytes) {
        struct json_field f = {.object = json_array_get(list->object, i)};
        snprintf(f.path, sizeof f.path, "%.140s[%zu]", list->path, i);
        s = default_section(pattern, element, r, err);
        if (s == STATUS_OK) s = read_section(&f, pattern, element, r, err);
        if (s == STATUS_OK) ++*(size_t *)((char *)base + row->count_at);
    }
    return s;
}

static status read_file_name(const struct job_option *row, const struct json_field *f, const char *key, char *target,
                             struct error *err)
{
    char path[JSON_PATH_BYTES];
    json_field_path(f, key, path);
    status s = json_field_text(f, key, row->required, target, JOB_MAX_NAME_BYTES, err);
    return s == STATUS_OK ? job_check_file_name(path, target, err) : s;
}

static status read_object(const struct job_option *row, const struct json_field *f, const char *key, void *base,
                          struct reading *r, struct error *err)
{
    struct json_field sub;
    bool present;
    status s = json_field_object(f, key, &sub, &present, err);
    if (s != STATUS_OK) return s;
    if (row->stored) *(bool *)((char *)base + row->at) = present;
    const size_t n_before = n_fault(r);
    const bool may_be_empty = row->stored || row->may_be_empty || json_object_size(sub.object) > 0;
    s = read_section(&sub, row->path, base, r, err);
    if (s != STATUS_OK || may_be_empty || n_fault(r) > n_before) return s;
    return error_set_field(err, STATUS_INVALID, sub.path, "'%s' is empty and would do nothing: fill it or leave it out",
                           sub.path);
}

/* Reads the value of a key that is given or required. */
static status read_value(const struct job_option *row, const struct json_field *f, const char *key, void *base,
                         struct reading *r, struct error *err)
{
    void *target = (char *)base + row->at;
    struct json_field sub = {.object = json_object_get(f->object, key)};
    json_field_path(f, key, sub.path);
    switch (row->kind) {
    case OPTION_SECTION:
        return read_object(row, f, key, base, r, err);
    case OPTION_LIST:
        return read_list(row, &sub, base, r, err);
    case OPTION_FILE_NAMES:
        return read_file_names(row, &sub, base, err);
    case OPTION_NUMBER:
        return json_field_required_number(f, key, row->lower, row->upper, target, err);
    case OPTION_NUMBERS:
        return json_field_number_array(f, key, row->n, row->lower, row->upper, target, err);
    case OPTION_NUMBER_OR_LIST:
        return read_number_or_list(row, f, key, target, err);
    case OPTION_COUNT:
        return json_field_size(f, key, (size_t)row->lower, (size_t)row->upper, target, err);
    case OPTION_COUNTS:
        return json_field_size_array(f, key, row->n, (size_t)row->lower, (size_t)row->upper, target, err);
    case OPTION_LARGE_COUNT:
        return json_field_u64(f, key, (uint64_t)row->lower, target, err);
    case OPTION_BOOL:
    case OPTION_BOOL_OR_LEFT_OUT:
        return read_bool(row, f, key, base, r, err);
    case OPTION_CHOICE:
    case OPTION_SWITCH:
    case OPTION_WORD:
        return read_word(row, f, key, target, err);
    case OPTION_TEXT:
        return json_field_text(f, key, row->required, target, row->n, err);
    case OPTION_FILE_NAME:
        return read_file_name(row, f, key, target, err);
    case OPTION_OWN:
    case OPTION_N_KIND:
        break;
    }
    return STATUS_OK;
}

/* Kinds whose readers report no error when a required key is missing. */
static bool lacks_message(enum option_kind kind)
{
    return kind != OPTION_NUMBER && kind != OPTION_TEXT && kind != OPTION_FILE_NAME && kind != OPTION_FILE_NAMES;
}

static status read_option(const struct job_option *row, const struct json_field *f, const char *key, void *base,
                          struct reading *r, struct error *err)
{
    base = base_of(row, base, r);
    struct option_value v = {.row = row,
                             .value = json_object_get(f->object, key),
                             .target = (char *)base + row->at,
                             .own = base,
                             .section = &r->section};
    char path[JSON_PATH_BYTES];
    if (v.value == NULL && !row->required) return STATUS_OK;
    if (v.value == NULL && lacks_message(row->kind))
        return error_set_field(err, STATUS_INVALID, f->path, "'%s' lacks '%s'", f->path, key);
    const size_t n_before = n_fault(r);
    status s = read_value(row, f, key, base, r, err);
    if (s != STATUS_OK || row->check == NULL || n_fault(r) > n_before) return s;
    json_field_path(f, key, path);
    v.path = path;
    return row->check(&v, err);
}

/* Reads all members of an object. pattern: its path in the table; base: the struct to which the offsets of the members
 * refer. */
static status read_section(const struct json_field *f, const char *pattern, void *base, struct reading *r,
                           struct error *err)
{
    const char *key, *allowed[MAX_KEY + 1];
    const struct job_option *of[MAX_KEY];
    size_t n = 0;
    JOB_OPTION_EACH(row)
    {
        if (n == MAX_KEY || (key = job_option_key_in(row, pattern)) == NULL) continue;
        of[n] = row;
        allowed[n++] = key;
    }
    allowed[n] = NULL;
    status s = job_option_check_keys(f, allowed, r->fault, err);
    for (size_t i = 0; s == STATUS_OK && json_is_object(f->object) && i < n; i++) {
        struct error fault = {0};
        s = stop_or_keep(read_option(of[i], f, allowed[i], base, r, &fault), &fault, r, err);
    }
    return s;
}

/* ---- defaults ---- */

static status read_default(const struct job_option *row, void *base, struct reading *r, struct error *err)
{
    json_t *object = json_pack("{s:o?}", "default", json_loads(row->standard, JSON_DECODE_ANY, NULL));
    struct json_field f = {.object = object};
    if (object == NULL) return no_memory(err);
    status s = read_value(row, &f, "default", base, r, err);
    json_decref(object);
    return s;
}

static status put_default(const struct job_option *row, void *base, struct reading *r, struct error *err)
{
    base = base_of(row, base, r);
    void *target = (char *)base + row->at;
    if (!row->stored) return STATUS_OK;
    if (row->standard != NULL) return read_default(row, base, r, err);
    switch (row->kind) {
    case OPTION_NUMBER:
        if (!row->required) *(double *)target = NAN;
        break;
    case OPTION_NUMBERS:
    case OPTION_NUMBER_OR_LIST:
        for (size_t i = 0; i < row->n; i++) ((double *)target)[i] = NAN;
        break;
    case OPTION_BOOL_OR_LEFT_OUT:
        *(int *)target = -1;
        break;
    case OPTION_WORD:
        if (!row->required) snprintf(target, row->n, "%s", job_option_choice(row, 0));
        break;
    default:
        break;
    }
    return STATUS_OK;
}

/* Sets the defaults in a section, or in an element of a list, and in the sections inside it. Lists inside it are
 * skipped: their elements get defaults when they are read. */
static status default_section(const char *pattern, void *base, struct reading *r, struct error *err)
{
    size_t n = strlen(pattern);
    status s = STATUS_OK;
    JOB_OPTION_EACH(row)
    if (s == STATUS_OK && strncmp(row->path, pattern, n) == 0 && (n == 0 || row->path[n] == '.') &&
        strchr(row->path + n, '[') == NULL)
        s = put_default(row, base, r, err);
    return s;
}

status job_options_default(struct job_document *doc, struct error *err)
{
    struct reading r = {doc, job_document_sections(doc), NULL};
    return default_section("", doc, &r, err);
}

struct first_fault {
    struct reading *r;
    struct error *err;
    status outcome;
};

static void take_fault(void *context, const struct error *fault)
{
    struct first_fault *first = context;
    if (first->outcome == STATUS_OK) first->outcome = stop_or_keep(fault->code, fault, first->r, first->err);
}

static status check_consistency(struct reading *r, struct error *err)
{
    struct first_fault first = {r, err, STATUS_OK};
    job_consistency_check(&r->section, take_fault, &first);
    return first.outcome;
}

status job_options_read(const json_t *document, struct job_document *doc, struct job_fault_list *faults,
                        struct error *err)
{
    struct reading r = {doc, job_document_sections(doc), faults};
    const struct json_field root = {.object = document};
    const struct job_option *row = job_option_find("");
    const struct option_value whole = {.row = row, .value = document, .path = "", .section = &r.section};
    struct error fault = {0};
    status s = read_section(&root, row->path, doc, &r, err);
    if (s == STATUS_OK && n_fault(&r) == 0) s = stop_or_keep(row->check(&whole, &fault), &fault, &r, err);
    return s == STATUS_OK ? check_consistency(&r, err) : s;
}
