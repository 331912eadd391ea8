/* selvedge watch-folder DIR: every sample folder that is put into DIR becomes one job. The steps of a sample repeat
 * harmlessly: its job is found by a key of its content, and state.json is written before the next step. So the watcher,
 * the daemon and the machine may be killed at any time. The folder is polled, because network shares send no events. */
#include "base/clock.h"
#include "base/files/json_text.h"
#include "clients/cli/batch/sample_outcome.h"
#include "clients/cli/text/cli_text.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_ROOM = 4096, NAME_ROOM = 256, QUIET_USUAL_S = 60, AGAIN_S = 10, LOOK_S = 1 };

struct sample {
    char name[NAME_ROOM];
    struct sample_outcome outcome;
    char seen[SAMPLE_FINGERPRINT_BYTES]; /* fingerprint of the last look */
    double since_s;                      /* monotonic time of the first look that saw it */
    double again_s;                      /* no step before this time, after a failure that may pass */
    char etag[160];                      /* of the job, when it was seen last */
    char shown[512];                     /* the last line that was printed about it */
    bool there;
};

struct folder_watch {
    struct cli *cli;
    const char *folder, *marker;
    double quiet_s; /* 0: only markers count */
    json_t *template;
    struct sample *sample;
    size_t n;
    int lock_fd;
};

static void report(struct folder_watch *w, struct sample *s, const char *text)
{
    char clean[sizeof s->shown];
    text_clean(text, clean, sizeof clean);
    if (strcmp(clean, s->shown) == 0) return;
    snprintf(s->shown, sizeof s->shown, "%s", clean);
    fprintf(w->cli->note, "%s: %s\n", s->name, clean);
    fflush(w->cli->note);
}

static void sample_path(const struct folder_watch *w, const struct sample *s, const char *suffix, char out[PATH_ROOM])
{
    snprintf(out, PATH_ROOM, "%s/%s%s", w->folder, s->name, suffix);
}

static status keep(struct folder_watch *w, struct sample *s, enum sample_state state, const char *reason,
                   struct error *err)
{
    char path[PATH_ROOM];
    sample_path(w, s, SAMPLE_OUTCOME_SUFFIX, path);
    s->outcome.state = state;
    return sample_outcome_write(path, &s->outcome, reason, err);
}

/* Ends a sample without results. Its reason is a sentence for the person who has put it there. */
static status give_up(struct folder_watch *w, struct sample *s, const char *why, struct error *err)
{
    char text[2048];
    snprintf(text, sizeof text,
             "Sample '%s' has no results.\n\n%s\n\n%s%s%sRepair the sample, and it is tried again by itself.\n",
             s->name, why, s->outcome.job_id[0] ? "Its job on the server: " : "", s->outcome.job_id,
             s->outcome.job_id[0] ? "\n" : "");
    report(w, s, why);
    return keep(w, s, SAMPLE_FAILED, text, err);
}

/* Returns whether the sample is the cause of a failure, so that trying again without a change is of no use. */
static bool is_final(status s)
{
    return s == STATUS_INVALID || s == STATUS_FORMAT || s == STATUS_TOO_LARGE || s == STATUS_NOT_FOUND ||
           s == STATUS_UNSUPPORTED;
}

struct unchanged {
    const char *folder, *marker, *fingerprint;
};

static bool is_unchanged(void *context)
{
    const struct unchanged *u = context;
    struct sample_files files;
    if (sample_files_list(u->folder, u->marker, &files, NULL) != STATUS_OK) return false;
    bool same = strcmp(files.fingerprint, u->fingerprint) == 0;
    sample_files_release(&files);
    return same;
}

