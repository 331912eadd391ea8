/* Restricts a process to the system calls that it needs, by seccomp through libseccomp. */
#ifndef SELVEDGE_OPTIMIZER_SANDBOX_CALLS_H
#define SELVEDGE_OPTIMIZER_SANDBOX_CALLS_H

#include "base/status.h"

#include <stdbool.h>

/* Restricts all threads of a worker. A call that only hostile input would make (to execute a program, to open a socket,
 * to trace a process ...) ends the process by SIGSYS, after a line on stderr that names the call. Any other call that
 * the worker has no use for fails with ENOSYS. *restricted: false where the kernel lacks seccomp, which is no error.
 * STATUS_NO_MEMORY, STATUS_IO. */
status sandbox_calls_of_worker(bool *restricted, struct error *err);

/* Restricts a program that a worker starts: no sockets, and no access to other processes. Fails like the above. */
status sandbox_calls_of_program(bool *restricted, struct error *err);

#endif
