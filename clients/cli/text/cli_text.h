/* Formats sizes, durations, progress bars and values with errors for people. All functions only write to the buffer
 * of the caller. */
#ifndef SELVEDGE_CLIENTS_CLI_TEXT_H
#define SELVEDGE_CLIENTS_CLI_TEXT_H

#include <stddef.h>

enum { CLI_SHORT_TEXT = 48 };

/* 1234567 -> "1.23 MB"; n_bytes < 0: "?". */
void text_size(double n_bytes, char out[CLI_SHORT_TEXT]);
/* 83 -> "1:23", 7500 -> "2:05:00"; NaN or negative: "-". */
void text_duration(double s, char out[CLI_SHORT_TEXT]);
/* "[#####-----]", of width columns in total (at least 3). fraction is clamped to 0..1; NaN counts as 0. */
void text_bar(double fraction, size_t width, char *out, size_t n_out);
/* "0.0236 +- 0.0008": two digits of the standard error, and the value to the same place. Without a standard error,
 * four significant digits. */
void text_with_error(double value, double standard_error, char out[CLI_SHORT_TEXT]);
/* Copies a text and replaces control characters (terminal escapes from a server or a file name) and invalid UTF-8 by
 * '?'. */
void text_clean(const char *in, char *out, size_t n_out);

/* The state of a watched job; NaN, "" or -1 for a member that it does not have. */
struct job_view {
    char state[24], stage[40], message[200];
    double fraction, eta_s, eta_low_s, eta_high_s; /* low, high: NaN where the remaining time is known well */
    double objective, objective_se;
    long step, i_stage, n_stage;
};
/* Writes one line of at most n_column columns: bar, percentage, stage, ETA, step and objective. */
void text_progress(const struct job_view *v, size_t n_column, char *out, size_t n_out);
/* The same without a bar, for logs. */
void text_progress_plain(const struct job_view *v, char *out, size_t n_out);

#endif
