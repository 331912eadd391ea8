#include "server/rescue/input_evidence.h"
#include "optimizer/job/document/job_file_name.h"
#include "optimizer/job/job_outline.h"
#include "server/files/upload_file.h"
#include "server/jobs/job_access.h"

#include <errno.h>
#include <fcntl.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PIECE_BYTES = 1 << 20 };

static status hash_descriptor(int fd, const char *path, char out[STORE_HASH_TEXT_BYTES], struct error *err)
{
    crypto_hash_sha256_state state;
    unsigned char sum[crypto_hash_sha256_BYTES], *piece = malloc(PIECE_BYTES);
    if (piece == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read '%s': out of memory", path);
    status s = STATUS_OK;
    crypto_hash_sha256_init(&state);
    for (ssize_t n = 1; s == STATUS_OK && n != 0;) {
        n = read(fd, piece, PIECE_BYTES);
        if (n > 0) crypto_hash_sha256_update(&state, piece, (unsigned long long)n);
        if (n < 0 && errno != EINTR) s = error_set_errno(err, "cannot read '%s'", path);
    }
    crypto_hash_sha256_final(&state, sum);
    sodium_bin2hex(out, STORE_HASH_TEXT_BYTES, sum, sizeof sum);
    free(piece);
    return s;
}

status input_hash(const char *path, char out[STORE_HASH_TEXT_BYTES], struct error *err)
{
    struct stat st;
    int fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) return error_set_errno(err, "cannot read '%s'", path);
    status s = fstat(fd, &st) == 0 && S_ISREG(st.st_mode) ? hash_descriptor(fd, path, out, err)
                                                          : error_set(err, STATUS_INVALID, "'%s' is not a file", path);
    close(fd);
    return s;
}

static const struct file_row *find(const struct file_row *file, size_t n, const char *name)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(file[i].name, name) == 0) return &file[i];
    return NULL;
}

struct declared {
    struct file_row *file;
    size_t n, capacity;
    bool no_memory;
};

static void declare(struct declared *d, const struct file_row *row)
{
    if (!job_file_name_valid(row->name) || row->size_bytes < 1 || find(d->file, d->n, row->name) != NULL) return;
    if (d->n == d->capacity) {
        size_t more = d->capacity == 0 ? 16 : d->capacity * 2;
        struct file_row *p = realloc(d->file, more * sizeof *p);
        d->no_memory = d->no_memory || p == NULL;
        if (p == NULL) return;
        d->file = p;
        d->capacity = more;
    }
    d->file[d->n++] = *row;
}

struct visit {
    const struct input_request *q;
    struct declared *declared;
};

/* A file that a document names and that is in input/. */
static void visit_document(void *context, const char *name, const char *role)
{
    struct visit *v = context;
    struct file_row row = {0};
    char path[PATH_BYTES];
    struct stat st;
    snprintf(row.job_id, sizeof row.job_id, "%s", v->q->job->id);
    snprintf(row.name, sizeof row.name, "%s", name);
    snprintf(row.role, sizeof row.role, "%s", role);
    upload_input_path(v->q->data, &row, path);
    if (!job_file_name_valid(name) || lstat(path, &st) != 0 || !S_ISREG(st.st_mode)) return;
    row.size_bytes = (int64_t)st.st_size;
    declare(v->declared, &row);
}

/* Decides whether a declared file is complete. */
static bool examine(const struct input_request *q, struct file_row *row)
{
    char path[PATH_BYTES], hash[STORE_HASH_TEXT_BYTES];
    struct stat st;
    struct error err = {0};
    const struct file_row *base = find(q->base, q->n_base, row->name);
    snprintf(row->job_id, sizeof row->job_id, "%s", q->job->id);
    if (!id_valid(row->id)) job_new_id(row->id);
    row->offset_bytes = 0;
    row->state = FILE_UPLOADING;
    upload_hash_restart(row);
    /* one that the client did not declare, but the service computed */
    if (row->sha256[0] == '\0' && base != NULL && base->state == FILE_COMPLETE && base->size_bytes == row->size_bytes &&
        strcmp(base->id, row->id) == 0)
        snprintf(row->sha256, sizeof row->sha256, "%s", base->sha256);
    upload_input_path(q->data, row, path);
    if (lstat(path, &st) != 0) {
        fprintf(q->notes, "  input '%s' must be sent again: its upload was not complete\n", row->name);
        return false;
    }
    status s = input_hash(path, hash, &err);
    bool right = s == STATUS_OK && (int64_t)st.st_size == row->size_bytes &&
                 (row->sha256[0] == '\0' || strcmp(hash, row->sha256) == 0);
    if (!right) {
        fprintf(q->notes, "  input '%s' must be sent again: %s\n", row->name,
                s != STATUS_OK ? err.text : "its bytes are not those that were sent");
        return false;
    }
    snprintf(row->sha256, sizeof row->sha256, "%s", hash);
    row->offset_bytes = row->size_bytes;
    row->state = FILE_COMPLETE;
    return true;
}

status input_evidence_read(const struct input_request *q, struct file_row **out, size_t *n_file, size_t *n_complete,
                           struct error *err)
{
    struct declared d = {0};
    struct job_outline outline = {.n_file = 0};
    /* the journal lists the files removed since the backup; where it lists no file at all, its file records may be
     * lost */
    for (size_t i = 0; i < q->journal->n_file; i++) declare(&d, &q->journal->file[i]);
    for (size_t i = 0; !q->journal->has_job && i < q->n_base; i++) declare(&d, &q->base[i]);
    struct visit v = {q, &d};
    status s = job_outline_read(q->job->document, strlen(q->job->document), &outline, err);
    for (size_t i = 0; i < outline.n_file; i++) visit_document(&v, outline.file[i].name, outline.file[i].role);
    job_outline_release(&outline);
    if (d.no_memory) s = error_set(err, STATUS_NO_MEMORY, "cannot read job: out of memory");
    *n_complete = 0;
    for (size_t i = 0; s == STATUS_OK && i < d.n; i++) *n_complete += examine(q, &d.file[i]);
    *out = d.file;
    *n_file = d.n;
    if (s != STATUS_OK) {
        free(d.file);
        *out = NULL;
        *n_file = 0;
    }
    return s;
}
