/* The folder NAME.selvedge beside a sample folder NAME: state.json (the finished steps, written durably before the next
 * step), reason.txt (why there are no results), log.txt, and results/, which appears when it is complete. */
#ifndef SELVEDGE_CLIENTS_SAMPLE_OUTCOME_H
#define SELVEDGE_CLIENTS_SAMPLE_OUTCOME_H

#include "clients/cli/batch/sample_files.h"
#include "clients/cli/commands/cli.h"

#define SAMPLE_OUTCOME_SUFFIX ".selvedge"

enum sample_state {
    SAMPLE_NEW,       /* waits until it is complete */
    SAMPLE_SUBMITTED, /* is a job */
    SAMPLE_SUCCEEDED, /* results are there */
    SAMPLE_FAILED     /* reason.txt says why; tried again when the sample changes */
};

struct sample_outcome {
    enum sample_state state;
    char job_id[CLI_ID_BYTES];                  /* "": none */
    char fingerprint[SAMPLE_FINGERPRINT_BYTES]; /* of the sample that the state is about */
};

/* outcome_folder: path of NAME.selvedge. A missing or damaged state.json means SAMPLE_NEW: the job is found again by
 * the content of the sample. */
void sample_outcome_read(const char *outcome_folder, struct sample_outcome *outcome);
/* Makes the folder if it is missing. reason NULL: reason.txt is removed. STATUS_IO, STATUS_DISK_FULL; STATUS_INVALID
 * when the folder is a link. */
status sample_outcome_write(const char *outcome_folder, const struct sample_outcome *outcome, const char *reason,
                            struct error *err);
/* Moves results of an earlier job to results-TIME, so that results/ is of the job that is begun. */
status sample_results_retire(const char *outcome_folder, struct error *err);
/* Downloads the results of a job that has succeeded, or the log of another. Repeating continues. */
status sample_results_fetch(struct cli *cli, const char *outcome_folder, const char *job_id, struct error *err);
status sample_log_fetch(struct cli *cli, const char *outcome_folder, const char *job_id, struct error *err);

#endif
