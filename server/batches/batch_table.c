#include "server/batches/batch_table.h"
#include "base/files/document_path.h"
#include "base/files/json_depth.h"
#include "optimizer/job/job_outline.h"
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

/* The files that a document names for its sample. */
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
static status match_files(struct batch_sample *sample, const struct job_outline *outline, struct error *err)
{
    struct visit visit = {.sample = sample, .named = calloc(sample->n_file + 1, sizeof(bool))};
    status s = STATUS_OK;
    if (visit.named == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the batch: out of memory");
    for (size_t i = 0; i < outline->n_file; i++) visit_file(&visit, outline->file[i].name, outline->file[i].role);
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

/* The state of a table while it is read. */
struct reading {
    struct job_service *v;
    const json_t *template_, *rows;
    struct batch_table *table;
    json_t **document; /* one for each row; members that the row does not replace are shared with the template */
    json_t *names;     /* of the samples so far */
    size_t n_bytes;    /* of the texts of all documents so far */
};

/* The name and the files of a row. */
static status read_head(struct reading *r, size_t i, struct error *err)
{
    const json_t *row = json_array_get(r->rows, i), *replace = json_object_get(row, "replace");
    struct batch_sample *sample = &r->table->sample[i];
    const char *name = json_string_value(json_object_get(row, "sample"));
    if (!json_is_object(row)) return error_set(err, STATUS_INVALID, "a row must be an object");
    status s = check_members(row, " sample replace files ", err);
    if (s != STATUS_OK) return s;
    if (name == NULL || name[0] == '\0' || strlen(name) >= sizeof sample->sample)
        return error_set_field(err, STATUS_INVALID, "sample",
                               "a row needs the name of its sample, of at most 255 bytes");
    snprintf(sample->sample, sizeof sample->sample, "%s", name);
    if (json_object_get(r->names, name) != NULL)
        return error_set_field(err, STATUS_INVALID, "sample", "there are two rows with this name");
    json_object_set_new(r->names, name, json_true());
    if (replace != NULL && !json_is_object(replace))
        return error_set_field(err, STATUS_INVALID, "replace", "'replace' must be an object");
    return read_files(r->v, json_object_get(row, "files"), sample, err);
}

static status replace_members(json_t *document, const json_t *replace, struct error *err)
{
    const char *path;
    json_t *value;
    json_object_foreach((json_t *)(uintptr_t)replace, path, value)
    {
        status s = strcmp(path, "sample") == 0 || strcmp(path, "/sample") == 0
                       ? error_set(err, STATUS_INVALID, "the name of the sample is the member 'sample' of its row")
                       : document_replace(document, path, value, err);
        if (s == STATUS_OK) continue;
        if (s == STATUS_INVALID) snprintf(err->field, sizeof err->field, "replace.%.100s", path);
        return s;
    }
    return STATUS_OK;
}

/* The document of a row, and its text. */
static status make_document(struct reading *r, size_t i, struct error *err)
{
    struct batch_sample *sample = &r->table->sample[i];
    json_t *document = r->document[i] = json_copy((json_t *)(uintptr_t)r->template_);
    json_object_set_new(document, "sample", json_string(sample->sample));
    status s = replace_members(document, json_object_get(json_array_get(r->rows, i), "replace"), err);
    if (s != STATUS_OK) return s;
    sample->document = json_dumps(document, JSON_COMPACT);
    if (sample->document == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the batch: out of memory");
    size_t n = strlen(sample->document);
    r->n_bytes += n;
    if ((int64_t)n > r->v->settings->max_document_bytes)
        return error_set(err, STATUS_INVALID, "its document has more than %lld bytes",
                         (long long)r->v->settings->max_document_bytes);
    if (r->n_bytes > BATCH_TEXT_MOST_BYTES)
        return error_set(err, STATUS_INVALID, "the documents of all rows have more than %d MiB together",
                         BATCH_TEXT_MOST_BYTES >> 20);
    return json_depth_check(sample->document, n, "its document", err);
}

/* Whether the document is one of a job, with the files of the row. */
static status check_document(struct reading *r, size_t i, struct error *err)
{
    struct job_outline outline = {.n_file = 0};
    status s = job_outline_take(r->document[i], &outline, err);
    if (s == STATUS_OK) s = match_files(&r->table->sample[i], &outline, err);
    job_outline_release(&outline);
    return s;
}

static void note_fault(const struct reading *r, size_t i, const struct error *one, json_t *faults, struct error *said)
{
    char field[200];
    snprintf(field, sizeof field, "samples[%zu]%s%.140s", i, one->field[0] != '\0' ? "." : "", one->field);
    error_set_field(said, STATUS_INVALID, field, "sample '%.80s': %s", r->table->sample[i].sample, one->text);
    json_array_append_new(faults, json_pack("{s:s,s:s,s:s}", "code", "invalid", "field", field, "detail", said->text));
}

/* Reads all rows in passes, the cheapest first. A pass that finds faults notes the first one of each row, up to
 * FAULT_MOST rows, and is the last. */
static status read_rows(struct reading *r, json_t *faults, struct error *err)
{
    status (*const pass[])(struct reading *, size_t, struct error *) = {read_head, make_document, check_document};
    for (size_t p = 0; p < sizeof pass / sizeof pass[0]; p++) {
        for (size_t i = 0; i < r->table->n && json_array_size(faults) < FAULT_MOST; i++) {
            struct error one = {0}, said = {0};
            status s = pass[p](r, i, &one);
            if (s == STATUS_OK) continue;
            if (s == STATUS_NO_MEMORY) {
                *err = one;
                return s;
            }
            note_fault(r, i, &one, faults, &said);
            if (json_array_size(faults) == 1) *err = said;
            if (r->n_bytes > BATCH_TEXT_MOST_BYTES) break;
        }
        if (json_array_size(faults) > 0) return STATUS_INVALID;
    }
    return STATUS_OK;
}

static status read_samples(struct job_service *v, const json_t *template_, const json_t *rows, struct batch_table *t,
                           json_t *faults, struct error *err)
{
    struct reading r = {.v = v, .template_ = template_, .rows = rows, .table = t};
    t->n = json_array_size(rows);
    t->sample = calloc(t->n, sizeof *t->sample);
    r.document = calloc(t->n, sizeof *r.document);
    r.names = json_object();
    status s = t->sample == NULL || r.document == NULL || r.names == NULL
                   ? error_set(err, STATUS_NO_MEMORY, "cannot read the batch: out of memory")
                   : read_rows(&r, faults, err);
    for (size_t i = 0; r.document != NULL && i < t->n; i++) json_decref(r.document[i]);
    free(r.document);
    json_decref(r.names);
    return s;
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
    if (t->template_text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the batch: out of memory");
    *faults = json_array();
    return read_samples(v, template_, rows, t, *faults, err);
}
