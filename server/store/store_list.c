/* Lists of jobs. */
#include "server/store/store_sql.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
static status read_rows(struct store *store, status s, sqlite3_stmt *q, struct job_row **out, size_t *n_out,
                        struct error *err)
{
    struct job_row *row = NULL;
    size_t n = 0, capacity = 0;
    int rc = SQLITE_DONE;
    while (s == STATUS_OK && (rc = sqlite3_step(q)) == SQLITE_ROW) {
        s = grow(&row, n, &capacity, err);
        if (s == STATUS_OK) s = store_job_read(q, &row[n], err);
        if (s == STATUS_OK) n++;
    }
    if (s == STATUS_OK && rc != SQLITE_DONE) s = store_error(&store->read, "cannot list jobs", err);
    sqlite3_finalize(q);
    if (s != STATUS_OK) {
        job_rows_free(row, n);
        return s;
    }
    *out = row;
    *n_out = n;
    return STATUS_OK;
}

/* Where the list begins behind the job of q->after_serial, whose key may have changed since. */
static const char *behind(const struct job_query *q)
{
    static const char *const sql[4][2] = {
        {" AND serial < ?2", " AND serial > ?2"},
        {" AND (finished, serial) < (CAST(?3 AS REAL), ?2)", " AND (finished, serial) > (CAST(?3 AS REAL), ?2)"},
        {" AND (sample COLLATE NOCASE, serial) < (?3, ?2)", " AND (sample COLLATE NOCASE, serial) > (?3, ?2)"},
        {"", ""}};
    return q->after_serial > 0 ? sql[q->order][q->ascending] : "";
}

static const char *order_of(const struct job_query *q)
{
    static const char *const sql[4][2] = {{"serial DESC", "serial"},
                                          {"finished DESC, serial DESC", "finished, serial"},
                                          {"sample COLLATE NOCASE DESC, serial DESC", "sample COLLATE NOCASE, serial"},
                                          {"batch_place DESC, serial DESC", "batch_place, serial"}};
    return sql[q->order][q->ascending];
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
    char sql[2000], states[64];
    states_of(q->states, states, sizeof states);
    /* a statement for each kind of query: with "?4 = '' OR owner = ?4" no index would find the rows */
    snprintf(sql, sizeof sql,
             "SELECT " JOB_COLUMNS("NULL") " FROM job WHERE deleted = ?1%s%s%s%s%s%s%s%s%s%s ORDER BY %s LIMIT ?12",
             states, behind(q), q->owner != NULL ? " AND owner = ?4" : "",
             q->sample != NULL ? " AND instr(lower(sample), lower(?5)) > 0" : "",
             q->id != NULL ? " AND id >= ?6 AND id < ?6 || 'g'" : "",
             q->batch != NULL ? " AND batch = ?11 AND batch <> ''" : "",
             q->tag != NULL ? " AND instr(tags, ' ' || ?7 || ' ') > 0" : "",
             q->verdict != NULL ? " AND instr(?8, ',' || verdict || ',') > 0" : "",
             q->created_after_unix_s > 0 ? " AND created >= ?9" : "",
             q->created_before_unix_s > 0 ? " AND created < ?10" : "", order_of(q));
    sqlite3_stmt *statement = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &statement, err, sql, "iissssssddsi", (int64_t)q->deleted, q->after_serial,
                             q->after_key, q->owner, q->sample, q->id, q->tag, q->verdict, q->created_after_unix_s,
                             q->created_before_unix_s, q->batch, (int64_t)q->limit);
    s = read_rows(store, s, statement, out, n_out, err);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_job_count(struct store *store, int64_t n[JOB_N_STATE], struct error *err)
{
    sqlite3_stmt *q = NULL;
    for (int i = 0; i < JOB_N_STATE; i++) n[i] = 0;
    pthread_mutex_lock(&store->read.lock);
    status s = store_prepare(&store->read, &q, err, "SELECT state, n FROM job_count", "");
    int rc = SQLITE_DONE;
    while (s == STATUS_OK && (rc = sqlite3_step(q)) == SQLITE_ROW) {
        int state = sqlite3_column_int(q, 0);
        if (state >= 0 && state < JOB_N_STATE) n[state] = sqlite3_column_int64(q, 1);
    }
    if (s == STATUS_OK && rc != SQLITE_DONE) s = store_error(&store->read, "cannot count jobs", err);
    sqlite3_finalize(q);
    pthread_mutex_unlock(&store->read.lock);
    return s;
}

status store_job_queue(struct store *store, size_t n_each, struct queued_job **out, size_t *n_out, struct error *err)
{
    struct queued_job *job = NULL;
    size_t n = 0, capacity = 0;
    sqlite3_stmt *q = NULL;
    pthread_mutex_lock(&store->read.lock);
    status s =
        store_prepare(&store->read, &q, err,
                      "SELECT j.id, t.owner, t.batch, j.priority, j.queued, t.last FROM turn t CROSS JOIN job j ON "
                      "j.serial IN (SELECT h.serial FROM job h WHERE h.deleted = 0 AND h.state = 1 AND "
                      "h.owner = t.owner AND h.batch = t.batch ORDER BY h.priority DESC, h.queued, h.serial LIMIT ?) "
                      "WHERE t.queued > 0 ORDER BY t.owner, t.batch, j.priority DESC, j.queued, j.serial",
                      "i", (int64_t)n_each);
    int rc = SQLITE_DONE;
    while (s == STATUS_OK && (rc = sqlite3_step(q)) == SQLITE_ROW) {
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
        job[n].priority = sqlite3_column_int64(q, 3);
        job[n].queued_unix_s = sqlite3_column_double(q, 4);
        job[n++].last_start_unix_s = sqlite3_column_double(q, 5);
    }
    if (s == STATUS_OK && rc != SQLITE_DONE) s = store_error(&store->read, "cannot list the queue", err);
    sqlite3_finalize(q);
    pthread_mutex_unlock(&store->read.lock);
    if (s != STATUS_OK) {
        free(job);
        return s;
    }
    *out = job;
    *n_out = n;
    return STATUS_OK;
}
