#include "server/access/access_registry.h"
#include "base/clock.h"
#include "server/access/access_secret.h"
#include "server/store/store_share.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Seconds between two writes of last uses. Each write costs a sync. */
static const double flush_s = 30;

struct meter {
    int64_t serial;
    char id[STORE_ID_BYTES];
    double left; /* requests that may be made now */
    double at_s; /* monotonic time of last_used */
    double used_unix_s;
    bool dirty; /* used_unix_s is not in the database */
};

struct access_registry {
    struct store *store;
    const struct settings *settings;
    atomic_bool required; /* once true, it stays so: tokens are revoked but never removed */
    pthread_mutex_t lock; /* guards the members below */
    struct meter *meter;  /* of each token that was used since the start */
    size_t n, capacity;
    double flushed_s;
};

status access_registry_new(struct store *store, const struct settings *settings, struct access_registry **out,
                           struct error *err)
{
    struct access_registry *d = calloc(1, sizeof *d);
    if (d == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start: out of memory");
    d->store = store;
    d->settings = settings;
    d->flushed_s = clock_monotonic_s();
    pthread_mutex_init(&d->lock, NULL);
    *out = d;
    return STATUS_OK;
}

void access_registry_free(struct access_registry *d)
{
    if (d == NULL) return;
    access_registry_flush(d, true);
    pthread_mutex_destroy(&d->lock);
    free(d->meter);
    free(d);
}

status access_required(struct access_registry *d, bool *required, struct error *err)
{
    *required = atomic_load(&d->required) || strcmp(d->settings->access_required, "always") == 0;
    if (*required) return STATUS_OK;
    status s = store_token_any(d->store, required, err);
    if (s == STATUS_OK && *required) atomic_store(&d->required, true);
    return s;
}

struct access_grant access_grant_of_everyone(void) { return (struct access_grant){.scope = ACCESS_ADMIN, .all = true}; }

status access_find(struct access_registry *d, const char *secret, bool is_session, struct access_grant *grant,
                   struct error *err)
{
    unsigned char hash[STORE_SECRET_HASH_BYTES];
    struct token_row row;
    access_secret_hash(secret, hash);
    status s = store_token_find(d->store, hash, is_session, clock_wall_s(), &row, err);
    if (s != STATUS_OK) return s;
    const struct settings *t = d->settings;
    *grant = (struct access_grant){.scope = row.scope, .all = row.scope == ACCESS_ADMIN, .token_serial = row.serial};
    memcpy(grant->token_id, row.id, sizeof grant->token_id);
    memcpy(grant->name, row.name, sizeof grant->name);
    memcpy(grant->owner, row.owner, sizeof grant->owner);
    const struct access_quota *q = &row.quota;
    grant->quota.requests_per_minute =
        q->requests_per_minute == QUOTA_DEFAULT ? t->requests_per_minute : q->requests_per_minute;
    grant->quota.stored_bytes = q->stored_bytes == QUOTA_DEFAULT ? t->stored_bytes : q->stored_bytes;
    grant->quota.jobs = q->jobs == QUOTA_DEFAULT ? t->jobs_of_owner : q->jobs;
    return STATUS_OK;
}

status access_find_share(struct access_registry *d, const char *secret, struct access_grant *grant, struct error *err)
{
    unsigned char hash[STORE_SECRET_HASH_BYTES];
    struct share_row row;
    access_secret_hash(secret, hash);
    status s = store_share_find(d->store, hash, clock_wall_s(), &row, err);
    if (s != STATUS_OK) return s;
    *grant = (struct access_grant){.scope = ACCESS_READ};
    memcpy(grant->job, row.job_id, sizeof grant->job);
    return STATUS_OK;
}

/* The meter of a token, made full if there is none; NULL without memory. d->lock is held. */
static struct meter *meter_of(struct access_registry *d, const struct access_grant *grant, double now_s)
{
    for (size_t i = 0; i < d->n; i++)
        if (d->meter[i].serial == grant->token_serial) return &d->meter[i];
    if (d->n == d->capacity) {
        size_t more = d->capacity == 0 ? 16 : d->capacity * 2;
        struct meter *p = realloc(d->meter, more * sizeof *p);
        if (p == NULL) return NULL;
        d->meter = p;
        d->capacity = more;
    }
    struct meter *m = &d->meter[d->n++];
    *m = (struct meter){.serial = grant->token_serial, .left = (double)grant->quota.requests_per_minute, .at_s = now_s};
    memcpy(m->id, grant->token_id, sizeof m->id);
    return m;
}

long long access_count(struct access_registry *d, const struct access_grant *grant, double now_s)
{
    long long wait_s = 0;
    const double most = (double)grant->quota.requests_per_minute;
    if (grant->token_serial == 0) return 0;
    pthread_mutex_lock(&d->lock);
    struct meter *m = meter_of(d, grant, now_s);
    if (m == NULL) goto out;
    m->used_unix_s = clock_wall_s();
    m->dirty = true;
    if (most <= 0) goto out;
    m->left = fmin(most, m->left + (now_s - m->at_s) * most / 60);
    m->at_s = now_s;
    if (m->left >= 1)
        m->left -= 1;
    else
        wait_s = (long long)fmax(1, ceil((1 - m->left) * 60 / most));
out:
    pthread_mutex_unlock(&d->lock);
    return wait_s;
}

static int by_id(const void *a, const void *b)
{
    const struct token_row *x = a, *y = b;
    return strcmp(x->id, y->id);
}

void access_registry_flush(struct access_registry *d, bool now)
{
    struct token_row *row = NULL;
    size_t n = 0;
    double now_s = clock_monotonic_s();
    pthread_mutex_lock(&d->lock);
    if (now || now_s - d->flushed_s >= flush_s) {
        d->flushed_s = now_s;
        row = calloc(d->n > 0 ? d->n : 1, sizeof *row);
        for (size_t i = 0; row != NULL && i < d->n; i++) {
            struct meter *m = &d->meter[i];
            if (!m->dirty) continue;
            memcpy(row[n].id, m->id, sizeof row[n].id);
            row[n++].used_unix_s = m->used_unix_s;
            m->dirty = false; /* a write that fails costs the time of one use, and the next use is written again */
        }
    }
    pthread_mutex_unlock(&d->lock);
    /* in one order everywhere, so that daemons that write the same tokens wait for each other in no circle */
    if (n > 0) qsort(row, n, sizeof *row, by_id);
    if (n > 0) store_token_used(d->store, row, n, NULL);
    free(row);
}
