#include "base/files/reading_note.h"
#include "base/files/durable.h"

#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { NOTE_BYTES = 400 };

static _Thread_local char note[NOTE_BYTES];
void reading_note_set(const char *reader, const char *path)
{
    char text[NOTE_BYTES];
    if (reader == NULL) {
        note[0] = '\0';
        return;
    }
    snprintf(text, sizeof text, " while it read '%.300s' (%.60s)", path_file_name(path), reader);
    for (char *c = text; *c != '\0'; c++) /* the note also goes into JSON, and to a terminal */
        if ((unsigned char)*c < 0x20 || *c == '"' || *c == '\\' || *c == 0x7f) *c = '?';
    memcpy(note, text, sizeof note);
}

const char *reading_note_text(void) { return note; }

#ifndef SELVEDGE_NO_SANDBOX

static bool writes_report;

/* Appends text to a buffer of n_room bytes, from which n are used. Returns the new number. */
static size_t append(char *to, size_t n, size_t n_room, const char *text)
{
    while (*text != '\0' && n < n_room) to[n++] = *text++;
    return n;
}

static void put(int fd, const char *before, const char *after)
{
    char text[2 * NOTE_BYTES];
    size_t n = append(text, 0, sizeof text, before);
    n = append(text, n, sizeof text, note);
    n = append(text, n, sizeof text, after);
    if (write(fd, text, n) < 0) {
        /* nothing else can be done */
    }
}

/* Only calls that may be made in a signal handler. */
static void on_crash(int signal_number)
{
    put(STDERR_FILENO, "selvedge-worker: it crashed", "\n");
    if (writes_report)
        put(STDOUT_FILENO,
            "{\"faults\": [{\"code\": \"worker_lost\", \"field\": \"\", \"detail\": \"the program that reads the files "
            "crashed",
            "\"}], \"warnings\": [], \"files\": [], \"n_file\": 0}\n");
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

void reading_note_on_crash(bool as_report)
{
    static const int number[] = {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT};
    struct sigaction action = {.sa_handler = on_crash, .sa_flags = (int)SA_RESETHAND};
    writes_report = as_report;
    for (size_t i = 0; i < sizeof number / sizeof *number; i++) sigaction(number[i], &action, NULL);
}

#else

void reading_note_on_crash(bool as_report) { (void)as_report; }

#endif
