#include "server/workers/input_judge.h"
#include "base/clock.h"
#include "base/files/foreign_file.h"
#include "base/files/foreign_json.h"
#include "optimizer/job/job_folder.h"
#include "server/files/worker_words.h"
#include "server/jobs/job_change.h"
#include "server/settings/job_paths.h"
#include "server/workers/backends/worker_process.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_REPORT_BYTES = 4 << 20, TURN_LIMIT_S = 30, LOOK_US = 20000 };

static const struct foreign_bounds report_bounds = {
    .file_bytes = MAX_REPORT_BYTES, .held_bytes = 64 << 20, .depth = 16};

/* Takes one of the places for checks. There are as many places as workers. */
static status take_turn(struct job_service *v, struct job_refusal *refusal, struct error *err)
{
    const double give_up_s = clock_monotonic_s() + TURN_LIMIT_S;
    while (atomic_fetch_add(&v->n_judging, 1) >= (int)v->settings->workers) {
        atomic_fetch_sub(&v->n_judging, 1);
        if (clock_monotonic_s() > give_up_s || atomic_load(&v->stopping)) {
            refusal->code = "not_ready";
            return error_set(err, STATUS_CONFLICT, "the files of other jobs are being judged; try again in a minute");
        }
        usleep(LOOK_US);
    }
    return STATUS_OK;
}

/* Whether a worker holds or takes more than one may. Its report is memory, too, but none that it has mapped. */
static bool takes_too_much(const struct settings *set, pid_t pid, int report_fd)
{
    struct stat st;
    if (set->resident_limit_bytes > 0 && worker_memory_bytes(pid) > set->resident_limit_bytes) return true;
    if (set->thread_limit > 0 && worker_thread_count(pid) > set->thread_limit) return true;
    return fstat(report_fd, &st) == 0 && st.st_size > MAX_REPORT_BYTES;
}

/* Waits for the worker, and kills it when it holds or takes too much. STATUS_CONFLICT: it was killed. */
static status wait_for(const struct job_service *v, pid_t pid, int report_fd, struct worker_end *end,
                       struct job_refusal *refusal, struct error *err)
{
    const double give_up_s = clock_monotonic_s() + (double)v->settings->check_limit_s;
    status s = STATUS_OK;
    while (!worker_ended(pid, end)) {
        if (s == STATUS_OK && atomic_load(&v->stopping)) {
            refusal->code = "stopping";
            s = error_set(err, STATUS_CONFLICT, "the service is stopping; try again in a moment");
        } else if (s == STATUS_OK && clock_monotonic_s() > give_up_s) {
            refusal->code = "not_ready";
            s = error_set(err, STATUS_CONFLICT,
                          "the files could not be judged within %lld s (jobs.check_limit_s); the job can be started "
                          "without, its worker judges them too",
                          (long long)v->settings->check_limit_s);
        }
        if (s != STATUS_OK || takes_too_much(v->settings, pid, report_fd)) worker_signal(pid, SIGKILL);
        usleep(LOOK_US);
    }
    return s;
}

/* Returns the worker's report, or NULL when it is no JSON. */
static json_t *read_report(int fd)
{
    json_t *report = NULL;
    off_t n = lseek(fd, 0, SEEK_END);
    char *text = n > 0 && n <= MAX_REPORT_BYTES ? malloc((size_t)n) : NULL;
    if (text != NULL && pread(fd, text, (size_t)n, 0) == (ssize_t)n)
        foreign_json_parse(text, (size_t)n, &report_bounds, NULL, &report, NULL);
    free(text);
    return report;
}

/* Takes the folder of the inputs out of the text: users know their files by their names alone. */
static void shorten_detail(json_t *entry, const char *folder)
{
    static const char in[] = " in '", quote = '\'';
    const char *detail = json_string_value(json_object_get(entry, "detail"));
    const size_t n = strlen(folder);
    char *text = detail != NULL ? strdup(detail) : NULL;
    if (text == NULL) return;
    for (char *at = text; (at = strstr(at, folder)) != NULL;) {
        char *from = at, *after = at + n;
        if (*after == '/')
            after++;
        else if (*after == quote && at - text >= (ptrdiff_t)strlen(in) && strncmp(at - strlen(in), in, strlen(in)) == 0)
            from = at - strlen(in), after++;
        memmove(from, after, strlen(after) + 1);
        at = from;
    }
    json_object_set_new(entry, "detail", json_string(text));
    free(text);
}

static void shorten(const json_t *list, const char *folder)
{
    size_t i;
    json_t *entry;
    json_array_foreach(list, i, entry) shorten_detail(entry, folder);
}

