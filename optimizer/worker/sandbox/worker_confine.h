/* Puts a worker into its sandbox before it opens a file of a user other than the job document, which the daemon has
 * parsed too. The worker reads and writes its job's folder alone, and makes only the system calls that it needs. It is
 * restricted in two steps: worker_confine restricts its files and executes the program again, because libraries start
 * threads before main, which a restriction of the running process would not reach; the program then restricts the
 * calls of all threads. */
#ifndef SELVEDGE_OPTIMIZER_WORKER_CONFINE_H
#define SELVEDGE_OPTIMIZER_WORKER_CONFINE_H

#include "base/status.h"
#include "optimizer/report/findings/program_helper.h"

#include <stdbool.h>
#include <stddef.h>

/* A worker runs without a sandbox, with the parts of it that the kernel offers, or only where the kernel offers all
 * parts. */
enum confine_mode { CONFINE_OFF, CONFINE_AUTO, CONFINE_REQUIRED };

/* Files of a worker. A check reads the folder and the document; a job has the whole folder. */
struct confine_files {
    const char *folder;
    const char *document; /* of a check; NULL: the job of the folder is run */
    const char *speeds;   /* NULL: none. Made when it is missing. */
    bool none;            /* of a rank that sees no file of the job */
    bool no_links;        /* links of inputs out of the folder stay out of reach: a worker may have made them */
};

/* The parts of the sandbox that are in force; files_version is Landlock's, 0: files are not restricted. */
struct confinement {
    bool executed; /* this is the program that worker_confine has executed */
    int files_version;
    bool calls;
    struct program_helpers helper;
};

/* Reads "off", "auto" or "required". */
bool confine_mode_parse(const char *text, enum confine_mode *mode);
/* Does the work that the sandbox forbids later (starts the helpers for other programs, links an adopted geometry),
 * restricts the files and executes the program with the same arguments and "--confined STATE". Returns only on failure.
 */
status worker_confine(const struct confine_files *files, char **argv, struct error *err);
/* Only the preparations, for a worker without a sandbox. */
void worker_prepare(const char *folder, struct confinement *confinement);
/* Reads STATE. */
bool confinement_parse(const char *state, struct confinement *confinement);
/* Restricts the system calls of all threads. STATUS_UNSUPPORTED: mode is CONFINE_REQUIRED, and the kernel, or this
 * build, lacks a part of the sandbox. */
status confinement_complete(struct confinement *confinement, enum confine_mode mode, struct error *err);
/* Describes the sandbox in a sentence. Returns whether it is complete. */
bool confinement_describe(const struct confinement *confinement, enum confine_mode mode, char *text, size_t n_bytes);

#endif
