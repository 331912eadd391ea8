/* Predicts when a job ends: its stages with the work that they have, the speeds of earlier jobs (speed_book.h), and the
 * speed of this job so far.
 *
 * Before it runs, a stage is expected to take units x seconds per unit, times a factor by which those finished stages
 * of this job were slower than expected whose time hardly varies between jobs. While a stage runs, a second prediction
 * is its elapsed time divided by the share of the time that usually has passed at its fraction. Both predictions are
 * combined, each weighted by its uncertainty (logarithms of times are taken to be normal). A stage that predicts its
 * own end (a fit) has a fraction that runs evenly with time, except for the errors of such predictions in earlier
 * jobs; its time says nothing about the speed of other stages. The stated fraction of the job is elapsed time over
 * elapsed and remaining time; it never falls, and it rises by at most JOB_CLOCK_STEP between two looks and in a
 * second; where a job is short, in a second also by twice the even rate. Nor does it stand still where a job takes
 * longer than expected: it goes on towards 1, which it does not reach, by half of the way in the remaining and half of
 * the elapsed time. Times are of the monotonic clock, in seconds. Not thread-safe.
 */
#ifndef SELVEDGE_OPTIMIZER_JOB_CLOCK_H
#define SELVEDGE_OPTIMIZER_JOB_CLOCK_H

#include "optimizer/stages/run/speed_book.h"

#include <stdbool.h>

enum { JOB_CLOCK_MAX_STAGE = 16 };
#define JOB_CLOCK_STEP 0.04

struct job_clock_stage {
    char key[SPEED_BOOK_KEY_BYTES];
    bool planned, began, ended, loaded; /* loaded: an earlier attempt has done it */
    size_t i_of_plus_one;               /* its units are a share of the time of that stage; 0: they are not */
    bool own_speed;                     /* its units are seconds by this job's own speed: the factor is not applied */
    bool remembered;                    /* its speed is of earlier jobs on this machine */
    bool predicts_end;                  /* job_clock_work.predicts_end */
    double units, expected_s, log_sd;
    double wall_s;                       /* of an ended stage */
    double passed_s[SPEED_CURVE_POINTS]; /* time at which its fraction reached (k + 1) / SPEED_CURVE_POINTS */
    double curve[SPEED_CURVE_POINTS];    /* of earlier jobs; a straight line where there were none */
    double curve_sd;                     /* how uncertain the curve is */
};

struct job_clock {
    struct speed_book book;
    size_t n_stage, i_stage;
    struct job_clock_stage stage[JOB_CLOCK_MAX_STAGE];
    double began_s, stage_began_s; /* of this attempt, of the running stage */
    double from_s, from_share;     /* since when the running stage is measured: not while it replays a journal */
    double fraction, shown;        /* of the running stage, of the job as last stated */
    double looked_s;               /* when it was stated */
};

struct job_clock_look {
    double fraction; /* of the job, in [0, 1) */
    double eta_s;    /* NaN before the first stage is planned */
    double spread;   /* two standard deviations of the logarithm of eta_s, up to three where a stage that is
                                   * left is the first of its kind; at most 3; NaN as eta_s */
    double eta_low_s, eta_high_s; /* that much either way; NaN where it is less than a quarter */
};

/* The work of a stage: units > 0, each of about usual_s seconds where no speed is remembered under the key. log_sd:
 * standard deviation of the logarithm of a stage's time between jobs of all kinds. */
struct job_clock_work {
    const char *key;
    double units, usual_s, log_sd;
    bool predicts_end; /* its fraction is a share of the work that the stage itself expects */
    /* as speed_entry.curve, of jobs on other machines; NULL: a straight line. Where nothing is remembered. */
    const double *usual_curve;
};

/* book: copied. */
void job_clock_init(struct job_clock *c, size_t n_stage, const struct speed_book *book, double now_s);
/* States the work of stage i, which has not begun, or whose work has become known while it runs: its time and its
 * fraction so far then stay. */
void job_clock_plan(struct job_clock *c, size_t i, const struct job_clock_work *work);
/* The same, where units are seconds by the speed that this job has shown. */
void job_clock_plan_own(struct job_clock *c, size_t i, const char *key, double seconds);
/* The same, where the stage takes about a share of the time of the earlier stage i_of. */
void job_clock_plan_share(struct job_clock *c, size_t i, const char *key, double share, size_t i_of);

/* Seconds that a stage is expected to take, its own progress left out; also of a stage that takes a share of another's
 * time; 0 where it is not planned. */
double job_clock_expected_s(const struct job_clock *c, size_t i);
void job_clock_begin(struct job_clock *c, size_t i, double now_s);
void job_clock_fraction(struct job_clock *c, double stage_fraction, double now_s);
/* From here on the running stage is measured anew. */
void job_clock_restart(struct job_clock *c, double now_s);
void job_clock_end(struct job_clock *c, bool loaded, double now_s);
struct job_clock_look job_clock_look(struct job_clock *c, double now_s);

/* Adds the speeds of the stages that this attempt has done as a whole to the book. */
void job_clock_remember(const struct job_clock *c, struct speed_book *book);

#endif
