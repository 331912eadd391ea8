/* Every open connection with the time of its present phase. The library's timeout only sees silence; a client that sends one byte
 * now and then is ended here: the head of a request has a deadline, a body has a minimum rate. Thread-safe; entry may be NULL. */
#ifndef SELVEDGE_SERVER_CONNECTION_TABLE_H
#define SELVEDGE_SERVER_CONNECTION_TABLE_H

#include "base/status.h"

#include <stdint.h>

struct connection_table;
struct connection_entry;

/* min_rate 0: any rate will do */
status connection_table_new(double header_deadline_s, int64_t min_rate_bytes_per_s, struct connection_table **table,
                            struct error *err);
void connection_table_free(struct connection_table *table);
size_t connection_table_count(struct connection_table *table);
/* Answers 408 to connections that are too slow and shuts them down. */
void connection_table_reap(struct connection_table *table);

struct connection_entry *connection_opened(struct connection_table *table, int fd);
void connection_closed(struct connection_table *table, struct connection_entry *entry);
void connection_body_begins(struct connection_table *table, struct connection_entry *entry);
void connection_received(struct connection_entry *entry, size_t n_bytes);
void connection_replying(struct connection_table *table, struct connection_entry *entry);
void connection_idle(struct connection_table *table, struct connection_entry *entry);

#endif
