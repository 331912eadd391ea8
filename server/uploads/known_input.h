/* Inputs whose bytes the server already has, in another job of the same owner, by size and SHA-256. Such an input is a
 * hard link to the bytes of that job, so it takes no space and no upload. Complete inputs are never written: the link
 * has mode 0400, and a worker in its sandbox can neither change a mode nor write against one, as with shared
 * checkpoints (pipeline_adopt.c). Removing one job removes its own name only. */
#ifndef SELVEDGE_SERVER_KNOWN_INPUT_H
#define SELVEDGE_SERVER_KNOWN_INPUT_H

#include "server/store/store.h"

/* Whether a complete input with the size and SHA-256 of `row` is in a job of the owner. */
bool known_input_exists(struct store *store, const char *owner, const struct file_row *row);
/* Makes JOB/input/<name> of `row` a link to such an input and the row complete; the caller syncs the folder. Returns
 * false, with the row as it was, when there is none or it cannot be linked: then the bytes are uploaded. */
bool known_input_link(struct store *store, const char *data, const char *owner, struct file_row *row);

#endif
