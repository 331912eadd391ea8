/* The journal of a job: an append-only record file (durable.h) in the job's folder that repeats what the database says
 * of the job, so that a lost database can be rebuilt from the folders (server/rescue/rebuild.h). The database is the
 * owner of every fact and changes first; the journal follows before a change is acknowledged. job.json holds the
 * document, so the journal has its checksum only. A worker may write into its job's folder, so what is read here is
 * checked like any input and bounded. Callers make sure that one thread at a time writes the journal of a job.
 *
 * A record is a JSON object. Each key may be absent, and a later one replaces an earlier one:
 *   "job"              every column of the job's row (names as in struct job_row) but serial, revision, token, document
 *   "document_sha256"  checksum of the document in job.json
 *   "idempotency"      {"key","body_sha256"} of the request that has created the job
 *   "files"            [{"id","name","role","size_bytes","sha256"}]: declared files; one replaces an earlier one of its
 *                      name. sha256 is "" unless the client has declared it.
 *   "removed"          name of a file that is no longer declared
 *   "seal"             checksum of the record with the daemon's key (journal_seal.h); the last key */
#ifndef SELVEDGE_SERVER_JOB_JOURNAL_H
#define SELVEDGE_SERVER_JOB_JOURNAL_H

#include "server/store/journal_seal.h"
#include "server/store/store.h"

enum { JOURNAL_KEY_BYTES = 160 };

/* The facts of one record. All members may be NULL or 0. */
struct journal_entry {
    const struct job_row *job;
    bool document; /* job->document is now in job.json */
    const char *idempotency_key, *body_hash;
    const struct file_row *file;
    size_t n_file;
    const char *removed;
};

/* Appends a record to the journal in a job's folder. With sync it survives power loss. STATUS_IO, STATUS_DISK_FULL,
 * STATUS_NO_MEMORY. */
status job_journal_append(const struct journal_key *key, const char *folder, const struct journal_entry *entry,
                          bool sync, struct error *err);

/* Returns the time of the last change of the job's row that is certain: updated_unix_s of the last sealed record about
 * the job `id` among the last records. 0: there is none. */
double job_journal_sealed_unix_s(const struct journal_key *key, const char *folder, const char *id);

/* The facts of all records of a journal together. */
struct job_journal {
    struct job_row job; /* without document */
    bool has_job;
    char document_hash[STORE_HASH_TEXT_BYTES], key[JOURNAL_KEY_BYTES], body_hash[STORE_HASH_TEXT_BYTES]; /* "": none */
    struct file_row *file; /* owned; without offsets and states */
    size_t n_file, n_damaged /* lines that are no records */;
};
/* Reads a journal past damaged lines. The caller releases it, after an error too. STATUS_NOT_FOUND (or it is not a
 * file), STATUS_FORMAT (no record is whole), STATUS_IO, STATUS_NO_MEMORY. */
status job_journal_read(const char *folder, struct job_journal *journal, struct error *err);
void job_journal_release(struct job_journal *journal);

#endif