static status submit(struct folder_watch *w, struct sample *s, const struct sample_files *files, struct error *err)
{
    char folder[PATH_ROOM], outcome[PATH_ROOM];
    json_t *document = NULL;
    sample_path(w, s, "", folder);
    sample_path(w, s, SAMPLE_OUTCOME_SUFFIX, outcome);
    struct unchanged same = {folder, w->marker, files->fingerprint};
    s->outcome.job_id[0] = '\0';
    snprintf(s->outcome.fingerprint, sizeof s->outcome.fingerprint, "%s", files->fingerprint);
    report(w, s, "complete");
    status r = keep(w, s, SAMPLE_NEW, NULL, err); /* first, because without a place for results nothing need be sent */
    if (r != STATUS_OK) return r;
    r = sample_document(folder, s->name, files, w->template, &document, err);
    if (r == STATUS_OK) r = cli_submit_once(w->cli, document, folder, is_unchanged, &same, s->outcome.job_id, err);
    json_decref(document);
    if (r == STATUS_OK) r = sample_results_retire(outcome, err);
    if (r == STATUS_OK) r = keep(w, s, SAMPLE_SUBMITTED, NULL, err);
    if (r == STATUS_OK) report(w, s, "submitted");
    return is_final(r) ? give_up(w, s, err->text, err) : r;
}

/* A sample that is new, or failed and may have been repaired. */
static status look(struct folder_watch *w, struct sample *s, struct error *err)
{
    char folder[PATH_ROOM];
    struct sample_files files;
    double now = clock_monotonic_s();
    sample_path(w, s, "", folder);
    status r = sample_files_list(folder, w->marker, &files, err);
    if (r != STATUS_OK) return r;
    if (strcmp(files.fingerprint, s->seen) != 0) {
        snprintf(s->seen, sizeof s->seen, "%s", files.fingerprint);
        s->since_s = now;
    }
    bool known = s->outcome.state == SAMPLE_FAILED && strcmp(files.fingerprint, s->outcome.fingerprint) == 0;
    bool quiet = w->quiet_s > 0 && files.n > 0 && now - s->since_s >= w->quiet_s;
    if (!known && (files.marked || quiet)) r = submit(w, s, &files, err);
    sample_files_release(&files);
    return r;
}

static status take_end(struct folder_watch *w, struct sample *s, const json_t *job, struct error *err)
{
    char outcome[PATH_ROOM], why[1600];
    const char *state = json_string_value(json_object_get(job, "state"));
    const json_t *problem = json_object_get(job, "error");
    const char *text = json_string_value(json_object_get(problem, "text")),
               *field = json_string_value(json_object_get(problem, "field"));
    sample_path(w, s, SAMPLE_OUTCOME_SUFFIX, outcome);
    if (state == NULL) return error_set(err, STATUS_FORMAT, "the server's reply has no state");
    if (strcmp(state, "succeeded") == 0) {
        status r = sample_results_fetch(w->cli, outcome, s->outcome.job_id, err);
        if (is_final(r)) return give_up(w, s, err->text, err);
        if (r == STATUS_OK) r = keep(w, s, SAMPLE_SUCCEEDED, NULL, err);
        if (r == STATUS_OK) report(w, s, "succeeded");
        return r;
    }
    if (strcmp(state, "cancelled") == 0) return give_up(w, s, "The job was cancelled.", err);
    if (strcmp(state, "draft") == 0)
        return give_up(w, s, "The job was changed on the server and not started again.", err);
    if (strcmp(state, "failed") != 0) return STATUS_OK;
    status r = sample_log_fetch(w->cli, outcome, s->outcome.job_id, err);
    snprintf(why, sizeof why, "The job failed: %s%s%s", field == NULL ? "" : field,
             field != NULL && field[0] ? ": " : "", text == NULL ? "the server gives no reason" : text);
    return r == STATUS_OK ? give_up(w, s, why, err) : r;
}

static status follow(struct folder_watch *w, struct sample *s, struct error *err)
{
    char path[256], line[200];
    const char *header[2] = {line, NULL};
    struct http_reply reply;
    status r = cli_job_path(s->outcome.job_id, "", path, sizeof path, err);
    if (r != STATUS_OK) return give_up(w, s, "state.json has no usable job id.", err);
    snprintf(line, sizeof line, "If-None-Match: %s", s->etag[0] ? s->etag : "\"none\"");
    r = http_call(w->cli->http, "GET", path, header, NULL, 0, &reply, err);
    if (r != STATUS_OK || reply.code == 304) goto out;
    if (reply.code == 404) {
        r = give_up(w, s, "The job was deleted on the server.", err);
    } else if (reply.code != 200) {
        r = http_problem(&reply, err);
    } else {
        json_t *job = json_loadb(reply.body, reply.n_body, 0, NULL);
        r = take_end(w, s, job, err);
        if (r == STATUS_OK) snprintf(s->etag, sizeof s->etag, "%s", reply.etag); /* else the end is taken again */
        json_decref(job);
    }
out:
    http_reply_release(&reply);
    return r;
}

