/* The folder of one job: document, inputs, journal, worker, series, results. */
#include "base/clock.h"
#include "base/files/durable.h"
#include "base/files/foreign_file.h"
#include "base/files/foreign_json.h"
#include "optimizer/job/document/job_document.h"
#include "optimizer/job/job_folder.h"
#include "server/doctor/doctor_report.h"
#include "server/rescue/input_evidence.h"
#include "server/settings/job_paths.h"
#include "server/store/job_journal.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { REPORT_BYTES = 1 << 20 };

static const struct foreign_bounds status_bounds = {.file_bytes = 256 << 10, .held_bytes = 1 << 20, .depth = 16},
                                   result_bounds = {.file_bytes = 64 << 20, .held_bytes = 256 << 20, .depth = 64};

struct patient {
    char folder[PATH_BYTES];
    char data[PATH_BYTES], id[STORE_ID_BYTES]; /* "": the folder does not lie in a data folder */
    bool at_work;                              /* a worker holds its lock */
};

/* Finds the folder. Of DATA/jobs/ID the journal and the inputs can be compared. */
static status find_folder(const struct doctor *d, const char *job, struct patient *p, struct error *err)
{
    char *full = NULL;
    struct stat st;
    if (id_valid(job))
        path_join(p->folder, d->settings->data, "jobs", job, NULL);
    else
        path_join(p->folder, job, NULL);
    full = realpath(p->folder, NULL);
    if (full == NULL || stat(full, &st) != 0 || !S_ISDIR(st.st_mode) || strlen(full) >= PATH_BYTES) {
        free(full);
        return error_set(err, STATUS_NOT_FOUND, "'%s' is neither the id of a job in '%s' nor a folder", job,
                         d->settings->data);
    }
    snprintf(p->folder, sizeof p->folder, "%s", full);
    snprintf(p->data, sizeof p->data, "%s", full);
    free(full);
    char *name = strrchr(p->data, '/');
    if (name != NULL && id_valid(name + 1)) {
        snprintf(p->id, sizeof p->id, "%.36s", name + 1);
        *name = '\0';
        name = strrchr(p->data, '/');
    }
    if (p->id[0] == '\0' || name == NULL || strcmp(name, "/jobs") != 0)
        p->id[0] = p->data[0] = '\0';
    else
        *name = '\0';
    return STATUS_OK;
}

/* The faults of document and inputs, as the worker finds them: {"faults": [{"field", "detail"}], ...}. */
static void examine_document(struct doctor *d, const struct patient *p)
{
    char program[PATH_BYTES], check[] = "--check", document[PATH_BYTES], input[PATH_BYTES];
    char *text = malloc(REPORT_BYTES);
    struct error err = {0};
    int code = 0;
    if (text == NULL) return;
    snprintf(program, sizeof program, "%s", d->worker);
    path_join(document, p->folder, JOB_FILE_DOCUMENT, NULL);
    path_join(input, p->folder, JOB_FOLDER_INPUT, NULL);
    char *argv[] = {program, check, document, input, NULL};
    status s = access(document, R_OK) != 0 ? error_set_errno(&err, "cannot read '%s'", document)
                                           : doctor_execute(argv, text, REPORT_BYTES, &code, &err);
    json_t *report = s == STATUS_OK ? json_loads(text, JSON_DISABLE_EOF_CHECK, NULL) : NULL, *fault;
    const json_t *list = json_object_get(report, "faults");
    size_t i;
    if (s != STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "document", "%s", err.text);
    else if (!json_is_array(list)) {
        text[strcspn(text, "\n")] = '\0';
        doctor_say(d, DOCTOR_FAULT, "document", "it could not be checked: %.300s", text);
    } else if (json_array_size(list) == 0)
        doctor_say(d, DOCTOR_OK, "document", "the worker can use it and all files that it names");
    json_array_foreach(list, i, fault)
        doctor_say(d, DOCTOR_FAULT, "document", "%s: %s", json_string_value(json_object_get(fault, "field")),
                   json_string_value(json_object_get(fault, "detail")));
    json_decref(report);
    free(text);
}

