/* Restricts a process and its children to certain files, by Landlock (Linux 5.13 and later; landlock(7)). A restricted
 * process can also neither connect to a network or a foreign unix socket, nor signal, trace or read the memory and the
 * environment of a process outside, as far as the kernel's version of Landlock covers that. Nothing takes a restriction
 * back. */
#ifndef SELVEDGE_OPTIMIZER_SANDBOX_FILES_H
#define SELVEDGE_OPTIMIZER_SANDBOX_FILES_H

#include "base/status.h"

#include <stddef.h>

enum sandbox_right {
    SANDBOX_READ,      /* read files, list folders */
    SANDBOX_EXECUTE,   /* the same, and execute or map programs and libraries */
    SANDBOX_OVERWRITE, /* read and write existing files, but make none */
    SANDBOX_OWN        /* everything but executing */
};

/* A file, or a folder with all that is in it. A path that does not exist is left out. */
struct sandbox_path {
    enum sandbox_right right;
    const char *path;
};

/* Restricts this thread and all that it starts or executes later; threads that run already stay free. Sets
 * no_new_privs. *version: Landlock's version, or 0 where the kernel has none, which is no error. STATUS_IO. */
status sandbox_files_restrict(const struct sandbox_path *path, size_t n, int *version, struct error *err);

/* Gives up the capabilities of root for the program that this thread executes next, such as that to write to files
 * whose mode forbids it. Needs no_new_privs; of other users it changes nothing. */
void sandbox_files_drop_capabilities(void);

#endif
