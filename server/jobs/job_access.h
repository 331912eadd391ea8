/* Helpers of this folder: how the functions that change a job check its row and write it back. A function that
 * writes a row holds the service's lock `change` from reading the row to writing it. */
#ifndef SELVEDGE_SERVER_JOB_ACCESS_H
#define SELVEDGE_SERVER_JOB_ACCESS_H

#include "server/jobs/job_service.h"
#include "server/store/job_journal.h"

/* A random id for a job or an upload. */
void job_new_id(char out[STORE_ID_BYTES]);
/* Whether the job is queued, running or paused. */
bool job_active(const struct job_row *row);
/* STATUS_CONFLICT while the job is active: its document and files must not change then. */
status job_check_editable(const struct job_row *row, struct error *err);
/* Marks the row of a job whose document or files were edited: the job becomes a draft, and its next start discards
 * earlier progress. The caller writes the row together with the edit, so that a job whose edit fails is unchanged. */
void job_mark_edited(struct job_row *row);
/* Removes the folder of a job, and syncs that: a folder that came back after a power cut, when its job's row is erased,
 * would be one of a job that the database has lost. */
status job_remove_folder(const struct job_service *v, const char *id, struct error *err);
/* Deletes the job's plan, if there is one. A plan is valid only for the document and the files it was computed from. */
void job_forget_plan(const struct job_service *v, const char *id);
/* Whether the job whose geometry this one adopts, if any, exists and has the same owner. STATUS_INVALID, in the same
 * words for a job of another owner as for one that does not exist. */
status job_check_adopted(struct job_service *v, const struct job_row *row, struct error *err);
/* Whether a declared file has an allowed name, role, size and SHA-256, which it puts into lower case. STATUS_INVALID,
 * STATUS_TOO_LARGE. */
status job_check_declaration(struct job_service *v, struct file_row *row, struct error *err);
/* Checks whether a job can be queued, and changes its row so; the caller writes it. The row has its document. */
status job_make_queued(struct job_service *v, struct job_row *row, struct job_refusal *refusal, struct error *err);
/* Makes the folder of a job with document and journal, without syncs. The row has its document. */
status job_fill_place(struct job_service *v, const struct job_row *row, const char *folder, struct error *err);
/* Returns whether an owner may keep these further jobs and bytes; else STATUS_DISK_FULL, and the refusal has the
 * numbers. */
status job_check_quota(struct job_service *v, const struct access_grant *grant, const char *owner,
                       const struct owner_use *more, struct job_refusal *refusal, struct error *err);
/* Repeats a change of the database in the job's journal. A failure is logged only, because the database is the
 * owner. */
void job_note(struct job_service *v, const char *job_id, const struct journal_entry *entry);
/* Tells the runner, if there is one, that a job has changed. */
void job_wake_runner(const struct job_service *v);
/* Syncs everything that was written to the data folder. STATUS_IO. */
status job_sync_all(struct job_service *v, struct error *err);
/* job_note of the rows of many jobs, with one sync. */
void job_note_all(struct job_service *v, const struct job_row *row, size_t n);
/* store_job_update, and the journal. */
status job_update(struct job_service *v, struct job_row *row, struct error *err);
/* The same for changes that free space or end work: if the disk is full, room is made for them. */
status job_update_surely(struct job_service *v, struct job_row *row, struct error *err);

#endif