/* Compares the bytes of the inputs with the checksums of the journal. */
static void examine_inputs(struct doctor *d, const struct patient *p, struct job_journal *journal)
{
    char *document = NULL, *said = NULL;
    size_t n_said = 0, n_document = 0, n = 0, n_complete = 0;
    struct error err = {0};
    struct file_row *file = NULL;
    FILE *notes = open_memstream(&said, &n_said);
    if (notes == NULL || foreign_file_read(p->folder, JOB_FILE_DOCUMENT, JOB_MAX_DOCUMENT_BYTES, &document, &n_document,
                                           &err) != STATUS_OK)
        goto out;
    struct job_row job = journal->job;
    job.document = document;
    snprintf(job.id, sizeof job.id, "%s", p->id);
    const struct input_request q = {p->data, &job, journal, NULL, 0, notes};
    /* a document that cannot be parsed has been reported */
    if (input_evidence_read(&q, &file, &n, &n_complete, &err) != STATUS_OK) goto out;
    fflush(notes);
    for (char *at = said, *line; (line = strsep(&at, "\n")) != NULL;)
        if (line[strspn(line, " ")] != '\0')
            doctor_say(d, journal->job.state == JOB_DRAFT ? DOCTOR_NOTE : DOCTOR_FAULT, "inputs", "%s",
                       line + strspn(line, " "));
    if (n > 0 && n_complete == n) doctor_say(d, DOCTOR_OK, "inputs", "all %zu have the bytes that were sent", n);
out:
    if (notes != NULL) fclose(notes);
    free(said);
    free(document);
    free(file);
}

static void examine_journal(struct doctor *d, const struct patient *p)
{
    struct job_journal journal = {0};
    struct error err = {0};
    status s = job_journal_read(p->folder, &journal, &err);
    if (s != STATUS_OK)
        doctor_say(d, s == STATUS_NOT_FOUND ? DOCTOR_NOTE : DOCTOR_FAULT, "journal", "%s", err.text);
    else if (journal.n_damaged > 0)
        doctor_say(d, DOCTOR_NOTE, "journal", "%zu of its lines are damaged; the others say what a rebuild needs",
                   journal.n_damaged);
    else
        doctor_say(d, DOCTOR_OK, "journal", "job '%s' of %s, %s, attempt %lld%s", journal.job.sample,
                   journal.job.owner[0] != '\0' ? journal.job.owner : "no owner", job_state_name(journal.job.state),
                   (long long)journal.job.attempt, journal.job.deleted ? ", deleted" : "");
    if (s == STATUS_OK) examine_inputs(d, p, &journal);
    job_journal_release(&journal);
}

