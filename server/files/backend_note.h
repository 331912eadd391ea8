/* JOB/backend.json: the state of a job at an engine other than the daemon. By this file the next daemon finds the job
 * again, and any daemon on the same store can show where it is. */
#ifndef SELVEDGE_SERVER_BACKEND_NOTE_H
#define SELVEDGE_SERVER_BACKEND_NOTE_H

#include "base/status.h"
#include "server/store/store.h"

#include <jansson.h>

struct backend_note {
    char backend[16]; /* its name */
    int64_t attempt;
    char id[24]; /* the engine's name of this attempt; "": not yet */
    char state[24], reason[80], nodes[80];
    bool waits;                 /* the worker does not compute at present */
    int64_t memory_bytes;       /* asked for in this attempt */
    int64_t least_memory_bytes; /* an attempt with less has run out of it */
    char progress[48];          /* progress at the last interruption of an attempt */
};

/* All zero when there is no such file. */
void backend_note_read(const char *data, const char *job_id, struct backend_note *note);
/* durable: returns once the file is on disk. */
status backend_note_write(const char *data, const char *job_id, const struct backend_note *note, bool durable,
                          struct error *err);

/* {"name", "id", "state", "reason", "nodes"} of a job that runs, or null. message: a sentence in place of the worker's
 * while that does not compute; else "". */
json_t *backend_note_view(const char *data, const struct job_row *row, char *message, size_t n_message);

#endif