/* Whether a link or a file has the name of the folder for the outcome. A link could lead it elsewhere. */
static bool is_blocked(const struct folder_watch *w, const struct sample *s)
{
    char path[PATH_ROOM];
    struct stat st;
    sample_path(w, s, SAMPLE_OUTCOME_SUFFIX, path);
    return lstat(path, &st) == 0 && !S_ISDIR(st.st_mode);
}

static status step(struct folder_watch *w, struct sample *s, struct error *err)
{
    char path[PATH_ROOM];
    if (clock_monotonic_s() < s->again_s) return STATUS_OK;
    if (is_blocked(w, s))
        return error_set(err, STATUS_INVALID, "'%s" SAMPLE_OUTCOME_SUFFIX "' is in the way: it is not a folder",
                         s->name);
    if (s->outcome.state == SAMPLE_SUBMITTED) return follow(w, s, err);
    sample_path(w, s, SAMPLE_OUTCOME_SUFFIX "/state.json", path);
    if (s->outcome.state != SAMPLE_NEW && access(path, F_OK) != 0 && errno == ENOENT) {
        /* the outcome was removed: the sample is treated as a new one */
        s->outcome = (struct sample_outcome){.state = SAMPLE_NEW};
        s->seen[0] = s->shown[0] = '\0';
    }
    return s->outcome.state == SAMPLE_SUCCEEDED ? STATUS_OK : look(w, s, err);
}

/* ---- the folder ---- */

static struct sample *find(struct folder_watch *w, const char *name)
{
    for (size_t i = 0; i < w->n; i++)
        if (strcmp(w->sample[i].name, name) == 0) return &w->sample[i];
    return NULL;
}

static struct sample *add(struct folder_watch *w, const char *name)
{
    char path[PATH_ROOM];
    struct sample *more = realloc(w->sample, (w->n + 1) * sizeof *more);
    if (more == NULL) return NULL;
    w->sample = more;
    struct sample *s = &w->sample[w->n++];
    memset(s, 0, sizeof *s);
    snprintf(s->name, sizeof s->name, "%s", name);
    sample_path(w, s, SAMPLE_OUTCOME_SUFFIX, path);
    sample_outcome_read(path, &s->outcome);
    return s;
}

static bool is_sample(int folder_fd, const char *name)
{
    struct stat st;
    size_t n = strlen(name), n_suffix = sizeof SAMPLE_OUTCOME_SUFFIX - 1;
    if (name[0] == '.' || n + n_suffix >= NAME_ROOM) return false;
    if (n > n_suffix && strcmp(name + n - n_suffix, SAMPLE_OUTCOME_SUFFIX) == 0) return false;
    return fstatat(folder_fd, name, &st, AT_SYMLINK_NOFOLLOW) == 0 && S_ISDIR(st.st_mode);
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct sample *)a)->name, ((const struct sample *)b)->name);
}

static status list_samples(struct folder_watch *w, struct error *err)
{
    DIR *d = opendir(w->folder);
    if (d == NULL) return error_set_errno(err, "cannot read the folder '%s'", w->folder);
    size_t n_before = w->n;
    for (size_t i = 0; i < w->n; i++) w->sample[i].there = false;
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        if (!is_sample(dirfd(d), e->d_name)) continue;
        struct sample *s = find(w, e->d_name);
        if (s == NULL) s = add(w, e->d_name);
        if (s != NULL) s->there = true;
    }
    closedir(d);
    /* a folder that is gone is forgotten, so that another one of its name is looked at afresh */
    size_t n = 0;
    for (size_t i = 0; i < w->n; i++)
        if (w->sample[i].there) w->sample[n++] = w->sample[i];
    w->n = n;
    if (n > n_before) qsort(w->sample, n, sizeof *w->sample, by_name);
    return STATUS_OK;
}

