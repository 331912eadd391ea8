#include "server/http/tar_stream.h"
#include "optimizer/job/job_folder.h"
#include "server/views/result_files.h"

#include <archive.h>
#include <archive_entry.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { READ_BYTES = 256 * 1024, SEND_BYTES = 128 * 1024 };

struct tar_stream {
    struct job_service *v;
    char job_id[STORE_ID_BYTES];
    struct result_file *file;
    size_t n_file, i_file;
    int fd;               /* of the file that is being sent, or -1 */
    long long left_bytes; /* bytes of this file still to be sent, by the size in its header */
    struct archive *archive;
    bool closed, failed;
    char *out; /* bytes made and not yet sent: out[sent..n_out) */
    size_t sent, n_out, capacity;
    char chunk[READ_BYTES];
};

static la_ssize_t on_write(struct archive *a, void *context, const void *data, size_t n)
{
    struct tar_stream *t = context;
    if (t->n_out + n > t->capacity) {
        size_t more = (t->n_out + n) * 2;
        char *p = realloc(t->out, more);
        if (p == NULL) {
            archive_set_error(a, 12, "out of memory");
            return -1;
        }
        t->out = p;
        t->capacity = more;
    }
    memcpy(t->out + t->n_out, data, n);
    t->n_out += n;
    return (la_ssize_t)n;
}

/* Writes the header of the next file. A file that vanished since the listing is left out. */
static void next_file(struct tar_stream *t)
{
    const struct result_file *f = &t->file[t->i_file++];
    struct stat st;
    if (result_open(t->v, t->job_id, JOB_FOLDER_RESULTS, f->path, &t->fd, NULL) != STATUS_OK) {
        t->fd = -1;
        return;
    }
    struct archive_entry *e = archive_entry_new();
    if (fstat(t->fd, &st) != 0 || e == NULL)
        t->failed = true;
    else {
        archive_entry_set_pathname(e, f->path);
        archive_entry_set_filetype(e, AE_IFREG);
        archive_entry_set_perm(e, 0644);
        archive_entry_set_size(e, st.st_size);
        archive_entry_set_mtime(e, st.st_mtim.tv_sec, 0);
        t->left_bytes = (long long)st.st_size;
        if (archive_write_header(t->archive, e) != ARCHIVE_OK) t->failed = true;
    }
    archive_entry_free(e);
}

static void more_of_file(struct tar_stream *t)
{
    size_t want = t->left_bytes < READ_BYTES ? (size_t)t->left_bytes : READ_BYTES;
    ssize_t n = want == 0 ? 0 : read(t->fd, t->chunk, want);
    if (n > 0) {
        if (archive_write_data(t->archive, t->chunk, (size_t)n) != n) t->failed = true;
        t->left_bytes -= n;
    }
    if (n < 0 || (n == 0 && t->left_bytes > 0)) t->failed = true; /* the file has become shorter than its header says */
    if (t->left_bytes > 0) return;
    close(t->fd);
    t->fd = -1;
}

static void advance(struct tar_stream *t)
{
    if (t->fd >= 0)
        more_of_file(t);
    else if (t->i_file < t->n_file)
        next_file(t);
    else if (!t->closed) {
        t->closed = true;
        if (archive_write_close(t->archive) != ARCHIVE_OK) t->failed = true;
    }
}

static ssize_t on_read(void *context, uint64_t position, char *out, size_t most)
{
    struct tar_stream *t = context;
    (void)position;
    while (t->sent == t->n_out && !t->failed) {
        t->sent = t->n_out = 0;
        bool done = t->closed;
        if (!done) advance(t);
        if (done) return MHD_CONTENT_READER_END_OF_STREAM;
    }
    if (t->failed) return MHD_CONTENT_READER_END_WITH_ERROR;
    size_t n = t->n_out - t->sent < most ? t->n_out - t->sent : most;
    memcpy(out, t->out + t->sent, n);
    t->sent += n;
    return (ssize_t)n;
}

static void on_free(void *context)
{
    struct tar_stream *t = context;
    if (t->fd >= 0) close(t->fd);
    t->fd = -1;
    if (t->archive != NULL) {
        archive_write_fail(t->archive); /* writes no trailer: nobody reads it */
        archive_write_free(t->archive);
    }
    free(t->file);
    free(t->out);
    free(t);
}

status tar_stream_response(struct job_service *v, const char *job_id, struct MHD_Response **out, struct error *err)
{
    struct tar_stream *t = calloc(1, sizeof *t);
    if (t == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the archive: out of memory");
    t->v = v;
    t->fd = -1;
    snprintf(t->job_id, sizeof t->job_id, "%s", job_id);
    status s = result_list(v, job_id, JOB_FOLDER_RESULTS, &t->file, &t->n_file, err);
    if (s != STATUS_OK) goto out;
    t->archive = archive_write_new();
    if (t->archive == NULL || archive_write_set_format_pax_restricted(t->archive) != ARCHIVE_OK ||
        archive_write_set_bytes_per_block(t->archive, 0) != ARCHIVE_OK ||
        archive_write_open(t->archive, t, NULL, on_write, NULL) != ARCHIVE_OK) {
        s = error_set(err, STATUS_INTERNAL, "cannot make the archive");
        goto out;
    }
    *out = MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, SEND_BYTES, on_read, t, on_free);
    if (*out == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot make the archive: out of memory");
out:
    if (s != STATUS_OK) on_free(t);
    return s;
}
