/* The archive of a U3M material and its pictures in one file: the part of the zip format that U3M 1.1
 * (u3m_additional_spec_u3ma.txt) allows. Names are UTF-8, sizes stand before the data, there are no extra
 * fields, comments or attributes, and times are UTC. That is less than libarchive writes. Nothing is compressed,
 * because the pictures are already. */
#ifndef SELVEDGE_OPTIMIZER_U3MA_FILE_H
#define SELVEDGE_OPTIMIZER_U3MA_FILE_H

#include "base/status.h"

#include <stddef.h>
#include <time.h>

/* Writes n files of a folder. now: their time. STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY; STATUS_TOO_LARGE for 4 GB
 * or more. */
status u3ma_file_write(const char *path, const char *folder, const char *const *name, size_t n, time_t now,
                       struct error *err);

#endif
