#include "server/rescue/worker_evidence.h"
#include "base/clock.h"
#include "base/files/foreign_json.h"
#include "optimizer/job/job_folder.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

static const struct foreign_bounds small_bounds = {.file_bytes = 256 << 10, .held_bytes = 1 << 20, .depth = 16},
                                   result_bounds = {.file_bytes = 64 << 20, .held_bytes = 256 << 20, .depth = 64};

/* Reads a file of a job as a JSON object; NULL if it is none. */
static json_t *read_object(const char *folder, const char *name, const struct foreign_bounds *bounds)
{
    json_t *j = NULL;
    foreign_json_read(folder, name, bounds, &j, NULL);
    return j;
}

static void set_error(struct job_row *row, const char *code, const char *field, const char *text)
{
    snprintf(row->error_code, sizeof row->error_code, "%s", code == NULL ? "internal" : code);
    snprintf(row->error_field, sizeof row->error_field, "%s", field == NULL ? "" : field);
    snprintf(row->error_text, sizeof row->error_text, "%s", text);
}

/* Takes over the end of the attempt that the row says is running, or that began after the row was written. */
static void apply_status(const json_t *said, bool bare, struct job_row *row)
{
    const char *state = json_string_value(json_object_get(said, "state"));
    int64_t attempt = json_integer_value(json_object_get(said, "attempt"));
    bool newer = attempt > row->attempt, same = attempt == row->attempt && row->state == JOB_RUNNING;
    if (state == NULL || row->deleted || !(bare || newer || same)) return;
    if (newer) row->attempt = attempt;
    const json_t *e = json_object_get(said, "error");
    const char *text = json_string_value(json_object_get(e, "text"));
    if (strcmp(state, "succeeded") == 0)
        row->state = JOB_SUCCEEDED;
    else if (strcmp(state, "failed") == 0 && text != NULL) {
        row->state = JOB_FAILED;
        set_error(row, json_string_value(json_object_get(e, "code")), json_string_value(json_object_get(e, "field")),
                  text);
    } else if (strcmp(state, "cancelled") == 0 && (bare || row->cancel_requested))
        row->state = JOB_CANCELLED;
    else
        row->state = JOB_RUNNING;
    if (row->state != JOB_RUNNING) row->finished_unix_s = json_number_value(json_object_get(said, "heartbeat_unix_s"));
}

void worker_evidence_apply(const char *folder, bool bare, bool resume, struct job_row *row, FILE *notes)
{
    json_t *said = read_object(folder, JOB_FILE_STATUS, &small_bounds);
    json_t *attempt = read_object(folder, JOB_FILE_ATTEMPT, &small_bounds);
    apply_status(said, bare, row);
    int64_t last = json_integer_value(json_object_get(attempt, "attempt"));
    if (last > row->attempt) row->attempt = last;
    if (row->attempt > 0 && row->generation == 0) row->generation = 1;
    if (row->state == JOB_RUNNING || row->state == JOB_PAUSED) {
        row->state = resume && !row->cancel_requested ? JOB_QUEUED : JOB_CANCELLED;
        row->finished_unix_s = row->state == JOB_QUEUED ? 0 : clock_wall_s();
        fprintf(notes, "  it was running; it is %s and continues from its last checkpoint%s\n",
                job_state_name(row->state), row->state == JOB_QUEUED ? "" : " when it is retried");
    }
    row->cancel_requested = false;
    if (row->state == JOB_QUEUED && row->queued_unix_s <= 0) row->queued_unix_s = clock_wall_s();
    json_t *result = NULL;
    if (row->state == JOB_SUCCEEDED &&
        (result = read_object(folder, JOB_FOLDER_RESULTS "/result.json", &result_bounds)) == NULL) {
        row->state = JOB_FAILED;
        set_error(row, "results_lost", "", "the results were damaged or missing when the database was rebuilt; retry");
        fprintf(notes, "  it had succeeded, but its result is damaged or missing; it has failed and can be retried\n");
    }
    json_decref(result);
    json_decref(said);
    json_decref(attempt);
}
