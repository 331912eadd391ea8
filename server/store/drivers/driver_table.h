/* The table of databases that a store can use. */
#ifndef SELVEDGE_SERVER_DRIVER_TABLE_H
#define SELVEDGE_SERVER_DRIVER_TABLE_H

#include "server/store/drivers/store_driver.h"

#include <stdint.h>

extern const struct store_driver store_sqlite, store_postgres;

/* Returns the first row that takes the address; the last row takes any path. */
const struct store_driver *store_driver_of(const char *address);
/* Bytes that SQLite reserves for its log (WAL) on a disk with n_free bytes: its usual size, at most an eighth of the
 * free space, and of little space a mebibyte, at most three quarters. */
int64_t store_sqlite_log_bytes(int64_t n_free);

#endif
