#include "clients/cli/batch/batch_rows.h"
#include "base/files/document_path.h"
#include "clients/cli/batch/sample_files.h"
#include "clients/cli/text/csv_table.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { PATH_ROOM = 4096 };

void batch_rows_release(struct batch_rows *rows)
{
    for (size_t i = 0; i < rows->n; i++) {
        free(rows->row[i].sample);
        json_decref(rows->row[i].replace);
        cli_job_files_release(&rows->row[i].list);
    }
    free(rows->row);
    *rows = (struct batch_rows){0};
}

static bool is_folder(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

/* Members of the top level that a document has in place of the template's. */
static json_t *replacements(const json_t *template_, const json_t *document)
{
    json_t *out = json_object(), *value;
    const char *key;
    char path[256];
    json_object_foreach((json_t *)(uintptr_t)document, key, value)
    {
        if (strcmp(key, "sample") == 0 || json_equal(json_object_get(template_, key), value)) continue;
        size_t n = (size_t)snprintf(path, sizeof path, "/");
        for (const char *c = key; *c != '\0' && n + 3 < sizeof path; c++)
            n += (size_t)snprintf(path + n, sizeof path - n, *c == '~' ? "~0" : *c == '/' ? "~1" : "%c", *c);
        json_object_set(out, path, value);
    }
    return out;
}

/* Adds a sample with its document. own: its files lie in `folder`, which is its own, so a '*' stands for them. */
static status add_row(const char *name, const char *folder, bool own, json_t *document, const json_t *template_,
                      struct batch_rows *rows, struct error *err)
{
    struct sample_files files = {0};
    json_t *whole = NULL;
    struct batch_row *more = realloc(rows->row, (rows->n + 1) * sizeof *more);
    if (more == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the batch: out of memory");
    rows->row = more;
    struct batch_row *row = &more[rows->n++];
    *row = (struct batch_row){.sample = strdup(name)};
    if (row->sample == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the batch: out of memory");
    status s = own ? sample_files_list(folder, "", &files, err) : STATUS_OK;
    if (s == STATUS_OK && own && sample_files_have(&files, SAMPLE_DOCUMENT))
        s = error_set(err, STATUS_INVALID,
                      "'%s' has a " SAMPLE_DOCUMENT " of its own, but all samples of a batch have one template",
                      folder);
    if (s == STATUS_OK && own) s = sample_document(folder, name, &files, document, &whole, err);
    if (s == STATUS_OK && !own) whole = json_incref(document);
    if (s == STATUS_OK) s = cli_job_files_list(whole, folder, &row->list, err);
    if (s == STATUS_OK) row->replace = replacements(template_, whole);
    sample_files_release(&files);
    json_decref(whole);
    return s == STATUS_OK ? s : error_prefix(err, s, "sample '%s'", name);
}

/* The value of a cell: JSON where it is that, else a text. */
static json_t *value_of(const json_t *cell)
{
    json_t *value = json_loads(json_string_value(cell), JSON_DECODE_ANY | JSON_REJECT_DUPLICATES, NULL);
    return value != NULL ? value : json_incref((json_t *)(uintptr_t)cell);
}

static status read_row(const json_t *head, const json_t *line, size_t i_line, size_t i_sample, json_t *document,
                       struct error *err)
{
    status s = STATUS_OK;
    if (json_array_size(line) != json_array_size(head))
        return error_set(err, STATUS_INVALID, "row %zu has %zu cells, but the first line names %zu columns", i_line,
                         json_array_size(line), json_array_size(head));
    for (size_t k = 0; s == STATUS_OK && k < json_array_size(head); k++) {
        const json_t *cell = json_array_get(line, k);
        if (k == i_sample || json_string_length(cell) == 0) continue;
        json_t *value = value_of(cell);
        s = document_replace(document, json_string_value(json_array_get(head, k)), value, err);
        json_decref(value);
    }
    return s == STATUS_OK ? s : error_prefix(err, s, "row %zu", i_line);
}

static status read_lines(const json_t *lines, const char *files, const json_t *template_, struct batch_rows *rows,
                         struct error *err)
{
    const json_t *head = json_array_get(lines, 0);
    size_t i_sample = 0, n = json_array_size(head);
    while (i_sample < n && strcmp(json_string_value(json_array_get(head, i_sample)), "sample") != 0) i_sample++;
    if (i_sample == n)
        return error_set(err, STATUS_INVALID,
                         "the first line names no column 'sample'; it must name the columns, with commas between them");
    status s = STATUS_OK;
    for (size_t i = 1; s == STATUS_OK && i < json_array_size(lines); i++) {
        char folder[PATH_ROOM];
        const json_t *line = json_array_get(lines, i);
        json_t *document = json_deep_copy(template_);
        s = read_row(head, line, i, i_sample, document, err);
        const char *name = s == STATUS_OK ? json_string_value(json_array_get(line, i_sample)) : "";
        snprintf(folder, sizeof folder, "%s/%s", files, name);
        const bool own = name[0] != '\0' && strcmp(name, "..") != 0 && strcmp(name, ".") != 0 &&
                         strchr(name, '/') == NULL && is_folder(folder);
        if (s == STATUS_OK) s = add_row(name, own ? folder : files, own, document, template_, rows, err);
        json_decref(document);
    }
    if (s == STATUS_OK && rows->n == 0) s = error_set(err, STATUS_INVALID, "there is no row below the first line");
    return s;
}

status batch_rows_of_table(const char *path, const char *files, const json_t *template_, struct batch_rows *rows,
                           struct error *err)
{
    json_t *lines = NULL;
    *rows = (struct batch_rows){0};
    status s = csv_table_read(path, &lines, err);
    if (s != STATUS_OK) return s;
    s = read_lines(lines, files, template_, rows, err);
    json_decref(lines);
    return s == STATUS_OK ? s : error_prefix(err, s, "table '%s'", path);
}

static int visible(const struct dirent *e)
{
    size_t n = strlen(e->d_name), n_tail = strlen(".selvedge");
    /* a folder that watch-folder keeps beside a sample is none */
    return e->d_name[0] != '.' && !(n > n_tail && strcmp(e->d_name + n - n_tail, ".selvedge") == 0);
}

status batch_rows_of_folder(const char *folder, const json_t *template_, struct batch_rows *rows, struct error *err)
{
    struct dirent **entry = NULL;
    *rows = (struct batch_rows){0};
    int n = scandir(folder, &entry, visible, alphasort);
    if (n < 0) return error_set_errno(err, "cannot read the folder '%s'", folder);
    status s = STATUS_OK;
    for (int i = 0; i < n; i++) {
        char path[PATH_ROOM];
        snprintf(path, sizeof path, "%s/%s", folder, entry[i]->d_name);
        json_t *document = s == STATUS_OK && is_folder(path) ? json_deep_copy(template_) : NULL;
        if (document != NULL) s = add_row(entry[i]->d_name, path, true, document, template_, rows, err);
        json_decref(document);
        free(entry[i]);
    }
    free(entry);
    if (s == STATUS_OK && rows->n == 0) s = error_set(err, STATUS_NOT_FOUND, "'%s' has no folder of a sample", folder);
    return s;
}