/* A worker that its input has ended would end so again when the job runs. */
static json_t *report_of_death(const struct worker_end *end)
{
    const bool forbidden = end->by_signal && end->code == SIGSYS;
    char text[200];
    if (forbidden)
        snprintf(text, sizeof text, "a file made the program that read it do what no input may (a forbidden call)");
    else if (end->by_signal)
        snprintf(text, sizeof text, "the program that read the files was ended by signal %d (%s)", end->code,
                 strsignal(end->code));
    else
        snprintf(text, sizeof text, "the program that reads the files could not judge them (exit status %d)",
                 end->code);
    return json_pack("{s:b, s:[{s:s, s:s, s:s}], s:[], s:[], s:i}", "valid", 0, "errors", "code",
                     forbidden ? "forbidden_call" : "worker_lost", "field", "", "detail", text, "warnings", "files",
                     "n_file", 0);
}

/* Returns the API's form of a judgement, which is released. */
static json_t *finish(json_t *report, const char *folder)
{
    json_t *errors = json_object_get(report, "faults"), *warnings = json_object_get(report, "warnings"),
           *files = json_object_get(report, "files");
    shorten(errors, folder);
    shorten(warnings, folder);
    json_t *out =
        json_pack("{s:b, s:O, s:O, s:O, s:I}", "valid", json_array_size(errors) == 0, "errors", errors, "warnings",
                  warnings, "files", files, "n_file", json_integer_value(json_object_get(report, "n_file")));
    json_decref(report);
    return out;
}

static bool is_judgement(const json_t *report)
{
    return json_is_array(json_object_get(report, "faults")) && json_is_array(json_object_get(report, "warnings")) &&
           json_is_array(json_object_get(report, "files"));
}

static bool is_plan(const json_t *report)
{
    return json_is_object(json_object_get(report, "error")) || json_is_number(json_object_get(report, "cpu_s"));
}

/* Waits for a worker that writes a report. *report is NULL where it wrote none. */
static status ask(struct job_service *v, const struct worker_paths *paths, json_t **report, struct worker_end *end,
                  struct job_refusal *refusal, struct error *err)
{
    pid_t pid;
    status s = worker_launch(paths, v->settings, &pid, err);
    if (s == STATUS_OK) s = wait_for(v, pid, paths->report_fd, end, refusal, err);
    if (s == STATUS_OK) *report = read_report(paths->report_fd); /* a crash reports the file that was being read */
    return s;
}

static status judge(struct job_service *v, const char *job_id, int fd, json_t **report, struct job_refusal *refusal,
                    struct error *err)
{
    char job[PATH_BYTES], folder[PATH_BYTES], document[PATH_BYTES];
    struct worker_end end;
    json_t *found = NULL;
    path_join(job, v->settings->data, "jobs", job_id, NULL);
    path_join(folder, job, JOB_FOLDER_INPUT, NULL);
    path_join(document, job, JOB_FILE_DOCUMENT, NULL);
    const struct worker_paths paths = {
        .program = v->runner.program, .job_folder = folder, .document = document, .report_fd = fd};
    status s = ask(v, &paths, &found, &end, refusal, err);
    if (s == STATUS_OK) worker_words_of_check(found);
    const bool judged = s == STATUS_OK && is_judgement(found);
    if (!judged) json_decref(found);
    if (s != STATUS_OK) return s;
    *report = judged ? finish(found, folder) : report_of_death(&end);
    return *report != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot judge the files: out of memory");
}

/* A place for checks, and a file in memory for the report; the caller calls leave. *fd is -1 after an error. */
static status enter(struct job_service *v, const char *job_id, int *fd, struct job_row *row,
                    struct job_refusal *refusal, struct error *err)
{
    *fd = -1;
    status s = job_look(v, job_id, row, err);
    if (s == STATUS_OK && v->runner.program == NULL)
        s = error_set(err, STATUS_INTERNAL, "cannot read the files: there are no workers");
    if (s == STATUS_OK) s = take_turn(v, refusal, err);
    if (s != STATUS_OK) return s;
    *fd = memfd_create("report", MFD_CLOEXEC);
    if (*fd >= 0) return STATUS_OK;
    atomic_fetch_sub(&v->n_judging, 1);
    return error_set_errno(err, "cannot read the files");
}

static void leave(struct job_service *v, int fd)
{
    close(fd);
    atomic_fetch_sub(&v->n_judging, 1);
}

