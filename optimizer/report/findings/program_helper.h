/* Processes that run other programs for a worker: WeasyPrint, which makes report.pdf, and Blender, which makes
 * cloth.blend. A worker in its sandbox starts no programs, so each is started before, in a sandbox of its own
 * (optimizer/worker/sandbox/program_process.h), and waits for its order. */
#ifndef SELVEDGE_OPTIMIZER_PROGRAM_HELPER_H
#define SELVEDGE_OPTIMIZER_PROGRAM_HELPER_H

#include "base/progress.h"

#include <stdbool.h>
#include <sys/types.h>

struct program_helper {
    pid_t pid;    /* 0: none */
    int order_fd; /* a byte written here starts it */
};

struct program_helpers {
    struct program_helper pdf, blend;
};

/* No helpers. */
struct program_helpers program_helpers_none(void);
/* Gives the order and waits for the end of the program. Returns whether the program ended well. One that takes longer
 * than five minutes, or belongs to a cancelled job, ends with the worker. */
bool program_helper_run(const struct program_helper *helper, const struct progress *progress);

#endif
