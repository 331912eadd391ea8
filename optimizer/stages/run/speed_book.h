/* Speeds that jobs on this machine have had: seconds for each unit of work of a stage, with their scatter, and how the
 * time of a stage runs over its fraction. One small JSON file, shared by the jobs of a store; a file that is missing
 * or damaged is an empty book. Every entry is a mean of ln(seconds per unit) over the last SPEED_BOOK_MEMORY jobs. */
#ifndef SELVEDGE_OPTIMIZER_SPEED_BOOK_H
#define SELVEDGE_OPTIMIZER_SPEED_BOOK_H

#include "base/status.h"

#include <stddef.h>

enum { SPEED_BOOK_MAX_ENTRY = 64, SPEED_BOOK_KEY_BYTES = 96, SPEED_BOOK_MEMORY = 8, SPEED_CURVE_POINTS = 20 };

struct speed_entry {
    char key[SPEED_BOOK_KEY_BYTES]; /* "fibers", "fit.gauss_newton.v1" */
    double n_job;                   /* at most SPEED_BOOK_MEMORY */
    double log_s_per_unit, log_var; /* mean, and variance between jobs */
    /* share of the stage's time that has passed when its fraction is (k + 1) / SPEED_CURVE_POINTS; rises to 1 */
    double curve[SPEED_CURVE_POINTS];
};

struct speed_book {
    size_t n;
    struct speed_entry entry[SPEED_BOOK_MAX_ENTRY];
};

void speed_book_read(const char *path, struct speed_book *book);
/* Overwrites the file in place, under a lock. Books of jobs that end at the same time overwrite each other, which loses
 * one job's speeds. */
status speed_book_write(const char *path, const struct speed_book *book, struct error *err);
/* NULL when there is none. */
const struct speed_entry *speed_book_find(const struct speed_book *book, const char *key);
/* Adds the measurement of one job: seconds > 0 and units > 0. A full book forgets its first entry. */
void speed_book_add(struct speed_book *book, const char *key, double seconds, double units,
                    const double curve[SPEED_CURVE_POINTS]);

#endif