status input_judge(struct job_service *v, const char *job_id, json_t **report, struct job_refusal *refusal,
                   struct error *err)
{
    struct job_row row;
    int fd;
    status s = enter(v, job_id, &fd, &row, refusal, err);
    if (s != STATUS_OK) return s;
    s = judge(v, job_id, fd, report, refusal, err);
    leave(v, fd);
    return s;
}

/* ---- plans ---- */

static status unreadable(const json_t *report, const struct worker_end *end, const char *folder, struct error *err)
{
    json_t *entry = json_object(), *fault = json_object_get(report, "error");
    const char *field = json_string_value(json_object_get(fault, "field"));
    if (fault == NULL) {
        json_decref(entry);
        return error_set(err, STATUS_INVALID, "the program that reads the files ended %s %d",
                         end->by_signal ? "by signal" : "with status", end->code);
    }
    json_object_set(entry, "detail", json_object_get(fault, "text"));
    shorten_detail(entry, folder);
    const char *text = json_string_value(json_object_get(entry, "detail"));
    error_set_field(err, STATUS_INVALID, field != NULL ? field : "", "%s", text != NULL ? text : "");
    json_decref(entry);
    return STATUS_INVALID;
}

static status keep_plan(const char *job, json_t *plan, struct error *err)
{
    char path[PATH_BYTES];
    path_join(path, job, JOB_FILE_PLAN, NULL);
    char *text = json_dumps(plan, JSON_INDENT(1) | JSON_REAL_PRECISION(12));
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot plan the job: out of memory");
    status s = foreign_file_replace(path, text, strlen(text), true, err);
    free(text);
    return s;
}

/* Returns whether the job still is as it was planned. */
static bool is_same(const struct job_row *planned, const struct job_row *now)
{
    return now->state != JOB_RUNNING && now->state != JOB_SUCCEEDED && now->attempt == planned->attempt &&
           strcmp(now->document, planned->document) == 0;
}

/* A document that is replaced takes the plan with it, which must not come back later. */
static status keep_plan_of(struct job_service *v, const struct job_row *row, const char *job, json_t *plan,
                           struct error *err)
{
    struct job_row now = {0};
    job_change_begin(v, row->id, NULL);
    status s = job_get(v, row->id, &now, err);
    if (s == STATUS_OK && !is_same(row, &now))
        s = error_set(err, STATUS_CONFLICT, "the job has changed while it was planned; plan it again");
    if (s == STATUS_OK) s = keep_plan(job, plan, err);
    job_change_end(v);
    job_row_release(&now);
    return s;
}

static status plan_job(struct job_service *v, const struct job_row *row, int fd, json_t **plan,
                       struct job_refusal *refusal, struct error *err)
{
    char job[PATH_BYTES], folder[PATH_BYTES], speeds[PATH_BYTES];
    struct worker_end end;
    json_t *found = NULL;
    path_join(job, v->settings->data, "jobs", row->id, NULL);
    path_join(folder, job, JOB_FOLDER_INPUT, NULL);
    path_join(speeds, v->settings->data, "speeds.json", NULL);
    const struct worker_paths paths = {
        .program = v->runner.program, .job_folder = job, .speeds = speeds, .plan = true, .report_fd = fd};
    status s = ask(v, &paths, &found, &end, refusal, err);
    if (s == STATUS_OK) worker_words_of_plan(found);
    if (s == STATUS_OK && (!is_plan(found) || json_is_object(json_object_get(found, "error"))))
        s = unreadable(found, &end, folder, err);
    if (s == STATUS_OK) {
        json_object_del(found, "error");
        json_object_set_new(found, "planned_unix_s", json_real(clock_wall_s()));
        json_object_set_new(found, "attempt", json_integer((json_int_t)row->attempt));
        s = keep_plan_of(v, row, job, found, err);
    }
    if (s == STATUS_OK)
        *plan = found;
    else
        json_decref(found);
    return s;
}

status input_plan(struct job_service *v, const char *job_id, json_t **plan, struct job_refusal *refusal,
                  struct error *err)
{
    struct job_row row;
    int fd;
    status s = enter(v, job_id, &fd, &row, refusal, err);
    if (s != STATUS_OK) return s;
    job_row_release(&row);
    s = job_get(v, job_id, &row, err); /* as it is after the wait for a place */
    if (s == STATUS_OK && (row.state == JOB_RUNNING || row.state == JOB_SUCCEEDED))
        s = error_set(err, STATUS_CONFLICT, "a plan is made before a job runs, and this one %s",
                      row.state == JOB_RUNNING ? "runs" : "has succeeded");
    if (s == STATUS_OK) s = plan_job(v, &row, fd, plan, refusal, err);
    leave(v, fd);
    job_row_release(&row);
    return s;
}
