/* The layout of a job folder. It is the whole interface between the daemon and the worker; a user can also make such a
 * folder and run the worker by hand.
 *
 *   JOB/job.json            the job document (job_document.h), written by the user or by the daemon: when the job is
 *                           created, and when its document is replaced
 *   JOB/journal.rec         the daemon's journal of the job (server/store/job_journal.h); absent when
 *                           run by hand
 *   JOB/input/<name>        input files under the names that job.json uses. The daemon verifies them, the worker reads
 *                           them.
 *   JOB/attempt.json        {"attempt":3,"token":"..."}: the attempt that may write. Absent when run by hand.
 *   JOB/letterhead.json     {"laboratory","logo","paper"} for the report: a name, an image as URI "data:image/...",
 *                           "A4" or "letter". May be absent.
 *   JOB/lock                The worker holds a flock() on it while it lives.
 *   JOB/claim-<token>       the start of a worker that has the attempt of this token (option --start), when an engine
 *                           could start one twice
 *   JOB/backend.json        where an engine other than the daemon runs the job (server/files/backend_note.h)
 *   JOB/status.json         The worker replaces it at least every second while it lives.
 *   JOB/pictures.json       the same for the stage after the result (worker option --pictures), besides the state
 *                           "waiting", which the daemon writes
 *   JOB/pictures-log.txt    the log of this stage, append-only
 *   JOB/series.rec          record file (durable.h), append-only: one JSON object for each step of the fit
 *   JOB/log.txt             the worker's log, append-only
 *   JOB/work/<stage>/       checkpoints of a stage; JOB/work/<stage>.done marks a stage whose outputs are complete
 *   JOB/adopted/            links to another job's geometry, until they are in work/
 *   JOB/results/            the results for the user: result.json, *.hair, *.vol, renderings
 *   JOB/run.json            the document that an edited job had when it was run last
 *   JOB/versions/<n>/       the results of run n of a job that was edited and run again, with version.json
 *
 * Keys of status.json:
 *
 *   "state"                              "running", "succeeded", "failed" or "cancelled"
 *   "attempt"                            number of the attempt that writes
 *   "stage", "i_stage", "n_stage"        the current stage (stage_table.h), its index and the number of stages
 *   "stage_fraction", "fraction"         share of the stage and of the whole job that is done, 0..1
 *   "eta_s"                              estimated remaining time, or null
 *   "heartbeat_unix_s", "started_unix_s" time of writing, time of the worker's start
 *   "message"                            a sentence about the current work
 *   "objective", "objective_se", "step"  of the latest step of the fit, or null
 *   "warnings"                           list of sentences
 *   "error"                              null, or {"code":"format","field":"volume.files","text":"..."}
 *   "peak_rss_bytes"                     largest resident memory of the worker so far
 *   "cpu_s"                              processor seconds of this attempt so far
 *
 * docs/file-formats.md describes a record of series.rec.
 */
#ifndef SELVEDGE_OPTIMIZER_JOB_FOLDER_H
#define SELVEDGE_OPTIMIZER_JOB_FOLDER_H

#define JOB_FILE_DOCUMENT "job.json"
#define JOB_FILE_JOURNAL "journal.rec"
#define JOB_FILE_ATTEMPT "attempt.json"
#define JOB_FILE_LOCK "lock"
#define JOB_FILE_LETTERHEAD "letterhead.json"
#define JOB_FILE_BACKEND "backend.json"
#define JOB_CLAIM_PREFIX "claim-"
#define JOB_FILE_STATUS "status.json"
#define JOB_FILE_PICTURES "pictures.json"
#define JOB_FILE_PLAN "plan.json" /* the needs that were predicted for the job (server/workers/input_judge.h) */
#define JOB_FILE_SERIES "series.rec"
#define JOB_FILE_LOG "log.txt"
#define JOB_FILE_PICTURES_LOG "pictures-log.txt"
#define JOB_FOLDER_INPUT "input"
#define JOB_FOLDER_WORK "work"
#define JOB_FOLDER_ADOPTED "adopted"
#define JOB_FOLDER_RESULTS "results"
#define JOB_FILE_RUN "run.json"
#define JOB_FOLDER_VERSIONS "versions"
#define JOB_THUMBNAIL "thumbnail.png" /* among the results: a small picture for lists */

#define JOB_PDF_PROGRAM "weasyprint" /* makes report.pdf; the Debian package has the same name */
#define JOB_BLEND_PROGRAM "blender"  /* makes cloth.blend of an export for Blender */

/* Exit codes of the worker. */
enum worker_exit {
    WORKER_SUCCEEDED = 0,
    WORKER_FAILED = 1,    /* status.json says why */
    WORKER_USAGE = 2,     /* wrong arguments */
    WORKER_CANCELLED = 3, /* by SIGTERM */
    WORKER_STALE = 4,     /* another attempt may write now, or another worker has locked the folder */
    WORKER_LOST = 75      /* of several ranks one is lost: the job goes on from its checkpoint when it is run again */
};

#endif