/* One look at every sample. A failure of one is reported and keeps none of the others from its step. */
static status look_at_all(struct folder_watch *w, struct error *err)
{
    status r = list_samples(w, err);
    if (r != STATUS_OK) return r;
    for (size_t i = 0; i < w->n && !http_stopped(w->cli->http); i++) {
        struct error why = {0};
        status s = step(w, &w->sample[i], &why);
        if (s == STATUS_OK || s == STATUS_CANCELLED) continue;
        report(w, &w->sample[i], why.text);
        w->sample[i].again_s = clock_monotonic_s() + AGAIN_S;
    }
    return STATUS_OK;
}

static bool all_ended(const struct folder_watch *w, int *exit_code)
{
    bool ended = true;
    *exit_code = CLI_EXIT_OK;
    for (size_t i = 0; i < w->n; i++) {
        enum sample_state s = w->sample[i].outcome.state;
        const bool failed = s == SAMPLE_FAILED || is_blocked(w, &w->sample[i]);
        if (failed) *exit_code = CLI_EXIT_ERROR;
        ended = ended && (failed || s == SAMPLE_SUCCEEDED);
    }
    return ended;
}

/* Two watchers would do no harm, but send everything twice. Some network shares cannot lock. */
static status lock(struct folder_watch *w, struct error *err)
{
    char path[PATH_ROOM];
    snprintf(path, sizeof path, "%s/.selvedge-lock", w->folder);
    w->lock_fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (w->lock_fd < 0) return error_set_errno(err, "cannot write into the folder '%s'", w->folder);
    if (flock(w->lock_fd, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return STATUS_OK;
    return error_set(err, STATUS_CONFLICT, "the folder '%s' is watched by another process", w->folder);
}

static status read_options(struct folder_watch *w, struct error *err)
{
    const struct cli_args *a = w->cli->args;
    struct error fault = {0};
    char what[4200];
    char *end = NULL;
    w->folder = a->operand;
    w->marker = a->marker != NULL ? a->marker : "READY";
    w->quiet_s = a->quiet_s != NULL ? strtod(a->quiet_s, &end) : QUIET_USUAL_S;
    if (a->quiet_s != NULL && (*end != '\0' || !(w->quiet_s >= 0 && w->quiet_s <= 86400)))
        return error_set(err, STATUS_INVALID, "option '--quiet' takes seconds from 0 to 86400: '%s'", a->quiet_s);
    if (a->template == NULL) return STATUS_OK;
    snprintf(what, sizeof what, "the template '%s'", a->template);
    w->template = json_text_file(a->template, what, &fault);
    if (w->template == NULL) return error_set(err, fault.code, "%s", fault.text);
    if (json_is_object(w->template)) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "%s is not a job document, which is a JSON object", what);
}

CLI_COMMAND(WATCH_FOLDER, cli_watch_folder, .place = 150, .name = "watch-folder", .operand = "DIR", .needs = "a folder",
            .options = "template marker quiet once",
            .summary = "make a job of every sample folder that is put into DIR",
            .text = "A sample folder NAME is complete when it has the marker file, or has not changed for the quiet "
                    "time. It becomes\n"
                    "a job by its job.json or by the template; results, or the reason why there are none, are then in "
                    "NAME.selvedge\n"
                    "beside it. Runs until it is stopped; what is known is on disk, so it may be killed at any time.\n")

status cli_watch_folder(struct cli *cli, int *exit_code, struct error *err)
{
    struct folder_watch w = {.cli = cli, .lock_fd = -1};
    struct error why = {0};
    status s = read_options(&w, err);
    if (s == STATUS_OK) s = lock(&w, err);
    if (s == STATUS_OK) fprintf(cli->note, "watching '%s' for samples\n", w.folder);
    while (s == STATUS_OK && !http_stopped(cli->http)) {
        status seen = look_at_all(&w, &why);
        if (seen != STATUS_OK) fprintf(cli->note, "%s\n", why.text); /* a share may be away for a while */
        if (seen == STATUS_OK && cli->args->once && all_ended(&w, exit_code)) break;
        http_sleep(cli->http, seen == STATUS_OK ? LOOK_S : AGAIN_S);
    }
    if (w.lock_fd >= 0) close(w.lock_fd);
    json_decref(w.template);
    free(w.sample);
    return s;
}
