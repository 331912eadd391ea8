/* Checkpoint files of stages: named sections of bytes with a checksum, written as a whole (temporary file, fsync,
 * rename). Scratch of one machine and one program: host byte order, plain structs. A file with another tag, another
 * size of a fixed section or a wrong checksum is refused, and the stage runs again.
 */
#ifndef SELVEDGE_OPTIMIZER_WORK_FILE_H
#define SELVEDGE_OPTIMIZER_WORK_FILE_H

#include "base/files/scratch_space.h"
#include "base/status.h"

enum { WORK_FILE_MAX_SECTION = 160, WORK_FILE_TAG_BYTES = 16 };

struct work_section {
    void *data;
    size_t n_bytes;
    struct scratch_space *space; /* scratch space of data; NULL: data is plain memory */
};

/* tag: content and version of the file, such as "fibers.1". STATUS_IO, STATUS_DISK_FULL; STATUS_INTERNAL for more
 * than WORK_FILE_MAX_SECTION sections, here and below. */
status work_file_write(const char *path, const char *tag, const struct work_section *section, size_t n_section,
                       struct error *err);
/* Reads all sections. If section[i].data is NULL, memory is taken from the section's space (release it by
 * scratch_release, or by free() without a space) and n_bytes is set; otherwise the stored size must be n_bytes. After
 * an error there is nothing to free, and given data are unchanged. STATUS_NOT_FOUND when there is no file;
 * STATUS_FORMAT, STATUS_CHECKSUM. */
status work_file_read(const char *path, const char *tag, struct work_section *section, size_t n_section,
                      struct error *err);

#endif
