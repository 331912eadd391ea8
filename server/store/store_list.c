/* Lists of jobs. */
#include "server/store/store_rows.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FOLDED_BYTES = 320, CLAUSE_BYTES = 128 };

static status grow(struct job_row **row, size_t n, size_t *capacity, struct error *err)
{
    if (n < *capacity) return STATUS_OK;
    size_t more = *capacity == 0 ? 16 : *capacity * 2;
    struct job_row *p = realloc(*row, more * sizeof *p);
    if (p == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list jobs: out of memory");
    *row = p;
    *capacity = more;
    return STATUS_OK;
}

/* Runs a prepared query for rows and finalizes it. */
static status read_rows(struct store *store, status s, struct store_query *q, struct job_row **out, size_t *n_out,
                        struct error *err)
{
    struct job_row *row = NULL;
    size_t n = 0, capacity = 0;
    enum store_step rc = STORE_DONE;
    while (s == STATUS_OK && (rc = store_step(q)) == STORE_ROW) {
        s = grow(&row, n, &capacity, err);
        if (s == STATUS_OK) s = store_job_read(q, &row[n], err);
        if (s == STATUS_OK) n++;
    }
    if (s == STATUS_OK && rc != STORE_DONE) s = store_error(&store->read, "cannot list jobs", err);
    store_finish(q);
    if (s != STATUS_OK) {
        job_rows_free(row, n);
        return s;
    }
    *out = row;
    *n_out = n;
    return STATUS_OK;
}

/* Where the list begins behind the job of q->after_serial, whose key may have changed since. */
static void behind(const struct job_query *q, const char *sample_key, char *out, size_t n_out)
{
    static const char *const sql[4][2] = {{" AND serial < ?2", " AND serial > ?2"},
                                          {" AND (finished, serial) < (CAST(?3 AS DOUBLE PRECISION), ?2)",
                                           " AND (finished, serial) > (CAST(?3 AS DOUBLE PRECISION), ?2)"},
                                          {" AND (%s, serial) < (?3, ?2)", " AND (%s, serial) > (?3, ?2)"},
                                          {"", ""}};
    snprintf(out, n_out, q->after_serial > 0 ? sql[q->order][q->ascending] : "", sample_key);
}

static void order_of(const struct job_query *q, const char *sample_key, char *out, size_t n_out)
{
    static const char *const sql[4][2] = {{"serial DESC", "serial"},
                                          {"finished DESC, serial DESC", "finished, serial"},
                                          {"%s DESC, serial DESC", "%s, serial"},
                                          {"batch_place DESC, serial DESC", "batch_place, serial"}};
    snprintf(out, n_out, sql[q->order][q->ascending], sample_key);
}

/* Copies a text with A-Z in lower case. A text that is longer than any sample stays longer than any. */
static const char *fold(const char *text, char out[FOLDED_BYTES])
{
    if (text == NULL) return NULL;
    snprintf(out, FOLDED_BYTES, "%s", text);
    for (char *c = out; *c != '\0'; c++)
        if (*c >= 'A' && *c <= 'Z') *c = (char)(*c - 'A' + 'a');
    return out;
}

static void states_of(unsigned states, char *out, size_t n_out)
{
    size_t n = 0;
    out[0] = '\0';
    /* numbers, not parameters: an index helps where there is one state */
    for (int i = 0; i < JOB_N_STATE; i++)
        if ((states >> i & 1) != 0)
            n += (size_t)snprintf(out + n, n_out - n, "%s%d", n == 0 ? " AND state IN (" : ",", i);
    if (n > 0) snprintf(out + n, n_out - n, ")");
}

status store_job_list(struct store *store, const struct job_query *query, struct job_row **out, size_t *n_out,
                      struct error *err)
{
    const struct job_query *q = query;
    const char *sample_key = store->driver->phrase.sample_key;
    char sql[2400], states[64], place[CLAUSE_BYTES], order[CLAUSE_BYTES], after[FOLDED_BYTES], sample[FOLDED_BYTES];
    states_of(q->states, states, sizeof states);
    behind(q, sample_key, place, sizeof place);
    order_of(q, sample_key, order, sizeof order);
    /* a statement for each kind of query: with "?4 = '' OR owner = ?4" no index would find the rows */
    snprintf(sql, sizeof sql,
             "SELECT " JOB_COLUMNS("NULL") " FROM job WHERE deleted = ?1%s%s%s%s%s%s%s%s%s%s ORDER BY %s LIMIT ?12",
             states, place, q->owner != NULL ? " AND owner = ?4" : "",
             q->sample != NULL ? " AND instr(lower(sample), ?5) > 0" : "",
             q->id != NULL ? " AND id >= ?6 AND id < ?6 || 'g'" : "",
             q->batch != NULL ? " AND batch = ?11 AND batch <> ''" : "",
             q->tag != NULL ? " AND instr(tags, ' ' || ?7 || ' ') > 0" : "",
             q->verdict != NULL ? " AND instr(?8, ',' || verdict || ',') > 0" : "",
             q->created_after_unix_s > 0 ? " AND created >= ?9" : "",
             q->created_before_unix_s > 0 ? " AND created < ?10" : "", order);
    struct store_query *statement = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &statement, err, sql, "iissssssddsi", (int64_t)q->deleted, q->after_serial,
                             fold(q->after_key, after), q->owner, fold(q->sample, sample), q->id, q->tag, q->verdict,
                             q->created_after_unix_s, q->created_before_unix_s, q->batch, (int64_t)q->limit);
    s = read_rows(store, s, statement, out, n_out, err);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_job_count(struct store *store, int64_t n[JOB_N_STATE], struct error *err)
{
    struct store_query *q = NULL;
    for (int i = 0; i < JOB_N_STATE; i++) n[i] = 0;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err, "SELECT state, n FROM job_count", "");
    enum store_step rc = STORE_DONE;
    while (s == STATUS_OK && (rc = store_step(q)) == STORE_ROW) {
        int state = (int)store_int64(q, 0);
        if (state >= 0 && state < JOB_N_STATE) n[state] = store_int64(q, 1);
    }
    if (s == STATUS_OK && rc != STORE_DONE) s = store_error(&store->read, "cannot count jobs", err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_job_ages(struct store *store, void (*visit)(void *context, const char *id, double updated_unix_s),
                      void *context, struct error *err)
{
    char id[STORE_ID_BYTES];
    struct store_query *q = NULL;
    enum store_step rc = STORE_DONE;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err, "SELECT id, updated FROM job", "");
    while (s == STATUS_OK && (rc = store_step(q)) == STORE_ROW) {
        store_text(q, 0, id, sizeof id);
        visit(context, id, store_real(q, 1));
    }
    if (s == STATUS_OK && rc != STORE_DONE) s = store_error(&store->read, "cannot list jobs", err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_job_queue(struct store *store, size_t n_each, struct queued_job **out, size_t *n_out, struct error *err)
{
    struct queued_job *job = NULL;
    size_t n = 0, capacity = 0;
    struct store_query *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err, store->driver->phrase.queue, "i", (int64_t)n_each);
    enum store_step rc = STORE_DONE;
    while (s == STATUS_OK && (rc = store_step(q)) == STORE_ROW) {
        if (n == capacity) {
            capacity = capacity == 0 ? 16 : 2 * capacity;
            struct queued_job *more = realloc(job, capacity * sizeof *more);
            if (more == NULL) {
                s = error_set(err, STATUS_NO_MEMORY, "cannot list the queue: out of memory");
                break;
            }
            job = more;
        }
        store_text(q, 0, job[n].id, sizeof job[n].id);
        store_text(q, 1, job[n].owner, sizeof job[n].owner);
        store_text(q, 2, job[n].batch, sizeof job[n].batch);
        job[n].priority = store_int64(q, 3);
        job[n].queued_unix_s = store_real(q, 4);
        job[n++].last_start_unix_s = store_real(q, 5);
    }
    if (s == STATUS_OK && rc != STORE_DONE) s = store_error(&store->read, "cannot list the queue", err);
    store_finish(q);
    pthread_mutex_unlock(&store->read.lock);
    if (s != STATUS_OK) {
        free(job);
        return s;
    }
    *out = job;
    *n_out = n;
    return STATUS_OK;
}
