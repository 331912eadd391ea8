/* Memory for arrays that may be larger than memory: within a limit they are ordinary pages, beyond it they live in files of a
 * scratch folder that are mapped into the address space. Code reads and writes them as any other memory.
 *
 * The files have no names (they vanish with the process, however it ends), and their blocks are reserved when the array is made, so that a
 * full disk is an error there and never a SIGBUS later. Mapped pages count as resident until they are let go: loops call
 * scratch_keep_within now and then, which drops the mapped pages from the process when it comes near to the limit. Nothing is lost by it,
 * the page cache and the file hold the contents. Threads: all functions may be called from several threads.
 */
#ifndef SELVEDGE_BASE_SCRATCH_SPACE_H
#define SELVEDGE_BASE_SCRATCH_SPACE_H

#include "base/status.h"

struct scratch_space;

/* limit_bytes: of the resident memory of the process, at least 1 MiB. folder (a local file system) must exist. STATUS_INVALID, STATUS_NO_MEMORY. */
status scratch_space_new(const char *folder, size_t limit_bytes, struct scratch_space **space, struct error *err);
/* Releases the arrays that are left. NULL is fine. */
void scratch_space_free(struct scratch_space *space);

/* n_bytes zeros. space == NULL: memory without a limit. STATUS_NO_MEMORY, STATUS_DISK_FULL, STATUS_IO; `what` is named in the text. */
status scratch_new(struct scratch_space *space, size_t n_bytes, const char *what, void **array, struct error *err);
/* array as given by scratch_new (of the same space), or NULL. */
void scratch_release(struct scratch_space *space, void *array);

/* Drops mapped pages when the process has more than 7/8 of the limit resident. Cheap (a microsecond) when there is nothing to do; called
 * at least once for some megabytes touched. */
void scratch_keep_within(struct scratch_space *space);
/* What a step may hold in buffers of its own, in bytes: an eighth of the limit; 256 MiB for space == NULL. */
size_t scratch_buffer_bytes(const struct scratch_space *space);
/* Bytes of all arrays that live in files now. */
size_t scratch_file_bytes(struct scratch_space *space);

#endif
