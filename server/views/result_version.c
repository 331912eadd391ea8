#include "server/views/result_version.h"
#include "base/files/durable.h"
#include "base/files/file_tree.h"
#include "base/files/foreign_file.h"
#include "base/files/foreign_json.h"
#include "optimizer/job/document/job_document.h"
#include "optimizer/job/job_folder.h"
#include "server/files/worker_words.h"
#include "server/settings/job_paths.h"
#include "server/views/result_files.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define VERSION_FILE "version.json"
enum { MOST_DIGITS = 9, MOST_LISTED = 4096 };

static const char *const summary_member[] = {"sample", "started_unix_s", "finished_unix_s", "verdict", NULL};
static const char *const inputs_member[] = {"inputs", NULL};
static const char *const status_member[] = {"verdict", "started_unix_s", NULL};
/* Of files that workers have written, or may have written since. A job may have some 20,000 inputs. */
static const struct foreign_bounds document_bounds = {JOB_MAX_DOCUMENT_BYTES, 48 << 20, 64, NULL},
                                   report_bounds = {64 << 20, 32 << 20, 64, inputs_member},
                                   status_bounds = {256 << 10, 1 << 20, 16, status_member},
                                   version_bounds = {16 << 20, 64 << 20, 64, NULL},
                                   summary_bounds = {16 << 20, 1 << 20, 64, summary_member};

/* A whole number without leading zeros, or 0. */
static int64_t parse_number(const char *text)
{
    int64_t n = 0;
    size_t length = strlen(text);
    if (length == 0 || length > MOST_DIGITS || text[0] == '0') return 0;
    for (size_t i = 0; i < length; i++) {
        if (text[i] < '0' || text[i] > '9') return 0;
        n = 10 * n + (text[i] - '0');
    }
    return n;
}

static void job_file_path(const struct job_service *v, const char *id, const char *a, const char *b,
                          char out[PATH_BYTES])
{
    path_join(out, v->settings->data, "jobs", id, a, b, NULL);
}

static bool has_result(const struct job_service *v, const char *id, const char *folder, struct stat *st)
{
    char path[PATH_BYTES], name[VERSION_FOLDER_BYTES + 16];
    int fd = -1;
    job_file_path(v, id, NULL, NULL, path);
    snprintf(name, sizeof name, "%s/result.json", folder);
    if (foreign_file_open(path, name, &fd, NULL, NULL) != STATUS_OK) return false;
    const bool known = fstat(fd, st) == 0;
    close(fd);
    return known;
}

/* A JSON object of a file in the job's folder; NULL if there is none. */
static json_t *read_object(const struct job_service *v, const char *id, const char *name,
                           const struct foreign_bounds *bounds)
{
    char folder[PATH_BYTES];
    json_t *j = NULL;
    job_file_path(v, id, NULL, NULL, folder);
    foreign_json_read(folder, name, bounds, &j, NULL);
    return j;
}

