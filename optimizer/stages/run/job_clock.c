#include "optimizer/stages/run/job_clock.h"

#include <math.h>
#include <stdio.h>

/* Standard deviations of the logarithm of a time: at least; of the factor by which this job is slower than earlier
 * ones; and of a stage by this job's own speed. The scatter between jobs of all kinds counts as much as the scatter of
 * this many remembered jobs. */
static const double sd_least = 0.08, sd_factor = 0.4, sd_own = 0.3, usual_jobs = 0.5;
/* The same of elapsed time over the passed share x, times (1 - x) / sqrt(x): by a remembered curve; by the
 * stage's own prediction; by a straight line in the first job of a kind; and by a usual curve, taken from four other
 * scans: at half of the fraction of tracing fibers 35 to 73 % of the time had passed, and at two thirds 58 to 95 %. */
static const double sd_by_curve = 0.2, sd_by_line = 0.35, sd_by_first_line = 0.6, sd_by_usual = 1.0;
static const double usual_curve_jobs = 1.0;
/* Share of a stage's time in one of SPEED_CURVE_POINTS parts of its fraction from which on the fraction has waited. */
static const double long_wait = 0.1;
/* A stage whose time varies by more than this between jobs says nothing about the speed of the machine. On one machine
 * the filters of scans took 0.5 to 4.2 times their usual time, while tracing took 1.0 to 1.3 times its usual time. */
static const double most_sd_of_speed = 0.6;
/* Share of a running stage that is taken to be left, also where its fraction says that nothing is. */
static const double least_share = 0.05;
/* The range is two standard deviations either way. In first jobs of a kind it is wider by a half, up to this logarithm:
 * of the remaining times of a table two held 77 %, and this 96 to 100 %. */
static const double sd_of_range = 2.0, wider_in_first = 1.5, most_widened = 1.2;
/* A stage below this many seconds is not remembered and says nothing about the others. */
static const double least_s = 0.3;

void job_clock_init(struct job_clock *c, size_t n_stage, const struct speed_book *book, double now_s)
{
    *c = (struct job_clock){
        .n_stage = n_stage, .began_s = now_s, .looked_s = now_s, .stage_began_s = now_s, .from_s = now_s};
    c->book = *book;
}

/* ---- expectations ---- */

/* Sets the curve of a stage: the share of time over the fraction, from earlier jobs. Where the fraction is the stage's
 * own prediction, that says how such predictions were off, and counts beside the usual curve with its weight in
 * jobs. */
static void set_curve(struct job_clock_stage *s, const struct speed_entry *e, const struct job_clock_work *work)
{
    const double n_usual = e == NULL || work->predicts_end ? usual_curve_jobs : 0.0, n_job = e != NULL ? e->n_job : 0.0;
    s->curve_sd = e != NULL && !work->predicts_end  ? sd_by_curve
                  : work->usual_curve != NULL       ? sd_by_usual
                  : e != NULL || work->predicts_end ? sd_by_line
                                                    : sd_by_first_line;
    for (size_t k = 0; k < SPEED_CURVE_POINTS; k++) {
        const double straight = (double)(k + 1) / SPEED_CURVE_POINTS;
        const double usual = work->usual_curve != NULL ? work->usual_curve[k] : straight;
        s->curve[k] = (n_job * (e != NULL ? e->curve[k] : 0.0) + n_usual * usual) / (n_job + n_usual);
    }
}

void job_clock_plan(struct job_clock *c, size_t i, const struct job_clock_work *work)
{
    struct job_clock_stage *s = &c->stage[i];
    const struct speed_entry *e = speed_book_find(&c->book, work->key);
    snprintf(s->key, sizeof s->key, "%s", work->key);
    s->planned = true;
    s->own_speed = false;
    s->remembered = e != NULL;
    s->predicts_end = work->predicts_end;
    s->i_of_plus_one = 0;
    s->units = work->units;
    s->expected_s = work->units * (e != NULL ? exp(e->log_s_per_unit) : work->usual_s);
    s->log_sd = work->log_sd;
    if (e != NULL) {
        double var = (usual_jobs * work->log_sd * work->log_sd + e->n_job * e->log_var) / (usual_jobs + e->n_job);
        s->log_sd = sqrt(sd_least * sd_least + var * (1.0 + 1.0 / e->n_job));
    }
    set_curve(s, e, work);
}

void job_clock_plan_own(struct job_clock *c, size_t i, const char *key, double seconds)
{
    const struct job_clock_work work = {.key = key, .units = seconds, .usual_s = 1.0, .log_sd = sd_own};
    job_clock_plan(c, i, &work);
    c->stage[i].own_speed = true;
    c->stage[i].log_sd = fmin(c->stage[i].log_sd, sd_own);
}

/* Factor by which the stages of this job take longer than expected, shrunk towards 1 where few stages have ended.
 * *log_sd: standard deviation of its logarithm. */
