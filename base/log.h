/* Line-oriented, thread-safe log to a file (appended) or a stream: "2026-11-21T10:20:30.123Z INFO text\n". */
#ifndef SELVEDGE_BASE_LOG_H
#define SELVEDGE_BASE_LOG_H

#include "base/status.h"

#include <stdio.h>

enum log_level { LOG_LEVEL_DEBUG, LOG_LEVEL_INFO, LOG_LEVEL_WARNING, LOG_LEVEL_ERROR };

struct log;

/* Opens a log that appends to path (NULL: to no file) and copies each line to `also`, a stream such as stderr, or
 * NULL. Messages below the level `least` are dropped. STATUS_NO_MEMORY, STATUS_IO. */
status log_open(const char *path, FILE *also, enum log_level least, struct log **log, struct error *err);
void log_close(struct log *log);
/* Writes one line. Newlines in the text become spaces. log == NULL: nothing happens. */
void log_write(struct log *log, enum log_level level, const char *format, ...) __attribute__((format(printf, 3, 4)));

#define log_info(log, ...) log_write((log), LOG_LEVEL_INFO, __VA_ARGS__)
#define log_warning(log, ...) log_write((log), LOG_LEVEL_WARNING, __VA_ARGS__)
#define log_error(log, ...) log_write((log), LOG_LEVEL_ERROR, __VA_ARGS__)

#endif
