#include "base/ranks/rank_link.h"

#include <errno.h>
#include <poll.h>
#include <unistd.h>

static status write_all(int fd, const void *data, size_t n, struct error *err)
{
    const char *at = data;
    while (n > 0) {
        ssize_t put = write(fd, at, n);
        if (put < 0 && errno == EINTR) continue;
        if (put <= 0) return error_set_errno(err, "cannot send to the other ranks");
        at += put;
        n -= (size_t)put;
    }
    return STATUS_OK;
}

static status read_all(int fd, void *data, size_t n, struct error *err)
{
    char *at = data;
    while (n > 0) {
        ssize_t got = read(fd, at, n);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return error_set_errno(err, "cannot receive from the other ranks");
        if (got == 0) return error_set(err, STATUS_IO, "the other ranks are gone");
        at += got;
        n -= (size_t)got;
    }
    return STATUS_OK;
}

status rank_link_send(int fd, const struct rank_frame *frame, const void *data, struct error *err)
{
    status s = write_all(fd, frame, sizeof *frame, err);
    return s == STATUS_OK ? write_all(fd, data, frame->n_bytes, err) : s;
}

status rank_link_receive(int fd, int wait_ms, bool *got, struct rank_frame *frame, void *data, struct error *err)
{
    struct pollfd ready = {.fd = fd, .events = POLLIN};
    *got = false;
    int n = poll(&ready, 1, wait_ms);
    if (n == 0 || (n < 0 && errno == EINTR)) return STATUS_OK;
    if (n < 0) return error_set_errno(err, "cannot receive from the other ranks");
    status s = read_all(fd, frame, sizeof *frame, err);
    if (s == STATUS_OK && frame->n_bytes > RANK_MESSAGE_MOST)
        s = error_set(err, STATUS_FORMAT, "rank %u sent a message of %u bytes, which is too long", frame->peer,
                      frame->n_bytes);
    if (s == STATUS_OK) s = read_all(fd, data, frame->n_bytes, err);
    *got = s == STATUS_OK;
    return s;
}
