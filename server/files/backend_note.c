#include "server/files/backend_note.h"
#include "base/files/foreign_file.h"
#include "base/files/foreign_json.h"
#include "optimizer/job/job_folder.h"
#include "server/settings/job_paths.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct foreign_bounds note_bounds = {.file_bytes = 4096, .held_bytes = 32 << 10, .depth = 4};

static void take_text(const json_t *from, const char *key, char *out, size_t n_out)
{
    const char *text = json_string_value(json_object_get(from, key));
    snprintf(out, n_out, "%s", text == NULL ? "" : text);
}

void backend_note_read(const char *data, const char *job_id, struct backend_note *note)
{
    char folder[PATH_BYTES];
    json_t *j = NULL;
    *note = (struct backend_note){0};
    path_join(folder, data, "jobs", job_id, NULL);
    if (foreign_json_read(folder, JOB_FILE_BACKEND, &note_bounds, &j, NULL) != STATUS_OK) return;
    take_text(j, "backend", note->backend, sizeof note->backend);
    take_text(j, "id", note->id, sizeof note->id);
    take_text(j, "state", note->state, sizeof note->state);
    take_text(j, "reason", note->reason, sizeof note->reason);
    take_text(j, "nodes", note->nodes, sizeof note->nodes);
    take_text(j, "progress", note->progress, sizeof note->progress);
    note->attempt = json_integer_value(json_object_get(j, "attempt"));
    note->waits = json_is_true(json_object_get(j, "waits"));
    note->memory_bytes = json_integer_value(json_object_get(j, "memory_bytes"));
    note->least_memory_bytes = json_integer_value(json_object_get(j, "least_memory_bytes"));
    json_decref(j);
}

status backend_note_write(const char *data, const char *job_id, const struct backend_note *note, bool durable,
                          struct error *err)
{
    char path[PATH_BYTES];
    json_t *j = json_pack("{s:s,s:I,s:s,s:s,s:s,s:s,s:b,s:I,s:I,s:s}", "backend", note->backend, "attempt",
                          (json_int_t)note->attempt, "id", note->id, "state", note->state, "reason", note->reason,
                          "nodes", note->nodes, "waits", note->waits, "memory_bytes", (json_int_t)note->memory_bytes,
                          "least_memory_bytes", (json_int_t)note->least_memory_bytes, "progress", note->progress);
    char *text = json_dumps(j, JSON_COMPACT);
    json_decref(j);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot note where job %s runs: out of memory", job_id);
    path_join(path, data, "jobs", job_id, JOB_FILE_BACKEND, NULL);
    status s = foreign_file_replace(path, text, strlen(text), durable, err);
    free(text);
    return s;
}

json_t *backend_note_view(const char *data, const struct job_row *row, char *message, size_t n_message)
{
    struct backend_note note;
    message[0] = '\0';
    if (row->state != JOB_RUNNING) return json_null();
    backend_note_read(data, row->id, &note);
    if (note.backend[0] == '\0' || note.attempt != row->attempt) return json_null();
    if (note.waits && note.id[0] == '\0')
        snprintf(message, n_message, "is being submitted to Slurm");
    else if (note.waits)
        snprintf(message, n_message, "waits in Slurm: %s (job %s)", note.reason[0] ? note.reason : note.state, note.id);
    return json_pack("{s:s,s:o,s:s,s:s,s:s}", "name", note.backend, "id",
                     note.id[0] ? json_string(note.id) : json_null(), "state", note.state, "reason", note.reason,
                     "nodes", note.nodes);
}