static double slower_by(const struct job_clock *c, double *log_sd)
{
    double sum = 0.0, weight = 1.0 / (sd_factor * sd_factor);
    for (size_t i = 0; i < c->n_stage; i++) {
        const struct job_clock_stage *s = &c->stage[i];
        if (!s->ended || s->loaded || s->own_speed || s->predicts_end || !(s->wall_s >= least_s) ||
            !(s->expected_s > 0.0) || s->log_sd > most_sd_of_speed)
            continue;
        double w = 1.0 / (s->log_sd * s->log_sd);
        sum += w * log(s->wall_s / s->expected_s);
        weight += w;
    }
    *log_sd = 1.0 / sqrt(weight);
    return exp(sum / weight);
}

void job_clock_plan_share(struct job_clock *c, size_t i, const char *key, double share, size_t i_of)
{
    job_clock_plan_own(c, i, key, share);
    c->stage[i].i_of_plus_one = i_of + 1;
}

static double expected_s(const struct job_clock *c, const struct job_clock_stage *s)
{
    double unused;
    return s->planned ? s->expected_s * (s->own_speed ? 1.0 : slower_by(c, &unused)) : 0.0;
}

/* Share of the stage's time that has passed at a fraction. likely: the share by its elapsed time. Where the fraction of
 * earlier jobs has waited, as between the parts of a stage, the share may lie anywhere in the waiting. */
static double share_at(const struct job_clock_stage *s, double fraction, double likely)
{
    double x = fmin(fmax(fraction, 0.0), 1.0) * SPEED_CURVE_POINTS;
    size_t k = (size_t)x;
    if (k >= SPEED_CURVE_POINTS) return s->curve[SPEED_CURVE_POINTS - 1];
    double before = k > 0 ? s->curve[k - 1] : 0.0;
    if (s->curve[k] - before > long_wait) return fmin(fmax(likely, before), s->curve[k]);
    return before + (x - (double)k) * (s->curve[k] - before);
}

/* Share of the running stage's time that has passed at now_s. */
static double running_share(const struct job_clock *c, double now_s)
{
    const struct job_clock_stage *s = &c->stage[c->i_stage];
    const double since = (now_s - c->from_s) / fmax(expected_s(c, s), 1e-3);
    return share_at(s, c->fraction, c->from_share + since);
}

/* ---- the stages as they run ---- */

void job_clock_begin(struct job_clock *c, size_t i, double now_s)
{
    c->i_stage = i;
    c->stage[i].began = true;
    c->stage_began_s = c->from_s = now_s;
    c->from_share = c->fraction = 0.0;
    for (size_t k = 0; k < SPEED_CURVE_POINTS; k++) c->stage[i].passed_s[k] = NAN;
}

void job_clock_fraction(struct job_clock *c, double stage_fraction, double now_s)
{
    struct job_clock_stage *s = &c->stage[c->i_stage];
    c->fraction = fmax(c->fraction, fmin(stage_fraction, 1.0));
    for (size_t k = 0; k < SPEED_CURVE_POINTS; k++)
        if (isnan(s->passed_s[k]) && c->fraction * SPEED_CURVE_POINTS >= (double)(k + 1))
            s->passed_s[k] = now_s - c->stage_began_s;
}

void job_clock_restart(struct job_clock *c, double now_s)
{
    const struct job_clock_stage *s = &c->stage[c->i_stage];
    c->from_s = now_s;
    c->from_share = share_at(s, c->fraction, c->fraction);
}

void job_clock_end(struct job_clock *c, bool loaded, double now_s)
{
    struct job_clock_stage *s = &c->stage[c->i_stage];
    s->ended = true;
    s->loaded = loaded;
    s->wall_s = now_s - c->stage_began_s;
    for (size_t k = 0; k < SPEED_CURVE_POINTS; k++)
        if (isnan(s->passed_s[k])) s->passed_s[k] = s->wall_s;
    if (c->from_share > 0.0) s->loaded = true; /* it replayed a journal, so its time says nothing */
}

/* Expected time of the running stage as a whole, and the standard deviation of its logarithm. */
static double running_s(const struct job_clock *c, double now_s, double *log_sd)
{
    const struct job_clock_stage *s = &c->stage[c->i_stage];
    const double share = running_share(c, now_s), passed = share - c->from_share, elapsed_s = now_s - c->from_s;
    double total = fmax(expected_s(c, s), 1e-3);
    *log_sd = hypot(s->log_sd, s->own_speed ? 0.0 : sd_least);
    if (passed > 0.0 && elapsed_s > 0.0) {
        double sd = s->curve_sd * (1.0 - share) / sqrt(fmax(passed, 1e-6)) + 0.01;
        double w = 1.0 / (sd * sd), w_before = 1.0 / (*log_sd * *log_sd);
        total = exp((w * log(elapsed_s / passed) + w_before * log(total)) / (w + w_before));
        *log_sd = 1.0 / sqrt(w + w_before);
    }
    return total;
}

