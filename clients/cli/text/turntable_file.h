/* An animated WebP file from PNG files: `selvedge render --turntable`. */
#ifndef SELVEDGE_CLIENTS_TURNTABLE_FILE_H
#define SELVEDGE_CLIENTS_TURNTABLE_FILE_H

#include "base/status.h"

#include <stddef.h>

/* Writes `path` with the pictures FOLDER/on-1.png .. on-N.png, all of one size, `frame_ms` each, for ever. *n_byte: of
 * the file. STATUS_IO and STATUS_FORMAT name a file, STATUS_NO_MEMORY. */
status turntable_file_write(const char *folder, size_t n, int frame_ms, const char *path, size_t *n_byte,
                            struct error *err);

#endif
