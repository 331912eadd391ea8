/* Tables of text: CSV with commas, as spreadsheets write it (RFC 4180). */
#ifndef SELVEDGE_CLIENTS_CSV_TABLE_H
#define SELVEDGE_CLIENTS_CSV_TABLE_H

#include "base/status.h"

#include <jansson.h>

/* Sets *lines (a new reference) to the lines of the file, each a list of texts; empty lines are left out. A byte order
 * mark is skipped. STATUS_INVALID (a quote that does not end, bytes that are not UTF-8), STATUS_NOT_FOUND, STATUS_IO,
 * STATUS_TOO_LARGE. */
status csv_table_read(const char *path, json_t **lines, struct error *err);

#endif
