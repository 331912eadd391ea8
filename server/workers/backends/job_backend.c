#include "server/workers/backends/job_backend.h"

#include <string.h>

static const struct job_backend *const backend[] = {&backend_local, &backend_slurm};

const struct job_backend *job_backend_find(const char *name)
{
    for (size_t i = 0; i < sizeof backend / sizeof *backend; i++)
        if (strcmp(backend[i]->name, name) == 0) return backend[i];
    return NULL;
}
