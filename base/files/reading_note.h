/* Names the file that a reader is reading, so that the user hears of it when the reader crashes.
 *
 * Readers of foreign files set the note before they call a library, and clear it afterwards. The note belongs to the
 * calling thread, in which a fault of the reader is raised. */
#ifndef SELVEDGE_BASE_READING_NOTE_H
#define SELVEDGE_BASE_READING_NOTE_H

#include <stdbool.h>

/* reader: "PNG photograph"; path: of the file, whose name alone is kept. reader NULL clears the note. */
void reading_note_set(const char *reader, const char *path);
/* Returns " while it read 'FILE' (READER)", "" where this thread reads nothing. Safe in a signal handler. */
const char *reading_note_text(void);
/* Makes SIGSEGV, SIGBUS, SIGILL, SIGFPE and SIGABRT write a line with the note to stderr before they end the process.
 * as_report: also a report of one fault to stdout, in the form of `selvedge-worker --check`. Does nothing in builds
 * with sanitizers, which have handlers of their own. */
void reading_note_on_crash(bool as_report);

#endif
