#include "clients/cli/batch/sample_outcome.h"
#include "base/clock.h"
#include "base/files/durable.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_ROOM = 4096, STATE_BYTES = 1 << 16 };
static const char *const state_name[] = {"new", "submitted", "succeeded", "failed"};
enum { N_STATE = sizeof state_name / sizeof *state_name };

static void join(char out[PATH_ROOM], const char *folder, const char *name)
{
    snprintf(out, PATH_ROOM, "%s/%s", folder, name);
}

void sample_outcome_read(const char *folder, struct sample_outcome *o)
{
    char path[PATH_ROOM], *text = NULL;
    size_t n = 0;
    *o = (struct sample_outcome){.state = SAMPLE_NEW};
    join(path, folder, "state.json");
    if (file_read_all(path, STATE_BYTES, &text, &n, NULL) != STATUS_OK) return;
    json_t *j = json_loadb(text, n, 0, NULL);
    const char *state = json_string_value(json_object_get(j, "state")),
               *job = json_string_value(json_object_get(j, "job")),
               *fingerprint = json_string_value(json_object_get(j, "fingerprint"));
    for (int i = 0; state != NULL && i < N_STATE; i++)
        if (strcmp(state, state_name[i]) == 0) o->state = (enum sample_state)i;
    snprintf(o->job_id, sizeof o->job_id, "%s", job == NULL ? "" : job);
    snprintf(o->fingerprint, sizeof o->fingerprint, "%s", fingerprint == NULL ? "" : fingerprint);
    if (o->state == SAMPLE_SUBMITTED && o->job_id[0] == '\0') o->state = SAMPLE_NEW;
    json_decref(j);
    free(text);
}

/* Other users of the share may read these files, as far as the umask allows. */
static status write_text(const char *folder, const char *name, const char *text, struct error *err)
{
    char path[PATH_ROOM];
    join(path, folder, name);
    status s = durable_replace(path, text, strlen(text), err);
    mode_t mask = umask(0);
    umask(mask);
    if (s == STATUS_OK && chmod(path, 0666 & ~mask) != 0 && errno != EPERM && errno != ENOTSUP)
        s = error_set_errno(err, "cannot set the permissions of '%s'", path);
    return s;
}

/* A link could lead the results to another place. */
static status make_folder(const char *folder, struct error *err)
{
    struct stat st;
    if (mkdir(folder, 0777) != 0 && errno != EEXIST) return error_set_errno(err, "cannot make the folder '%s'", folder);
    if (lstat(folder, &st) != 0) return error_set_errno(err, "cannot examine '%s'", folder);
    return S_ISDIR(st.st_mode) ? STATUS_OK
                               : error_set(err, STATUS_INVALID, "'%s' is in the way: it is not a folder", folder);
}

status sample_outcome_write(const char *folder, const struct sample_outcome *o, const char *reason, struct error *err)
{
    char path[PATH_ROOM];
    status s = make_folder(folder, err);
    if (s == STATUS_OK && reason != NULL) s = write_text(folder, "reason.txt", reason, err);
    if (s != STATUS_OK) return s;
    json_t *j =
        json_pack("{s:s,s:s,s:s}", "state", state_name[o->state], "job", o->job_id, "fingerprint", o->fingerprint);
    char *text = j == NULL ? NULL : json_dumps(j, JSON_INDENT(1));
    json_decref(j);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the state of a sample: out of memory");
    s = write_text(folder, "state.json", text, err);
    free(text);
    join(path, folder, "reason.txt");
    if (s == STATUS_OK && reason == NULL && unlink(path) != 0 && errno != ENOENT)
        s = error_set_errno(err, "cannot remove '%s'", path);
    return s;
}

status sample_results_retire(const char *folder, struct error *err)
{
    char from[PATH_ROOM], to[PATH_ROOM], name[64];
    join(from, folder, "results");
    snprintf(name, sizeof name, "results-%.3f", clock_wall_s());
    join(to, folder, name);
    if (rename(from, to) != 0 && errno != ENOENT) return error_set_errno(err, "cannot move '%s' out of the way", from);
    /* files left by an interrupted download of the earlier job must not mix with files of the next */
    join(from, folder, "results.part");
    snprintf(name, sizeof name, "results-%.3f.part", clock_wall_s());
    join(to, folder, name);
    if (rename(from, to) == 0 || errno == ENOENT) return STATUS_OK;
    return error_set_errno(err, "cannot move '%s' out of the way", from);
}

status sample_results_fetch(struct cli *cli, const char *folder, const char *job_id, struct error *err)
{
    char whole[PATH_ROOM], part[PATH_ROOM];
    struct stat st;
    join(whole, folder, "results");
    join(part, folder, "results.part");
    if (lstat(whole, &st) == 0) return STATUS_OK; /* it is complete, but the state was not written any more */
    status s = make_folder(part, err);
    if (s == STATUS_OK) s = cli_results_of(cli, job_id, part, err);
    if (s == STATUS_OK && rename(part, whole) != 0) s = error_set_errno(err, "cannot write '%s'", whole);
    return s == STATUS_OK ? durable_sync_folder_of(whole, err) : s;
}

status sample_log_fetch(struct cli *cli, const char *folder, const char *job_id, struct error *err)
{
    char path[256];
    struct http_reply reply;
    status s = cli_job_path(job_id, "/log?offset=-65536&max_bytes=65536", path, sizeof path, err);
    if (s != STATUS_OK) return s;
    s = http_call(cli->http, "GET", path, NULL, NULL, 0, &reply, err);
    if (s == STATUS_OK && reply.code == 200)
        s = write_text(folder, "log.txt", reply.body == NULL ? "" : reply.body, err);
    http_reply_release(&reply);
    return s;
}
