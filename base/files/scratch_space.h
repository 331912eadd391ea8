/* Arrays that may exceed main memory. Within a limit they are ordinary memory; beyond it they live in files of a
 * scratch folder that are mapped into the address space. Code reads and writes both kinds in the same way.
 *
 * The files have no names, so they vanish with the process however it ends. Their blocks are reserved when the array
 * is made, so a full disk is an error at that point and never a SIGBUS later. Mapped pages count as resident until
 * they are dropped. Loops therefore call scratch_keep_within regularly; it drops the mapped pages from the process
 * when its size comes near the limit. No data is lost, because the page cache and the file hold the contents. All
 * functions may be called from several threads. */
#ifndef SELVEDGE_BASE_SCRATCH_SPACE_H
#define SELVEDGE_BASE_SCRATCH_SPACE_H

#include "base/status.h"

struct scratch_space;

/* limit_bytes limits the resident memory of the process; it is at least 1 MiB. folder must exist on a local file
 * system. STATUS_INVALID, STATUS_NO_MEMORY. */
status scratch_space_new(const char *folder, size_t limit_bytes, struct scratch_space **space, struct error *err);
/* Bounds the bytes of all arrays in files; 0: only the disk does. */
void scratch_space_bound(struct scratch_space *space, size_t most_file_bytes);
/* Checks, before work begins, that arrays of n_bytes in all would fit into memory, or else into files and the free
 * space of the disk. STATUS_TOO_LARGE. */
status scratch_check(struct scratch_space *space, double n_bytes, const char *what, struct error *err);
/* Also releases the arrays that are still allocated. Accepts NULL. */
void scratch_space_free(struct scratch_space *space);

/* Makes an array of n_bytes zeros. space == NULL: ordinary memory without a limit. Error texts name the array by the
 * third argument. STATUS_NO_MEMORY, STATUS_DISK_FULL, STATUS_TOO_LARGE (scratch_space_bound), STATUS_IO. */
status scratch_new(struct scratch_space *space, size_t n_bytes, const char *what, void **array, struct error *err);
/* Releases an array that scratch_new returned for the same space. Accepts NULL. */
void scratch_release(struct scratch_space *space, void *array);

/* Drops the mapped pages when the process has more than 7/8 of the limit resident. Costs about a microsecond when
 * there is nothing to drop, so loops call it at least once for every few megabytes that they touch. */
void scratch_keep_within(struct scratch_space *space);
/* Returns how many bytes a step may hold in buffers of its own: an eighth of the limit, or 256 MiB for space ==
 * NULL. */
size_t scratch_buffer_bytes(const struct scratch_space *space);
/* Returns the bytes of all arrays that are in files at present. */
size_t scratch_file_bytes(struct scratch_space *space);
/* Returns the most bytes that all arrays have had at one time, in memory and in files. */
size_t scratch_most_bytes(struct scratch_space *space);

#endif
