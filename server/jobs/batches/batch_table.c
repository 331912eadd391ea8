#include "server/jobs/batches/batch_table.h"
#include "base/json/document_path.h"
#include "optimizer/job/job_document.h"
#include "server/jobs/job_access.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FAULT_MOST = 100 };

void batch_table_release(struct batch_table *t)
{
    for (size_t i = 0; t->sample != NULL && i < t->n; i++) {
        free(t->sample[i].document);
        free(t->sample[i].file);
    }
    free(t->sample);
    free(t->template_text);
    *t = (struct batch_table){0};
}

/* Refuses members that are not among the names between spaces. */
static status check_members(const json_t *object, const char *known, struct error *err)
{
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)(uintptr_t)object, key, value)
    {
        const char *at = strchr(key, ' ') == NULL ? strstr(known, key) : NULL;
        if (key[0] == '\0' || at == NULL || at[-1] != ' ' || at[strlen(key)] != ' ')
            return error_set_field(err, STATUS_INVALID, key, "there is no member '%.60s' here", key);
    }
    return STATUS_OK;
}

static int by_name(const void *a, const void *b)
{
    const struct file_row *x = a, *y = b;
    return strcmp(x->name, y->name);
}

static status read_file(struct job_service *v, const json_t *j, struct file_row *file, struct error *err)
{
    const char *name = json_string_value(json_object_get(j, "name")),
               *sum = json_string_value(json_object_get(j, "sha256"));
    const json_t *size = json_object_get(j, "size");
    if (!json_is_object(j)) return error_set_field(err, STATUS_INVALID, "files", "a file must be an object");
    status s = check_members(j, " name size sha256 ", err);
    if (s != STATUS_OK) return s;
    if (name == NULL || strlen(name) >= sizeof file->name)
        return error_set_field(err, STATUS_INVALID, "files.name", "a file needs a name of at most 127 characters");
    if (!json_is_integer(size))
        return error_set_field(err, STATUS_INVALID, "files.size", "file '%s' needs its size in bytes", name);
    if (sum == NULL || strlen(sum) != 64)
        return error_set_field(err, STATUS_INVALID, "files.sha256",
                               "file '%s' needs its sha256: by it a changed file is noticed", name);
    snprintf(file->name, sizeof file->name, "%s", name);
    snprintf(file->sha256, sizeof file->sha256, "%s", sum);
    snprintf(file->role, sizeof file->role, "volume"); /* until the document has said it */
    file->size_bytes = json_integer_value(size);
    return job_check_declaration(v, file, err);
}

/* What a document says of the files of its sample. */
struct visit {
    struct batch_sample *sample;
    bool *named;
    char missing[128];
};

static void visit_file(void *context, const char *name, const char *role)
{
    struct visit *visit = context;
    struct file_row key = {0}, *found;
    snprintf(key.name, sizeof key.name, "%s", name);
    found = visit->sample->n_file == 0 ? NULL
                                       : bsearch(&key, visit->sample->file, visit->sample->n_file, sizeof key, by_name);
    if (found == NULL) {
        if (visit->missing[0] == '\0') snprintf(visit->missing, sizeof visit->missing, "%s", name);
        return;
    }
    snprintf(found->role, sizeof found->role, "%s", role);
    visit->named[found - visit->sample->file] = true;
}

