/* Inputs that the server already has in another job of the same owner, found by size and SHA-256. Such an input is a
 * hard link to the file of the other job, so it takes no space and no upload. Complete inputs are never written: they
 * have mode 0400, and a worker in its sandbox can neither change a mode nor write against one, as with shared
 * checkpoints (pipeline_adopt.c). It can put another file in the place of an input of its own job; such a file lacks
 * the seal of upload_file.h and is not linked. Removing one job removes its own name only. */
#ifndef SELVEDGE_SERVER_KNOWN_INPUT_H
#define SELVEDGE_SERVER_KNOWN_INPUT_H

#include "server/store/store.h"

/* Finds a complete input with a SHA-256 in a job of the owner that is as it was uploaded. data: the data folder.
 * STATUS_NOT_FOUND. */
status known_input_find(struct store *store, const char *data, const char *owner, const char *sha256,
                        struct file_row *source, struct error *err);
/* Whether there is such an input with the size and SHA-256 of `row`. */
bool known_input_exists(struct store *store, const char *data, const char *owner, const struct file_row *row);
/* Makes JOB/input/<name> of `row` a link to such an input and the row complete; the caller syncs the folder. Returns
 * false, with the row as it was, when there is none or it cannot be linked: then the bytes are uploaded. */
bool known_input_link(struct store *store, const char *data, const char *owner, struct file_row *row);

#endif
