/* Table of the open connections, which ends those that are too slow. The library's timeout only detects silence;
 * this table also limits clients that send or read a byte now and then: the head of a request has a deadline, and a
 * body and an answer have a minimum rate in each window of 10 s. The rate of an answer is measured over TCP by the
 * bytes that the client's machine acknowledges. All functions are thread-safe and accept entry == NULL. */
#ifndef SELVEDGE_SERVER_CONNECTION_TABLE_H
#define SELVEDGE_SERVER_CONNECTION_TABLE_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

struct connection_table;
struct connection_entry;

/* min_rate_bytes_per_s 0: no minimum rate. answers: slow clients are answered 408 on their sockets, which must not be
 * encrypted then. STATUS_NO_MEMORY. */
status connection_table_new(double header_deadline_s, int64_t min_rate_bytes_per_s, bool answers,
                            struct connection_table **table, struct error *err);
void connection_table_free(struct connection_table *table);
size_t connection_table_count(struct connection_table *table);
/* Closes the connections that are too slow, after answering 408 where that is unambiguous. */
void connection_table_reap(struct connection_table *table);

/* Ends the connections whose bodies are kept in memory and are late: they have taken longer than 10 s and a second for
 * each 64 KiB of their size. Called when memory for bodies is short, so that clients which send barely faster than the
 * minimum rate cannot keep it. */
void connection_table_end_late(struct connection_table *table);

/* A connection calls these in order: opened; then for each request body_begins, received and stored for each piece of
 * the body, working, sending once the answer is decided, and idle until the next request; at last closed.
 * connection_opened returns NULL when memory is out. */
struct connection_entry *connection_opened(struct connection_table *table, int fd);
void connection_closed(struct connection_table *table, struct connection_entry *entry);
void connection_body_begins(struct connection_table *table, struct connection_entry *entry);
/* Notes that the body is kept in memory, and its size. */
void connection_in_memory(struct connection_table *table, struct connection_entry *entry, int64_t n_bytes);
void connection_received(struct connection_entry *entry, size_t n_bytes);
void connection_stored(struct connection_entry *entry);
void connection_working(struct connection_table *table, struct connection_entry *entry);
void connection_sending(struct connection_table *table, struct connection_entry *entry);
void connection_idle(struct connection_table *table, struct connection_entry *entry);

/* Notes that the calling thread serves this connection alone; handle: the library's name of it. */
void connection_bind(struct connection_table *table, struct connection_entry *entry, void *handle);
/* Returns the socket of the connection that the calling thread serves and sets *handle. A thread whose connection is
 * not noted yet, because the library has not understood its first line, has the only connection in this state, and
 * *handle is NULL; where there are several, returns -1. The socket stays open until this thread returns to the
 * library. */
int connection_of_thread(struct connection_table *table, void **handle);

#endif
