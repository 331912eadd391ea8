#include "server/rescue/job_evidence.h"
#include "base/clock.h"
#include "base/files/foreign_file.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/job_outline.h"
#include "server/rescue/input_evidence.h"
#include "server/rescue/worker_evidence.h"
#include "server/settings/job_paths.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static void folder_of(const struct evidence_request *q, char out[PATH_BYTES])
{
    path_join(out, q->data, "jobs", q->id, NULL);
}

/* Reads and checks a document; *text is owned by the caller. */
static status read_document(const char *folder, char **text, char sample[256], struct error *err)
{
    char path[PATH_BYTES];
    size_t n = 0;
    struct job_outline outline = {.n_file = 0};
    path_join(path, folder, JOB_FILE_DOCUMENT, NULL);
    status s = foreign_file_read(folder, JOB_FILE_DOCUMENT, JOB_MAX_DOCUMENT_BYTES, text, &n, err);
    if (s != STATUS_OK) return s;
    s = job_outline_read(*text, n, &outline, err);
    if (s == STATUS_OK) {
        snprintf(sample, 256, "%s", outline.sample);
        job_outline_release(&outline);
        return STATUS_OK;
    }
    free(*text);
    *text = NULL;
    return error_prefix(err, s, "cannot use '%s'", path);
}

static bool hash_differs(const char *text, const char *hash)
{
    unsigned char sum[crypto_hash_sha256_BYTES];
    char found[STORE_HASH_TEXT_BYTES];
    crypto_hash_sha256(sum, (const unsigned char *)text, strlen(text));
    sodium_bin2hex(found, sizeof found, sum, sizeof sum);
    return strcmp(found, hash) != 0;
}

/* Sets the row from the newer one of journal and backup. Returns false if there is neither. */
static bool choose_row(const struct evidence_request *q, const struct job_journal *journal, struct job_row *row)
{
    bool known = journal->has_job && strcmp(journal->job.id, q->id) == 0;
    const struct job_row *from = q->base;
    if (known && (from == NULL || journal->job.updated_unix_s >= from->updated_unix_s)) from = &journal->job;
    if (from == NULL) return false;
    *row = *from;
    row->document = NULL;
    row->serial = q->base == NULL ? 0 : q->base->serial;
    /* the owner never changes, and no worker can write to the backup */
    if (q->base != NULL) snprintf(row->owner, sizeof row->owner, "%s", q->base->owner);
    row->token[0] = '\0';
    return true;
}

/* Makes a row for a job that is known by its folder only. */
static void bare_row(const struct evidence_request *q, const char *folder, struct job_row *row)
{
    char path[PATH_BYTES];
    struct stat st;
    path_join(path, folder, JOB_FILE_DOCUMENT, NULL);
    *row = (struct job_row){.state = JOB_DRAFT};
    snprintf(row->id, sizeof row->id, "%s", q->id);
    row->created_unix_s = stat(path, &st) == 0 ? (double)st.st_mtim.tv_sec : clock_wall_s();
    row->updated_unix_s = row->created_unix_s;
    fprintf(q->notes, "  it has no journal, and no backup knows it; its state follows from its files\n");
}

/* Sets document and sample; the document of the backup is the last resort. */
static status take_document(const struct evidence_request *q, const char *folder, const struct job_journal *journal,
                            struct job_row *row, struct error *err)
{
    char *text = NULL;
    struct error why = {0};
    status s = read_document(folder, &text, row->sample, &why);
    if (s != STATUS_OK && q->base != NULL && q->base->document != NULL) {
        fprintf(q->notes, "  %s; the document of the backup is used\n", why.text);
        text = strdup(q->base->document);
        snprintf(row->sample, sizeof row->sample, "%s", q->base->sample);
        if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read job: out of memory");
    } else if (s != STATUS_OK)
        return error_set(err, s, "%s", why.text);
    row->document = text;
    if (s == STATUS_OK && journal->document_hash[0] != '\0' && hash_differs(text, journal->document_hash)) {
        fprintf(q->notes, "  its document was being replaced, so it is a draft\n");
        row->state = JOB_DRAFT;
        row->dirty = row->attempt > 0;
    }
    return STATUS_OK;
}

/* A job that waits needs all its inputs. */
static void check_inputs(const struct evidence_request *q, struct job_evidence *e)
{
    if (e->row.state != JOB_QUEUED || e->n_complete == e->n_file) return;
    fprintf(q->notes, "  it is a draft, because an input is missing\n");
    e->row.state = JOB_DRAFT;
}

status job_evidence_read(const struct evidence_request *q, struct job_evidence *e, struct error *err)
{
    char folder[PATH_BYTES];
    struct job_journal journal = {0};
    struct error why = {0};
    *e = (struct job_evidence){0};
    folder_of(q, folder);
    status s = job_journal_read(folder, &journal, &why);
    if (s != STATUS_OK && s != STATUS_NOT_FOUND) fprintf(q->notes, "  %s\n", why.text);
    if (journal.n_damaged > 0)
        fprintf(q->notes, "  %zu damaged lines of its journal are passed over\n", journal.n_damaged);
    bool known = choose_row(q, &journal, &e->row);
    if (!known) bare_row(q, folder, &e->row);
    s = take_document(q, folder, &journal, &e->row, err);
    if (s != STATUS_OK) goto out;
    snprintf(e->key, sizeof e->key, "%s", journal.key);
    snprintf(e->body_hash, sizeof e->body_hash, "%s", journal.body_hash);
    const struct input_request inputs = {q->data, &e->row, &journal, q->base_file, q->n_base_file, q->notes};
    s = input_evidence_read(&inputs, &e->file, &e->n_file, &e->n_complete, err);
    if (s != STATUS_OK) goto out;
    worker_evidence_apply(folder, !known, q->resume, &e->row, q->notes);
    check_inputs(q, e);
out:
    job_journal_release(&journal);
    return s;
}

void job_evidence_release(struct job_evidence *e)
{
    job_row_release(&e->row);
    free(e->file);
    e->file = NULL;
    e->n_file = 0;
}
