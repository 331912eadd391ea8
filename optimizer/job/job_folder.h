/* The layout of a job folder: the whole interface between daemon and worker. Also usable by hand.
 *
 *   JOB/job.json            the job document (job_document.h), written by the daemon (or the user) before the start
 *   JOB/input/<name>        input files under the names that job.json uses (daemon: verified, never written by the worker)
 *   JOB/attempt.json        {"attempt":3,"token":"..."}: the attempt that may write. Absent when run by hand.
 *   JOB/lock                flock()ed by the worker while it lives
 *   JOB/status.json         replaced by the worker: see below
 *   JOB/series.rec          record file (durable.h), one JSON object a fit step, append-only
 *   JOB/log.txt             the worker's log, append-only
 *   JOB/work/<stage>/       checkpoints of stages; JOB/work/<stage>.done marks a stage whose outputs are whole
 *   JOB/results/            what the user gets: result.json, *.hair, *.vol, renderings
 *
 * status.json: {"state":"running"|"succeeded"|"failed"|"cancelled", "attempt":n, "stage":"fit", "i_stage":5,
 * "n_stage":8, "stage_fraction":0..1, "fraction":0..1, "eta_s":number|null, "heartbeat_unix_s":t, "started_unix_s":t,
 * "message":"...", "objective":number|null, "objective_se":number|null, "step":n|null, "warnings":["..."],
 *   "error":null|{"code":"format","field":"volume.files","text":"..."}, "peak_rss_bytes":n}
 * Rewritten at least every second while the worker lives.
 *
 * Series record: {"step":0 (through all models of the job), "model":"two_lobe.v1", "i_model":0, "model_step":0,
 * "phase":"gauss_newton", "wall_s":t, "n_path":n (this step), "n_path_total":n (of this model), "objective":f,
 * "objective_se":f, "parameter":[...] (file units, order of the model), "parameter_se":[...]|null, "rel_rms":f,
 * "rendered":[[r,g,b],...], "n_path_row":[...] (one a fitted photograph), "damping", "noise", "step_length",
 * "step_limit", "gain", "nuisance" (with such terms), "note":"..."} (docs/file-formats.md); the first record of a model
 * also says what its parameters are: "parameters":[{"name","unit","lower","upper","fixed"},...].
 *
 * Worker exit codes: 0 succeeded, 1 failed (status.json says why), 2 usage, 3 cancelled (SIGTERM), 4 stale token or
 * folder locked.
 */
#ifndef SELVEDGE_OPTIMIZER_JOB_FOLDER_H
#define SELVEDGE_OPTIMIZER_JOB_FOLDER_H

#define JOB_FILE_DOCUMENT "job.json"
#define JOB_FILE_ATTEMPT "attempt.json"
#define JOB_FILE_LOCK "lock"
#define JOB_FILE_STATUS "status.json"
#define JOB_FILE_SERIES "series.rec"
#define JOB_FILE_LOG "log.txt"
#define JOB_FOLDER_INPUT "input"
#define JOB_FOLDER_WORK "work"
#define JOB_FOLDER_RESULTS "results"

enum worker_exit { WORKER_SUCCEEDED = 0, WORKER_FAILED = 1, WORKER_USAGE = 2, WORKER_CANCELLED = 3, WORKER_STALE = 4 };

#endif
