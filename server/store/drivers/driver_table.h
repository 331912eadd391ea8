/* The table of databases that a store can use. */
#ifndef SELVEDGE_SERVER_DRIVER_TABLE_H
#define SELVEDGE_SERVER_DRIVER_TABLE_H

#include "server/store/sql/store_driver.h"

extern const struct store_driver store_sqlite, store_postgres;

/* Returns the first row that takes the address; the last row takes any path. */
const struct store_driver *store_driver_of(const char *address);

#endif