/* Remaining time, and its standard deviation. */
static double remaining_s(const struct job_clock *c, double now_s, double *sd_s)
{
    const struct job_clock_stage *s = &c->stage[c->i_stage];
    double sum = 0.0, var = 0.0, log_sd, total = 0.0, running_log_sd = 0.0, unknown = 0.0;
    const bool runs = s->began && !s->ended;
    if (runs) {
        const double share = running_share(c, now_s);
        total = running_s(c, now_s, &running_log_sd);
        const double elapsed_s = now_s - c->from_s, rest = total * (1.0 - c->from_share) - elapsed_s;
        sum = fmax(rest, 0.5 * fmax(1.0 - share, least_share) * fmax(total, elapsed_s));
        /* in a first job the fraction itself is doubted to the end */
        const double doubted = s->remembered ? 1.0 - share : 1.0;
        var = total * running_log_sd * total * running_log_sd * doubted * doubted;
    }
    for (size_t i = 0; i < c->n_stage; i++) {
        const struct job_clock_stage *later = &c->stage[i];
        if (later->began || !later->planned) continue;
        double rest = expected_s(c, later);
        log_sd = later->log_sd;
        if (later->i_of_plus_one > 0) {
            const struct job_clock_stage *of = &c->stage[later->i_of_plus_one - 1];
            rest *= of == s && runs ? total : expected_s(c, of);
            log_sd = hypot(log_sd, of == s && runs ? running_log_sd : of->log_sd);
        }
        sum += rest;
        var += rest * log_sd * rest * log_sd;
        if (!later->remembered && !later->own_speed) unknown += rest;
    }
    slower_by(c, &log_sd);
    *sd_s = hypot(sqrt(var), unknown * log_sd); /* how fast this machine is enters all stages alike */
    return sum;
}

double job_clock_expected_s(const struct job_clock *c, size_t i)
{
    const struct job_clock_stage *s = &c->stage[i];
    return expected_s(c, s) * (s->i_of_plus_one > 0 ? expected_s(c, &c->stage[s->i_of_plus_one - 1]) : 1.0);
}

/* Time that the job has taken, with the expected time of the stages that earlier attempts did. */
static double taken_s(const struct job_clock *c, double now_s)
{
    double taken = now_s - c->began_s;
    for (size_t i = 0; i < c->n_stage; i++)
        if (c->stage[i].ended && c->stage[i].loaded) taken += expected_s(c, &c->stage[i]);
    const struct job_clock_stage *s = &c->stage[c->i_stage];
    if (s->began && !s->ended && c->from_share > 0.0) taken += c->from_share * expected_s(c, s);
    return taken;
}

/* Whether a stage that is left is the first of its kind on this machine. */
static bool is_first(const struct job_clock *c)
{
    for (size_t i = 0; i < c->n_stage; i++) {
        const struct job_clock_stage *s = &c->stage[i];
        if (s->planned && !s->ended && !s->remembered && !s->own_speed && expected_s(c, s) >= least_s) return true;
    }
    return false;
}

struct job_clock_look job_clock_look(struct job_clock *c, double now_s)
{
    struct job_clock_look look = {.spread = NAN, .eta_s = NAN, .eta_low_s = NAN, .eta_high_s = NAN};
    double sd_s, rest = remaining_s(c, now_s, &sd_s), taken = taken_s(c, now_s);
    if (rest > 0.0) {
        look.eta_s = rest;
        look.spread = fmin(sd_of_range * sd_s / rest, 3.0);
        if (is_first(c)) look.spread = fmin(wider_in_first * look.spread, fmax(look.spread, most_widened));
        if (look.spread > 0.25) {
            look.eta_low_s = rest * exp(-look.spread);
            look.eta_high_s = rest * exp(look.spread);
        }
        const double passed_s = now_s - c->looked_s,
                     creep = (1.0 - c->shown) * fmin(0.5 * passed_s / (rest + 0.5 * taken), 0.5);
        const double step = fmin(fmax(1.0, 2.0 / JOB_CLOCK_STEP / (taken + rest)) * passed_s, 1.0) * JOB_CLOCK_STEP;
        c->shown += fmin(fmax(taken / (taken + rest) - c->shown, creep), step);
    }
    c->looked_s = now_s;
    look.fraction = c->shown;
    return look;
}

void job_clock_remember(const struct job_clock *c, struct speed_book *book)
{
    for (size_t i = 0; i < c->n_stage; i++) {
        const struct job_clock_stage *s = &c->stage[i];
        double curve[SPEED_CURVE_POINTS];
        if (!s->planned || !s->ended || s->loaded || !(s->wall_s >= least_s) || !(s->units > 0.0)) continue;
        for (size_t k = 0; k < SPEED_CURVE_POINTS; k++) curve[k] = fmin(s->passed_s[k] / s->wall_s, 1.0);
        speed_book_add(book, s->key, s->wall_s, s->units, curve);
    }
}
