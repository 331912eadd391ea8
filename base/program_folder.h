/* The folder in which the running program is installed, for finding files beside it. */
#ifndef SELVEDGE_BASE_PROGRAM_FOLDER_H
#define SELVEDGE_BASE_PROGRAM_FOLDER_H

#include <stdbool.h>
#include <stddef.h>

/* Writes the folder of this program, without a '/' at its end. Returns false, with "", if it cannot be found or is
 * longer than n_bytes - 1. */
bool program_folder(char *folder, size_t n_bytes);

#endif