static bool lock_held(const struct patient *p)
{
    char path[PATH_BYTES];
    path_join(path, p->folder, JOB_FILE_LOCK, NULL);
    int fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    bool held = fd >= 0 && flock(fd, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (fd >= 0) close(fd);
    return held;
}

static json_t *read_object(const char *folder, const char *name, const struct foreign_bounds *bounds, struct error *err)
{
    json_t *j = NULL;
    if (foreign_json_read(folder, name, bounds, &j, err) == STATUS_FORMAT)
        error_prefix(err, STATUS_FORMAT, "'%s' is damaged", name);
    return j;
}

static void examine_results(struct doctor *d, const struct patient *p)
{
    struct error err = {0};
    json_t *result = read_object(p->folder, JOB_FOLDER_RESULTS "/result.json", &result_bounds, &err);
    if (result != NULL)
        doctor_say(d, DOCTOR_OK, "results", "result.json is whole");
    else
        doctor_say(d, DOCTOR_FAULT, "results", "the worker has succeeded, but %s; retry the job", err.text);
    json_decref(result);
}

/* Reports the last status of the worker, and whether it still runs. */
static void examine_worker(struct doctor *d, struct patient *p)
{
    struct error err = {0};
    json_t *said = read_object(p->folder, JOB_FILE_STATUS, &status_bounds, &err);
    const json_t *error = json_object_get(said, "error");
    const char *state = json_string_value(json_object_get(said, "state")),
               *stage = json_string_value(json_object_get(said, "stage"));
    double age_s = clock_wall_s() - json_number_value(json_object_get(said, "heartbeat_unix_s"));
    const bool running = state != NULL && strcmp(state, "running") == 0;
    p->at_work = p->at_work || lock_held(p); /* it may have begun since the doctor looked first */
    if (said == NULL && err.code == STATUS_NOT_FOUND)
        doctor_say(d, DOCTOR_OK, "worker", p->at_work ? "it is starting" : "none has run yet");
    else if (state == NULL)
        doctor_say(d, DOCTOR_FAULT, "worker", "%s", err.text[0] != '\0' ? err.text : "status.json has no state");
    else if (running && p->at_work)
        doctor_say(d, age_s > (double)d->settings->heartbeat_timeout_s ? DOCTOR_NOTE : DOCTOR_OK, "worker",
                   "it is at stage '%s'; its last word is %.0f s old", stage != NULL ? stage : "", age_s);
    else if (running)
        doctor_say(d, DOCTOR_NOTE, "worker",
                   "it ended within stage '%s' %.0f s ago without a word; the next attempt resumes",
                   stage != NULL ? stage : "", age_s);
    else if (strcmp(state, "failed") == 0)
        doctor_say(d, DOCTOR_NOTE, "worker", "it has failed: %s", json_string_value(json_object_get(error, "text")));
    else
        doctor_say(d, DOCTOR_OK, "worker", "it has ended: %s", state);
    if (state != NULL && strcmp(state, "succeeded") == 0) examine_results(d, p);
    json_decref(said);
}

static bool count(void *context, const char *json, size_t n_json)
{
    (void)json, (void)n_json;
    *(size_t *)context += 1;
    return true;
}

static void examine_series(struct doctor *d, const struct patient *p)
{
    char path[PATH_BYTES];
    struct stat st;
    size_t n = 0;
    uint64_t end = 0;
    struct error err = {0};
    path_join(path, p->folder, JOB_FILE_SERIES, NULL);
    status s = record_read(path, 0, count, &n, &end, &err);
    if (s == STATUS_NOT_FOUND) return;
    if (s != STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "series", "%s", err.text);
    else if (stat(path, &st) == 0 && (uint64_t)st.st_size > end && !p->at_work)
        doctor_say(d, DOCTOR_NOTE, "series",
                   "%zu records, and %llu bytes behind them that are none; the next attempt "
                   "removes them",
                   n, (unsigned long long)((uint64_t)st.st_size - end));
    else
        doctor_say(d, DOCTOR_OK, "series", "%zu records", n);
}

static void examine_stages(struct doctor *d, const struct patient *p)
{
    char path[PATH_BYTES], done[400] = "";
    path_join(path, p->folder, JOB_FOLDER_WORK, NULL);
    DIR *folder = opendir(path);
    for (struct dirent *e; folder != NULL && (e = readdir(folder)) != NULL;) {
        size_t n = strlen(e->d_name), used = strlen(done);
        if (n > 5 && strcmp(e->d_name + n - 5, ".done") == 0)
            snprintf(done + used, sizeof done - used, "%s%.*s", used > 0 ? ", " : "", (int)(n - 5), e->d_name);
    }
    if (folder != NULL) closedir(folder);
    if (done[0] != '\0') doctor_say(d, DOCTOR_OK, "checkpoints", "of the stages %s", done);
}

status doctor_examine_job(struct doctor *d, const char *job, struct error *err)
{
    struct patient p = {.id = ""};
    struct stat st;
    status s = find_folder(d, job, &p, err);
    if (s != STATUS_OK) return s;
    if (stat(p.folder, &st) == 0 && (st.st_mode & (S_IWGRP | S_IWOTH)) != 0)
        doctor_say(d, DOCTOR_FAULT, "folder", "other users may write into it; forbid it with: chmod go-w '%s'",
                   p.folder);
    else
        doctor_say(d, DOCTOR_OK, "folder", "'%s'", p.folder);
    p.at_work = lock_held(&p);
    examine_document(d, &p);
    if (p.id[0] != '\0') examine_journal(d, &p);
    examine_worker(d, &p);
    examine_series(d, &p);
    examine_stages(d, &p);
    return STATUS_OK;
}
