/* Ledgers of files (base/files/file_ledger.h) as JSON. */
#ifndef SELVEDGE_BASE_FILE_LEDGER_JSON_H
#define SELVEDGE_BASE_FILE_LEDGER_JSON_H

#include "base/files/file_ledger.h"

#include <jansson.h>

/* Appends {"file", "statements": [{"name", "value", "use": "applied" or "not_used", "reason"}]} to `files`, unless the
 * ledger is empty or the list has the file already. files may be NULL. */
void file_ledger_append(json_t *files, const char *file, const struct file_ledger *ledger);
/* Returns the statements of all files as sentences for people, equal statements of several files as one:
 * "scan.tif states voxel size 2 x 2 x 2 um: applied"; "a.jpg and 11 other files state orientation 6: not used, REASON".
 * Statements that are not used come first. */
json_t *file_ledger_sentences(const json_t *files);
/* Takes everything out of a foreign list of that kind which has not its form. */
void file_ledgers_keep(json_t *files);

#endif
