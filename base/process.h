/* This process: the processor time and the memory that it has used so far, and the folders of its program, for finding
 * files beside it, and of others. */
#ifndef SELVEDGE_BASE_PROCESS_H
#define SELVEDGE_BASE_PROCESS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct process_use {
    double cpu_s;           /* processor seconds of all its threads, in user and system code */
    int64_t peak_rss_bytes; /* largest resident memory since the program began */
};

struct process_use process_use(void);

/* Writes the folder of this program, without a '/' at its end. Returns false, with "", if it cannot be found or is
 * longer than n_bytes - 1. */
bool program_folder(char *folder, size_t n_bytes);
/* Writes the first folder of PATH that has the program `name`, without a '/' at its end. Returns false, with "", if
 * none has it. */
bool program_find(const char *name, char *folder, size_t n_bytes);

#endif