static int by_number(const void *a, const void *b)
{
    int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

/* Fills *number with the numbers of the kept versions, ascending, and room for one more; the caller frees it. */
static status kept_numbers(const struct job_service *v, const char *id, int64_t **number, size_t *n, struct error *err)
{
    char path[PATH_BYTES], folder[VERSION_FOLDER_BYTES];
    struct stat st;
    *n = 0;
    *number = calloc(MOST_LISTED + 1, sizeof **number);
    if (*number == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list versions: out of memory");
    job_file_path(v, id, JOB_FOLDER_VERSIONS, NULL, path);
    int fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0 && (errno == ENOENT || errno == ENOTDIR || errno == ELOOP)) return STATUS_OK;
    DIR *d = fd < 0 ? NULL : fdopendir(fd);
    if (d == NULL && fd >= 0) close(fd);
    if (d == NULL) return error_set_errno(err, "cannot list the versions of job '%s'", id);
    for (struct dirent *e; *n < MOST_LISTED && (e = readdir(d)) != NULL;) {
        int64_t k = parse_number(e->d_name);
        snprintf(folder, sizeof folder, JOB_FOLDER_VERSIONS "/%lld", (long long)k);
        if (k > 0 && has_result(v, id, folder, &st)) (*number)[(*n)++] = k;
    }
    closedir(d);
    qsort(*number, *n, sizeof **number, by_number);
    return STATUS_OK;
}

/* The input files of the run with their SHA-256, as the worker has noted them in its report; null without a report. */
static json_t *inputs_of_run(const struct job_service *v, const char *id)
{
    json_t *report = read_object(v, id, JOB_FOLDER_RESULTS "/report.json", &report_bounds),
           *inputs = json_object_get(report, "inputs");
    worker_words_of_inputs(inputs);
    inputs = json_is_array(inputs) ? json_incref(inputs) : json_null();
    json_decref(report);
    return inputs;
}

/* Returns the content of version.json, made from the job's folder. document: the document of the run. */
static json_t *describe(const struct job_service *v, const struct job_row *row, const char *document, bool with_inputs,
                        double finished_unix_s)
{
    json_t *doc = NULL, *st = read_object(v, row->id, JOB_FILE_STATUS, &status_bounds);
    foreign_json_parse(document, strlen(document), &document_bounds, NULL, &doc, NULL);
    const json_t *sample = json_object_get(doc, "sample");
    json_t *verdict = json_object_get(st, "verdict"), *started = json_object_get(st, "started_unix_s");
    json_t *out =
        json_pack("{s:I,s:s,s:O,s:f,s:O,s:o,s:o}", "version", (json_int_t)row->generation, "sample",
                  json_is_string(sample) ? json_string_value(sample) : "", "started_unix_s",
                  json_is_number(started) ? started : json_null(), "finished_unix_s", finished_unix_s, "verdict",
                  json_is_object(verdict) ? verdict : json_null(), "document", doc != NULL ? doc : json_object(),
                  "inputs", with_inputs ? inputs_of_run(v, row->id) : json_null());
    json_decref(st);
    return out;
}

/* The document that the result in JOB/results was made with; the caller frees it. */
static char *document_of_run(const struct job_service *v, const struct job_row *row)
{
    char folder[PATH_BYTES], *text = NULL;
    job_file_path(v, row->id, NULL, NULL, folder);
    if (row->dirty && foreign_file_read(folder, JOB_FILE_RUN, JOB_MAX_DOCUMENT_BYTES, &text, NULL, NULL) == STATUS_OK)
        return text;
    return strdup(row->document); /* no edit, or one of files only */
}

static double time_of(const struct stat *st) { return (double)st->st_mtim.tv_sec + 1e-9 * (double)st->st_mtim.tv_nsec; }

static json_t *describe_present(const struct job_service *v, const struct job_row *row, bool with_inputs,
                                const struct stat *st)
{
    char *document = document_of_run(v, row);
    json_t *out = document == NULL ? NULL : describe(v, row, document, with_inputs, time_of(st));
    free(document);
    return out;
}

/* Describes a version whose version.json is damaged: its files are still there. */
static json_t *describe_damaged(int64_t number, const struct stat *st)
{
    return json_pack("{s:I,s:s,s:n,s:f,s:n,s:{},s:n,s:b}", "version", (json_int_t)number, "sample", "",
                     "started_unix_s", "finished_unix_s", time_of(st), "verdict", "document", "inputs", "damaged", 1);
}

/* version.json, or the same for the present result. */
static json_t *read_description(struct job_service *v, const struct job_row *row, const char *folder, int64_t number,
                                bool full, const struct stat *st)
{
    char name[VERSION_FOLDER_BYTES + 16];
    if (strcmp(folder, JOB_FOLDER_RESULTS) == 0) return describe_present(v, row, full, st);
    snprintf(name, sizeof name, "%s/%s", folder, VERSION_FILE);
    json_t *j = read_object(v, row->id, name, full ? &version_bounds : &summary_bounds);
    json_t *started = json_object_get(j, "started_unix_s"), *verdict = json_object_get(j, "verdict");
    bool whole =
        json_is_string(json_object_get(j, "sample")) && json_is_number(json_object_get(j, "finished_unix_s")) &&
        (json_is_number(started) || json_is_null(started)) && (json_is_object(verdict) || json_is_null(verdict)) &&
        (!full || json_is_object(json_object_get(j, "document")));
    if (whole && !json_is_array(json_object_get(j, "inputs"))) json_object_set_new(j, "inputs", json_null());
    worker_words_of_inputs(json_object_get(j, "inputs"));
    if (whole) return j;
    json_decref(j);
    log_warning(v->log, "job %s: the description of version %lld is damaged", row->id, (long long)number);
    return describe_damaged(number, st);
}

/* The rename comes first, so a kill leaves no half of a version in the list. */
static status remove_version(const struct job_service *v, const char *id, int64_t number, struct error *err)
{
    char name[VERSION_FOLDER_BYTES], gone[VERSION_FOLDER_BYTES], from[PATH_BYTES], to[PATH_BYTES];
    snprintf(name, sizeof name, "%lld", (long long)number);
    snprintf(gone, sizeof gone, "%lld.removed", (long long)number);
    job_file_path(v, id, JOB_FOLDER_VERSIONS, name, from);
    job_file_path(v, id, JOB_FOLDER_VERSIONS, gone, to);
    status s = file_tree_remove(to, err);
    if (s == STATUS_OK && rename(from, to) != 0) s = error_set_errno(err, "cannot remove version %s", name);
    return s == STATUS_OK ? file_tree_remove(to, err) : s;
}

/* Writes version.json into the results and moves them. */
static status move(struct job_service *v, const struct job_row *row, const struct stat *st, struct error *err)
{
    char from[PATH_BYTES], to[PATH_BYTES], path[PATH_BYTES], name[VERSION_FOLDER_BYTES];
    json_t *about = describe_present(v, row, true, st);
    char *text = about == NULL ? NULL : json_dumps(about, JSON_INDENT(1));
    json_decref(about);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot keep the earlier result: out of memory");
    job_file_path(v, row->id, JOB_FOLDER_RESULTS, VERSION_FILE, path);
    status s = foreign_file_replace(path, text, strlen(text), true, err);
    free(text);
    job_file_path(v, row->id, JOB_FOLDER_VERSIONS, NULL, path);
    if (s == STATUS_OK) s = foreign_folder_clear(path, err);
    if (s == STATUS_OK) s = durable_make_folder(path, err);
    snprintf(name, sizeof name, "%lld", (long long)row->generation);
    job_file_path(v, row->id, JOB_FOLDER_RESULTS, NULL, from);
    job_file_path(v, row->id, JOB_FOLDER_VERSIONS, name, to);
    if (s == STATUS_OK && rename(from, to) != 0)
        s = error_set_errno(err, "cannot keep the earlier result of job '%s' as version %s", row->id, name);
    /* the job's folder is synced later, before an attempt may begin: attempt.json is replaced */
    return s == STATUS_OK ? durable_sync_folder_of(to, err) : s;
}

/* Notes how many bytes the versions of the job have, which count as its owner's. */
static status note_bytes(struct job_service *v, const struct job_row *row, struct error *err)
{
    char path[PATH_BYTES];
    job_file_path(v, row->id, JOB_FOLDER_VERSIONS, NULL, path);
    return store_job_version_bytes(v->store, row->id, disk_content_bytes(path), err);
}

status version_keep(struct job_service *v, struct job_row *row, struct error *err)
{
    struct stat st;
    int64_t *number = NULL, most = v->settings->keep_versions;
    size_t n = 0;
    status s = kept_numbers(v, row->id, &number, &n, err);
    if (s == STATUS_OK && most > 0 && has_result(v, row->id, JOB_FOLDER_RESULTS, &st)) {
        if (n > 0 && number[n - 1] >= row->generation) row->generation = number[n - 1] + 1;
        s = move(v, row, &st, err);
        if (s == STATUS_OK) number[n++] = row->generation;
        if (s == STATUS_OK)
            log_info(v->log, "job %s: its result is kept as version %lld", row->id, (long long)row->generation);
    }
    for (size_t i = 0; s == STATUS_OK && i < n && (int64_t)(n - i) > most; i++)
        s = remove_version(v, row->id, number[i], err);
    free(number);
    return s == STATUS_OK && n > 0 ? note_bytes(v, row, err) : s;
}

/* Where the result of run `number` is; "" if there is none. */
static void find_folder(const struct job_service *v, const struct job_row *row, int64_t number,
                        char out[VERSION_FOLDER_BYTES], struct stat *st)
{
    snprintf(out, VERSION_FOLDER_BYTES, JOB_FOLDER_VERSIONS "/%lld", (long long)number);
    if (number > 0 && has_result(v, row->id, out, st)) return;
    snprintf(out, VERSION_FOLDER_BYTES, JOB_FOLDER_RESULTS);
    if (number > 0 && number == row->generation && has_result(v, row->id, out, st)) return;
    out[0] = '\0';
}

static status read_version(struct job_service *v, const struct job_row *row, int64_t number, bool full, json_t **out,
                           struct error *err)
{
    char folder[VERSION_FOLDER_BYTES], url[128];
    struct stat st;
    struct result_file *file = NULL;
    size_t n = 0;
    int64_t n_bytes = 0;
    find_folder(v, row, number, folder, &st);
    if (folder[0] == '\0') return error_set(err, STATUS_NOT_FOUND, "the job has no version of this number");
    bool present = strcmp(folder, JOB_FOLDER_RESULTS) == 0;
    json_t *j = read_description(v, row, folder, number, full, &st);
    if (j == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot describe a version: out of memory");
    status s = result_list(v, row->id, folder, &file, &n, err);
    if (s == STATUS_TOO_LARGE) s = STATUS_OK; /* then those that are listed count */
    for (size_t i = 0; i < n; i++) n_bytes += file[i].size_bytes;
    snprintf(url, sizeof url, "/v1/jobs/%s/versions/%lld", row->id, (long long)number);
    json_object_set_new(j, "version", json_integer((json_int_t)number));
    json_object_set_new(j, "current", json_boolean(present && !row->dirty));
    json_object_set_new(j, "n_file", json_integer((json_int_t)n));
    json_object_set_new(j, "bytes", json_integer((json_int_t)n_bytes));
    json_object_set_new(j, "url", json_string(url));
    if (full)
        json_object_set_new(j, "files", result_files_json(file, n, url));
    else {
        json_object_del(j, "document");
        json_object_del(j, "inputs");
    }
    free(file);
    if (s == STATUS_OK)
        *out = j;
    else
        json_decref(j);
    return s;
}

status version_list(struct job_service *v, const struct job_row *row, json_t **view, struct error *err)
{
    int64_t *number = NULL;
    size_t n = 0;
    json_t *list = json_array(), *one;
    status s = kept_numbers(v, row->id, &number, &n, err);
    if (s == STATUS_OK && (n == 0 || number[n - 1] < row->generation)) number[n++] = row->generation;
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        s = read_version(v, row, number[i], false, &one, err);
        if (s == STATUS_OK) json_array_append_new(list, one);
        if (s == STATUS_NOT_FOUND) s = STATUS_OK; /* no result yet, or removed meanwhile */
    }
    free(number);
    if (s == STATUS_OK)
        *view = json_pack("{s:o}", "versions", list);
    else
        json_decref(list);
    return s;
}

status version_view(struct job_service *v, const struct job_row *row, const char *number, json_t **view,
                    struct error *err)
{
    return read_version(v, row, parse_number(number), true, view, err);
}

status version_open(struct job_service *v, const struct job_row *row, const char *number, const char *path, int *fd,
                    struct error *err)
{
    char folder[VERSION_FOLDER_BYTES];
    struct stat st;
    status s = STATUS_NOT_FOUND;
    for (int i = 0; i < 2 && s != STATUS_OK; i++) { /* again if the result has just become a version */
        find_folder(v, row, parse_number(number), folder, &st);
        if (folder[0] == '\0') return error_set(err, STATUS_NOT_FOUND, "the job has no version of this number");
        s = result_open(v, row->id, folder, path, fd, err);
    }
    return s;
}
