/* Processor time and memory that this process has used so far. */
#ifndef SELVEDGE_BASE_PROCESS_USE_H
#define SELVEDGE_BASE_PROCESS_USE_H

#include <stdint.h>

struct process_use {
    double cpu_s;           /* processor seconds of all its threads, in user and system code */
    int64_t peak_rss_bytes; /* largest resident memory since the program began */
};

struct process_use process_use(void);

#endif
