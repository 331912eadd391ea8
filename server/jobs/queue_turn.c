#include "server/jobs/queue_turn.h"

#include <stdlib.h>
#include <string.h>

/* The queued jobs of an owner and a batch: `at` is the first one that was not passed over, of [first, end). */
struct line {
    size_t at, end, i_owner;
    int n_running;
    double last_start_unix_s;
};

struct owner {
    size_t first, end; /* of its lines */
    int n_running;
    double last_start_unix_s;
};

struct queue_turn {
    const struct queued_job *job;
    size_t n, n_line, n_owner;
    struct line *line;
    struct owner *owner;
    bool *passed;
};

static void add_job(struct queue_turn *t, size_t i)
{
    const struct queued_job *job = &t->job[i], *before = i == 0 ? NULL : &t->job[i - 1];
    const bool same_owner = before != NULL && strcmp(before->owner, job->owner) == 0;
    if (!same_owner) t->owner[t->n_owner++] = (struct owner){.first = t->n_line, .end = t->n_line};
    struct owner *owner = &t->owner[t->n_owner - 1];
    if (!same_owner || strcmp(before->batch, job->batch) != 0) {
        t->line[t->n_line] =
            (struct line){.at = i, .end = i, .i_owner = t->n_owner - 1, .last_start_unix_s = job->last_start_unix_s};
        owner->end = ++t->n_line;
        if (job->last_start_unix_s > owner->last_start_unix_s) owner->last_start_unix_s = job->last_start_unix_s;
    }
    t->line[t->n_line - 1].end = i + 1;
}

struct queue_turn *queue_turn_new(const struct queued_job *job, size_t n)
{
    struct queue_turn *t = calloc(1, sizeof *t);
    if (t == NULL) return NULL;
    t->job = job;
    t->n = n;
    t->line = calloc(n + 1, sizeof *t->line);
    t->owner = calloc(n + 1, sizeof *t->owner);
    t->passed = calloc(n + 1, sizeof *t->passed);
    if (t->line == NULL || t->owner == NULL || t->passed == NULL) {
        queue_turn_free(t);
        return NULL;
    }
    for (size_t i = 0; i < n; i++) add_job(t, i);
    return t;
}

void queue_turn_free(struct queue_turn *t)
{
    if (t == NULL) return;
    free(t->line);
    free(t->owner);
    free(t->passed);
    free(t);
}

void queue_turn_skip(struct queue_turn *t, size_t i_job) { t->passed[i_job] = true; }

void queue_turn_running(struct queue_turn *t, const char *owner, const char *batch, int n)
{
    for (size_t i = 0; i < t->n_line; i++) {
        const struct queued_job *job = &t->job[t->line[i].end - 1];
        if (strcmp(job->owner, owner) != 0) continue;
        if (strcmp(job->batch, batch) == 0) t->line[i].n_running += n;
        if (t->owner[t->line[i].i_owner].first == i) t->owner[t->line[i].i_owner].n_running += n;
    }
}

/* Whether one with these numbers comes before another. */
static bool before(int n_running, double last_start, double queued, int than_running, double than_start,
                   double than_queued)
{
    if (n_running != than_running) return n_running < than_running;
    if (last_start != than_start) return last_start < than_start;
    return queued < than_queued;
}

/* The line of an owner that comes next; NULL: all its jobs were passed over. */
static struct line *next_line(struct queue_turn *t, const struct owner *owner)
{
    struct line *best = NULL;
    for (size_t i = owner->first; i < owner->end; i++) {
        struct line *line = &t->line[i];
        while (line->at < line->end && t->passed[line->at]) line->at++;
        if (line->at == line->end) continue;
        const struct queued_job *job = &t->job[line->at], *other = best == NULL ? NULL : &t->job[best->at];
        if (best == NULL || job->priority > other->priority ||
            (job->priority == other->priority &&
             before(line->n_running, line->last_start_unix_s, job->queued_unix_s, best->n_running,
                    best->last_start_unix_s, other->queued_unix_s)))
            best = line;
    }
    return best;
}

size_t queue_turn_next(struct queue_turn *t, double now_unix_s)
{
    struct line *best = NULL;
    struct owner *of = NULL;
    for (size_t i = 0; i < t->n_owner; i++) {
        struct owner *owner = &t->owner[i];
        struct line *line = next_line(t, owner);
        if (line == NULL) continue;
        if (best == NULL || before(owner->n_running, owner->last_start_unix_s, t->job[line->at].queued_unix_s,
                                   of->n_running, of->last_start_unix_s, t->job[best->at].queued_unix_s)) {
            best = line;
            of = owner;
        }
    }
    if (best == NULL) return t->n;
    t->passed[best->at] = true;
    best->last_start_unix_s = of->last_start_unix_s = now_unix_s;
    return best->at;
}
