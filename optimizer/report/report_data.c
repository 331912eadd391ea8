#include "base/clock.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/job_outline.h"
#include "optimizer/job/options/option_json.h"
#include "optimizer/report/report_page.h"
#include "optimizer/report/result/result_json.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { CHUNK_BYTES = 1 << 20, SERIES_LIMIT_BYTES = 256 << 20, SERIES_HEAD = 9 /* checksum and blank */ };

/* SHA-256 of a file as text; "" when it cannot be read or the job is cancelled. */
static void hash_file(const struct report *report, const char *path, char text[crypto_hash_sha256_BYTES * 2 + 1])
{
    unsigned char digest[crypto_hash_sha256_BYTES], *chunk = malloc(CHUNK_BYTES);
    crypto_hash_sha256_state hash;
    ssize_t n = -1;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    text[0] = '\0';
    crypto_hash_sha256_init(&hash);
    while (fd >= 0 && chunk != NULL && !progress_cancelled(&report->in.job->tools->progress)) {
        n = read(fd, chunk, CHUNK_BYTES);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        crypto_hash_sha256_update(&hash, chunk, (unsigned long long)n);
    }
    crypto_hash_sha256_final(&hash, digest);
    if (n == 0) sodium_bin2hex(text, crypto_hash_sha256_BYTES * 2 + 1, digest, sizeof digest);
    if (fd >= 0) close(fd);
    free(chunk);
}

struct input_list {
    const struct report *pipeline;
    json_t *list;
};

static void add_input(void *context, const char *name, const char *role)
{
    struct input_list *input = context;
    char path[WORKER_PATH_BYTES], hash[crypto_hash_sha256_BYTES * 2 + 1];
    struct stat file = {0};
    worker_folder_path(input->pipeline->in.job->tools->folder, JOB_FOLDER_INPUT, name, path);
    if (stat(path, &file) != 0) return;
    hash_file(input->pipeline, path, hash);
    json_array_append_new(input->list, json_pack("{s:s, s:s, s:I, s:o}", "name", name, "role", role, "size",
                                                 (json_int_t)file.st_size, "sha256",
                                                 hash[0] != '\0' ? json_string(hash) : json_null()));
}

/* The part of a record of series.rec that the page shows. */
static json_t *curve_point(const json_t *record)
{
    static const char *const key[] = {"model", "step", "model_step", "objective", "objective_se", "n_path_total"};
    json_t *point = json_object();
    for (size_t k = 0; k < sizeof key / sizeof key[0]; k++) {
        json_t *value = json_object_get(record, key[k]);
        json_object_set_new(point, key[k], value != NULL ? json_incref(value) : json_null());
    }
    return point;
}

static json_t *curve_json(const struct report *report)
{
    char path[WORKER_PATH_BYTES], *text = NULL;
    json_t *list = json_array();
    worker_folder_path(report->in.job->tools->folder, JOB_FILE_SERIES, NULL, path);
    if (file_read_all(path, SERIES_LIMIT_BYTES, &text, NULL, NULL) != STATUS_OK) return list;
    for (char *line = text, *end; *line != '\0'; line = *end != '\0' ? end + 1 : end) {
        end = line + strcspn(line, "\n");
        json_t *record = end - line > SERIES_HEAD
                             ? json_loadb(line + SERIES_HEAD, (size_t)(end - line) - SERIES_HEAD, 0, NULL)
                             : NULL;
        if (record != NULL) json_array_append_new(list, curve_point(record));
        json_decref(record);
    }
    free(text);
    return list;
}

status report_data(struct report *report, json_t **data, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct input_list input = {report, json_array()};
    for (size_t i = 0; i < report->in.files->n_file; i++)
        add_input(&input, report->in.files->file[i].name, report->in.files->file[i].role);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "result.json", path);
    json_t *result = json_load_file(path, 0, NULL);
    worker_folder_path(report->in.job->tools->folder, JOB_FILE_DOCUMENT, NULL, path);
    json_t *document = json_load_file(path, 0, NULL);
    *data = json_pack("{s:i, s:s, s:f, s:f, s:o, s:o?, s:o, s:o, s:o?}", "format", 1, "program", RESULT_PROGRAM,
                      "started_unix_s", worker_status_started_unix_s(report->in.job->tools->status), "written_unix_s",
                      clock_wall_s(), "defaults", job_options_defaults_json(document, report->in.kind == JOB_OF_FIT),
                      "document", document, "inputs", input.list, "curve", curve_json(report), "result", result);
    return *data != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot write the report: out of memory");
}
