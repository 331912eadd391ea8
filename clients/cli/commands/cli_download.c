#include "clients/cli/commands/cli_http.h"

#include "base/files/durable.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Files are requested in pieces of limited size, so a file of any size needs little memory and a broken connection
 * costs at most one piece. */
enum { PIECE_BYTES = 8 << 20, MAX_BREAK = 8 };

struct download {
    char part[4200], etag_path[4240], etag[160];
    int fd;
    uint64_t n_done, n_total;
};

static status write_all(int fd, const char *data, size_t n, struct error *err, const char *path)
{
    while (n > 0) {
        ssize_t w = write(fd, data, n);
        if (w < 0 && errno == EINTR) continue;
        if (w < 0) return error_set_errno(err, "cannot write '%s'", path);
        data += w;
        n -= (size_t)w;
    }
    return STATUS_OK;
}

static status download_open(struct download *d, const char *path, struct error *err)
{
    struct stat info;
    char *etag = NULL;
    size_t n = 0;
    if (snprintf(d->part, sizeof d->part, "%s.part", path) >= (int)sizeof d->part)
        return error_set(err, STATUS_INVALID, "the path '%.80s...' is too long", path);
    snprintf(d->etag_path, sizeof d->etag_path, "%s.etag", d->part);
    d->fd = open(d->part, O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
    if (d->fd < 0) return error_set_errno(err, "cannot write '%s'", d->part);
    if (fstat(d->fd, &info) == 0 && info.st_size > 0 &&
        file_read_all(d->etag_path, sizeof d->etag - 1, &etag, &n, NULL) == STATUS_OK) {
        snprintf(d->etag, sizeof d->etag, "%s", etag);
        d->n_done = (uint64_t)info.st_size;
    }
    free(etag);
    return STATUS_OK;
}

static status restart(struct download *d, struct error *err)
{
    d->n_done = 0;
    d->n_total = 0;
    d->etag[0] = '\0';
    if (ftruncate(d->fd, 0) != 0 || lseek(d->fd, 0, SEEK_SET) != 0)
        return error_set_errno(err, "cannot write '%s'", d->part);
    return STATUS_OK;
}

/* Requests the next piece. A piece shorter than requested is the last one, so the total in Content-Range is not
 * needed. */
static status take_piece(struct http *http, const char *url_path, struct download *d, bool *done, bool *broke,
                         struct error *err)
{
    char range[96], if_range[200];
    const char *header[3] = {range, NULL, NULL};
    struct http_reply reply;
    *broke = false;
    if (lseek(d->fd, (off_t)d->n_done, SEEK_SET) < 0) return error_set_errno(err, "cannot write '%s'", d->part);
    snprintf(range, sizeof range, "Range: bytes=%llu-%llu", (unsigned long long)d->n_done,
             (unsigned long long)d->n_done + PIECE_BYTES - 1);
    if (d->n_done > 0 && d->etag[0] != '\0') {
        snprintf(if_range, sizeof if_range, "If-Range: %s", d->etag);
        header[1] = if_range;
    }
    status s = http_call(http, "GET", url_path, header, NULL, 0, &reply, err);
    if (s != STATUS_OK && reply.code == 200 && d->n_done > 0) {
        /* the file has changed and is too large for one reply, so start again with its first piece */
        s = restart(d, err);
    } else if (s != STATUS_OK) {
        *broke = reply.cut_off;
    } else if (reply.code == 416) { /* the piece begins after the end: the file is complete, or empty */
        *done = true;
    } else if (reply.code == 200) { /* no support for ranges, or the file has changed: the reply is the whole file */
        if ((s = restart(d, err)) == STATUS_OK) s = write_all(d->fd, reply.body, reply.n_body, err, d->part);
        d->n_done = reply.n_body;
        *done = true;
    } else if (reply.code == 206) {
        s = write_all(d->fd, reply.body, reply.n_body, err, d->part);
        d->n_done += reply.n_body;
        *done = reply.n_body < PIECE_BYTES;
        if (reply.etag[0] != '\0' && strcmp(reply.etag, d->etag) != 0) {
            snprintf(d->etag, sizeof d->etag, "%s", reply.etag);
            (void)durable_replace_volatile(d->etag_path, d->etag, strlen(d->etag),
                                           NULL); /* needed only to continue later */
        }
    } else {
        s = http_problem(&reply, err);
    }
    http_reply_release(&reply);
    return s;
}

status http_download(struct http *http, const char *url_path, const char *path,
                     void (*got)(void *context, uint64_t n, uint64_t n_total), void *context, struct error *err)
{
    struct download d = {.fd = -1};
    bool done = false;
    int n_break = 0;
    status s = download_open(&d, path, err);
    while (s == STATUS_OK && !done) {
        bool broke;
        s = take_piece(http, url_path, &d, &done, &broke, err);
        if (s != STATUS_OK && broke && ++n_break <= MAX_BREAK) {
            http_sleep(http, 0.5 * n_break);
            if (!http_stopped(http)) s = STATUS_OK;
        }
        if (s == STATUS_OK && got != NULL) got(context, d.n_done, d.n_total);
    }
    if (s == STATUS_OK && ftruncate(d.fd, (off_t)d.n_done) != 0) s = error_set_errno(err, "cannot write '%s'", d.part);
    if (d.fd >= 0 && close(d.fd) != 0 && s == STATUS_OK) s = error_set_errno(err, "cannot write '%s'", d.part);
    if (s == STATUS_OK && rename(d.part, path) != 0) s = error_set_errno(err, "cannot write '%s'", path);
    if (s == STATUS_OK) unlink(d.etag_path);
    return s;
}
