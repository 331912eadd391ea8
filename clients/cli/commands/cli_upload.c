/* The client's side of tus 1.0: asks for the offset, sends pieces, and continues after a broken connection. */
#include "clients/cli/commands/cli.h"
#include "clients/cli/commands/cli_job_files.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

enum { PIECE_BYTES = 16 << 20, MAX_FRUITLESS = 8 };

struct upload {
    struct cli *cli;
    const struct cli_file *file;
    const char *url;
    int fd;
    uint64_t piece_bytes, offset, sending;
    void (*changed)(void *context, uint64_t offset);
    void *context;
};

static void sent(void *context, uint64_t n_bytes)
{
    struct upload *u = context;
    u->sending += n_bytes;
    if (u->changed != NULL) u->changed(u->context, u->sending);
}

static status ask_offset(struct upload *u, struct http_reply *reply, struct error *err)
{
    static const char *const header[] = {"Tus-Resumable: 1.0.0", NULL};
    status s = http_call(u->cli->http, "HEAD", u->url, header, NULL, 0, reply, err);
    if (s != STATUS_OK) return s;
    if (reply->code == 200 || reply->code == 204) {
        if (reply->upload_offset < 0 || (uint64_t)reply->upload_offset > u->file->n_bytes)
            return error_set(err, STATUS_FORMAT, "the server gives no usable offset for '%s'", u->file->name);
        u->offset = (uint64_t)reply->upload_offset;
        return STATUS_OK;
    }
    s = http_problem(reply, err);
    return error_prefix(err, s, "cannot continue the upload of '%s'", u->file->name);
}

static status send_piece(struct upload *u, struct http_reply *reply, struct error *err)
{
    char offset_line[64];
    const char *const header[] = {"Tus-Resumable: 1.0.0", "Content-Type: application/offset+octet-stream", offset_line,
                                  NULL};
    uint64_t left = u->file->n_bytes - u->offset;
    uint64_t n_bytes = left < u->piece_bytes ? left : u->piece_bytes;
    struct http_source source = {.fd = u->fd, .n_bytes = n_bytes, .sent = sent, .context = u};
    snprintf(offset_line, sizeof offset_line, "Upload-Offset: %llu", (unsigned long long)u->offset);
    if (lseek(u->fd, (off_t)u->offset, SEEK_SET) < 0) return error_set_errno(err, "cannot read '%s'", u->file->path);
    u->sending = u->offset;
    return http_patch(u->cli->http, u->url, header, &source, reply, err);
}

/* Sends one piece, or asks for the offset. *known: the offset agrees with the server's. *again: the caller should
 * pause and call again. */
static status step(struct upload *u, bool *known, bool *again, struct error *err)
{
    struct http_reply reply = {0};
    *again = false;
    status s = *known ? send_piece(u, &reply, err) : ask_offset(u, &reply, err);
    if (s != STATUS_OK) {
        *again = reply.cut_off;
        *known = false;
    } else if (!*known) {
        *known = true;
    } else if (reply.code == 204 || reply.code == 200) {
        u->offset = reply.upload_offset >= 0 ? (uint64_t)reply.upload_offset : u->sending;
    } else if (reply.code == 409 || reply.code == 423 || reply.code == 408) {
        *known = false; /* our offset is out of date, or we were too slow */
        *again = true;
        http_problem(&reply, err);
        s = err == NULL ? STATUS_CONFLICT : err->code;
    } else if ((reply.code == 503 || reply.code == 429) && reply.retry_after_s >= 0.0) {
        *again = true;
        s = http_problem(&reply, err);
    } else {
        s = http_problem(&reply, err);
        s = error_prefix(err, s, "cannot upload '%s'", u->file->name);
    }
    http_reply_release(&reply);
    return s;
}

uint64_t cli_piece_bytes(struct cli *cli)
{
    json_t *about = NULL;
    /* a server that reports no limit accepts the default; one that does not reply fails at the next request */
    json_int_t limit = http_json(cli->http, "GET", "/v1/about", NULL, NULL, &about, NULL) != STATUS_OK
                           ? 0
                           : json_integer_value(json_object_get(json_object_get(about, "limits"), "max_patch_bytes"));
    json_decref(about);
    return limit > 0 && limit < PIECE_BYTES ? (uint64_t)limit : PIECE_BYTES;
}

status cli_upload_file(struct cli *cli, const struct cli_file *file, const char *upload_url, uint64_t piece_bytes,
                       void (*changed)(void *context, uint64_t offset), void *context, struct error *err)
{
    struct upload u = {.cli = cli, .file = file, .url = upload_url, .changed = changed, .context = context};
    u.piece_bytes = piece_bytes;
    bool known = false;
    int n_fruitless = 0;
    status s = STATUS_OK;
    u.fd = cli_file_open(file);
    if (u.fd < 0) return error_set_errno(err, "cannot open input file '%s'", file->path);
    while (!known || u.offset < file->n_bytes) {
        bool again;
        uint64_t before = u.offset;
        s = step(&u, &known, &again, err);
        if (s == STATUS_OK) {
            if (u.offset > before) n_fruitless = 0;
            if (changed != NULL) changed(context, u.offset);
            continue;
        }
        if (!again || ++n_fruitless > MAX_FRUITLESS || http_stopped(cli->http)) break;
        http_sleep(cli->http, 0.25 * (double)(1 << (n_fruitless < 6 ? n_fruitless : 6)));
        s = STATUS_OK;
    }
    if (http_stopped(cli->http)) s = error_set(err, STATUS_CANCELLED, "interrupted");
    close(u.fd);
    return s;
}