/* Every file that the document names is in the row, and the other way round. */
static status match_files(struct batch_sample *sample, const struct job_document *doc, struct error *err)
{
    struct visit visit = {.sample = sample, .named = calloc(sample->n_file + 1, sizeof(bool))};
    status s = STATUS_OK;
    if (visit.named == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the batch: out of memory");
    job_document_visit_files(doc, visit_file, &visit);
    if (visit.missing[0] != '\0')
        s = error_set_field(err, STATUS_INVALID, "files", "its document names file '%s', which its row does not have",
                            visit.missing);
    for (size_t i = 0; s == STATUS_OK && i < sample->n_file; i++)
        if (!visit.named[i])
            s = error_set_field(err, STATUS_INVALID, "files", "its row has file '%s', which its document does not name",
                                sample->file[i].name);
    free(visit.named);
    return s;
}

static status read_files(struct job_service *v, const json_t *list, struct batch_sample *sample, struct error *err)
{
    size_t n = json_array_size(list);
    if (list != NULL && !json_is_array(list))
        return error_set_field(err, STATUS_INVALID, "files", "'files' must be a list");
    if ((int64_t)n > v->settings->max_files_per_job)
        return error_set_field(err, STATUS_INVALID, "files", "a sample may have at most %lld files",
                               (long long)v->settings->max_files_per_job);
    sample->file = calloc(n + 1, sizeof *sample->file);
    if (sample->file == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the batch: out of memory");
    status s = STATUS_OK;
    for (size_t i = 0; s == STATUS_OK && i < n; i++)
        s = read_file(v, json_array_get(list, i), &sample->file[sample->n_file++], err);
    if (s == STATUS_OK && n > 1) qsort(sample->file, n, sizeof *sample->file, by_name);
    for (size_t i = 1; s == STATUS_OK && i < n; i++)
        if (by_name(&sample->file[i - 1], &sample->file[i]) == 0)
            s = error_set_field(err, STATUS_INVALID, "files", "file '%s' is there twice", sample->file[i].name);
    return s;
}

static status make_document(const json_t *template_, const json_t *row, struct batch_sample *sample, struct error *err)
{
    json_t *document = json_deep_copy(template_);
    const json_t *replace = json_object_get(row, "replace");
    const char *path;
    json_t *value;
    status s = STATUS_OK;
    if (replace != NULL && !json_is_object(replace))
        s = error_set_field(err, STATUS_INVALID, "replace", "'replace' must be an object");
    json_object_set_new(document, "sample", json_string(sample->sample));
    json_object_foreach((json_t *)(uintptr_t)replace, path, value)
    {
        if (s == STATUS_OK && (strcmp(path, "sample") == 0 || strcmp(path, "/sample") == 0))
            s = error_set(err, STATUS_INVALID, "the name of the sample is the member 'sample' of its row");
        if (s == STATUS_OK) s = document_replace(document, path, value, err);
        if (s == STATUS_INVALID && err->field[0] == '\0')
            snprintf(err->field, sizeof err->field, "replace.%.100s", path);
    }
    sample->document = json_dumps(document, JSON_COMPACT);
    json_decref(document);
    if (s == STATUS_OK && sample->document == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot read the batch: out of memory");
    return s;
}

static status read_sample(struct job_service *v, const json_t *template_, const json_t *row,
                          struct batch_sample *sample, struct error *err)
{
    struct job_document *doc = NULL;
    const char *name = json_string_value(json_object_get(row, "sample"));
    if (!json_is_object(row)) return error_set(err, STATUS_INVALID, "a row must be an object");
    status s = check_members(row, " sample replace files ", err);
    if (s == STATUS_OK && (name == NULL || name[0] == '\0' || strlen(name) >= sizeof sample->sample))
        s = error_set_field(err, STATUS_INVALID, "sample", "a row needs the name of its sample, of at most 255 bytes");
    if (s != STATUS_OK) return s;
    snprintf(sample->sample, sizeof sample->sample, "%s", name);
    s = make_document(template_, row, sample, err);
    if (s == STATUS_OK) s = read_files(v, json_object_get(row, "files"), sample, err);
    if (s != STATUS_OK) return s;
    const char *text = sample->document;
    if ((int64_t)strlen(text) > v->settings->max_document_bytes)
        s = error_set(err, STATUS_INVALID, "its document has more than %lld bytes",
                      (long long)v->settings->max_document_bytes);
    if (s == STATUS_OK) s = job_document_parse(text, strlen(text), &doc, err);
    if (s == STATUS_OK) s = match_files(sample, doc, err);
    job_document_free(doc);
    return s;
}

/* Reads all rows, and notes the first fault of each that has one. */
static status read_rows(struct job_service *v, const json_t *template_, const json_t *rows, struct batch_table *t,
                        json_t *faults, struct error *err)
{
    json_t *seen = json_object();
    status first = STATUS_OK;
    size_t n_bytes = 0;
    for (size_t i = 0; i < json_array_size(rows); i++) {
        struct error one = {0}, said = {0};
        struct batch_sample *sample = &t->sample[t->n++];
        status s = read_sample(v, template_, json_array_get(rows, i), sample, &one);
        if (s == STATUS_OK && json_object_get(seen, sample->sample) != NULL)
            s = error_set_field(&one, STATUS_INVALID, "sample", "there are two rows with this name");
        json_object_set_new(seen, sample->sample, json_true());
        n_bytes += sample->document == NULL ? 0 : strlen(sample->document);
        if (s == STATUS_OK && n_bytes > BATCH_TEXT_MOST_BYTES)
            s = error_set(&one, STATUS_INVALID, "the documents of all rows have more than %d MiB together",
                          BATCH_TEXT_MOST_BYTES >> 20);
        if (s == STATUS_OK) continue;
        char field[200];
        snprintf(field, sizeof field, "samples[%zu]%s%.140s", i, one.field[0] != '\0' ? "." : "", one.field);
        error_set_field(&said, STATUS_INVALID, field, "sample '%.80s': %s", sample->sample, one.text);
        if (json_array_size(faults) < FAULT_MOST)
            json_array_append_new(faults,
                                  json_pack("{s:s,s:s,s:s}", "code", "invalid", "field", field, "detail", said.text));
        if (first == STATUS_OK) *err = said;
        first = STATUS_INVALID;
        if (n_bytes > BATCH_TEXT_MOST_BYTES) break;
    }
    json_decref(seen);
    return first;
}

status batch_table_read(struct job_service *v, const json_t *body, struct batch_table *t, json_t **faults,
                        struct error *err)
{
    *t = (struct batch_table){0};
    *faults = NULL;
    if (!json_is_object(body)) return error_set(err, STATUS_INVALID, "the body must be an object");
    const json_t *template_ = json_object_get(body, "template"), *rows = json_object_get(body, "samples"),
                 *update = json_object_get(body, "update");
    const char *name = json_string_value(json_object_get(body, "name"));
    status s = check_members(body, " name template samples update ", err);
    if (s != STATUS_OK) return s;
    if (name == NULL || name[0] == '\0' || strlen(name) >= sizeof t->name)
        return error_set_field(err, STATUS_INVALID, "name", "a batch needs a name of at most 255 bytes");
    if (!json_is_object(template_))
        return error_set_field(err, STATUS_INVALID, "template", "'template' must be a job document");
    if (!json_is_array(rows) || json_array_size(rows) == 0 || json_array_size(rows) > BATCH_SAMPLE_MOST)
        return error_set_field(err, STATUS_INVALID, "samples", "'samples' must be a list of 1 to %d rows",
                               (int)BATCH_SAMPLE_MOST);
    if (update != NULL && !json_is_boolean(update))
        return error_set_field(err, STATUS_INVALID, "update", "'update' must be true or false");
    snprintf(t->name, sizeof t->name, "%s", name);
    t->update = json_is_true(update);
    t->template_text = json_dumps(template_, JSON_COMPACT);
    t->sample = calloc(json_array_size(rows), sizeof *t->sample);
    if (t->template_text == NULL || t->sample == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot read the batch: out of memory");
    *faults = json_array();
    return read_rows(v, template_, rows, t, *faults, err);
}
