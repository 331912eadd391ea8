/* Messages between the ranks of one job. A rank is a worker process with a descriptor of its own: a stream socket,
 * whose other end carries messages to the other ranks (optimizer/worker/selvedge_mpi_main.c does so by MPI). A
 * message is a frame and its bytes; the other end keeps the order of the messages from one rank to another. Host byte
 * order: all ranks run the same program.
 */
#ifndef SELVEDGE_BASE_RANK_LINK_H
#define SELVEDGE_BASE_RANK_LINK_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Bytes of the largest message. */
enum { RANK_MESSAGE_MOST = 16 << 20 };

struct rank_frame {
    uint32_t n_bytes; /* that follow */
    uint32_t peer;    /* the rank that the message goes to; when it is received, the rank that it comes from */
    uint32_t kind;
    uint32_t serial; /* number of the order that the message belongs to */
};

/* Writes a message, waiting until all of it is written. STATUS_IO. */
status rank_link_send(int fd, const struct rank_frame *frame, const void *data, struct error *err);
/* Waits at most wait_ms (-1: without limit) for a message, then reads all of it to data, which has room for
 * RANK_MESSAGE_MOST. *got: there was one. STATUS_IO, also when the other end is closed. */
status rank_link_receive(int fd, int wait_ms, bool *got, struct rank_frame *frame, void *data, struct error *err);

#endif
