/* console.txt of a job: stdout and stderr of its last worker. The worker appends; the daemon keeps the file small, so
 * that a worker that writes without end fills no disk. */
#ifndef SELVEDGE_SERVER_CONSOLE_H
#define SELVEDGE_SERVER_CONSOLE_H

#include <stddef.h>

enum { CONSOLE_MOST_BYTES = 1 << 20, CONSOLE_KEEP_BYTES = 64 << 10 };

/* Drops all but the last CONSOLE_KEEP_BYTES of a file of more than CONSOLE_MOST_BYTES. To be called repeatedly while
 * the worker runs; bytes that it writes during the call itself may be lost. */
void console_trim(const char *path);
/* Copies the end of the file as one line of UTF-8 without control characters; "" when there is none. */
void console_tail(const char *path, char *out, size_t n_out);

#endif
