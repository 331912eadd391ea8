#include "server/main/webhook.h"
#include "base/clock.h"
#include "base/version.h"
#include "server/files/worker_files.h"
#include "server/settings/secret_file.h"
#include "server/store/store_cluster.h"
#include "server/store/store_delivery.h"

#include <curl/curl.h>
#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <pthread.h>
#include <sodium.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    SECRET_LEAST = 16,
    SECRET_MOST = 1024,
    ANSWER_MOST = 1 << 16,
    KEPT = 10000,
    PAUSE_MOST_S = 3600,
    IDLE_S = 60,
    SHARED_IDLE_S = 2
};

struct webhook {
    struct webhook_setup use;
    struct change_watch *watch;
    pthread_t thread;
    bool running; /* the thread was started */
    atomic_bool stop;
    CURL *curl;
    unsigned char secret[SECRET_MOST + 1];
    size_t n_secret;
    char why[CURL_ERROR_SIZE];
};

void webhook_sign(const unsigned char *secret, size_t n_secret, long long time_unix_s, const char *body,
                  char out[WEBHOOK_SIGNATURE_BYTES])
{
    unsigned char sum[crypto_auth_hmacsha256_BYTES];
    char time_text[32], hex[2 * sizeof sum + 1];
    crypto_auth_hmacsha256_state hash;
    int n = snprintf(time_text, sizeof time_text, "%lld.", time_unix_s);
    crypto_auth_hmacsha256_init(&hash, secret, n_secret);
    crypto_auth_hmacsha256_update(&hash, (const unsigned char *)time_text, (unsigned long long)n);
    crypto_auth_hmacsha256_update(&hash, (const unsigned char *)body, strlen(body));
    crypto_auth_hmacsha256_final(&hash, sum);
    sodium_bin2hex(hex, sizeof hex, sum, sizeof sum);
    snprintf(out, WEBHOOK_SIGNATURE_BYTES, "t=%lld,v1=%s", time_unix_s, hex);
}

double webhook_pause_s(double first_s, int64_t n_try)
{
    return fmin(first_s * pow(2, (double)(n_try < 40 ? n_try - 1 : 39)), PAUSE_MOST_S);
}

static status read_secret(struct webhook *w, struct error *err)
{
    const char *path = w->use.settings->webhook_secret_file;
    char *text = NULL;
    size_t n = 0;
    if (path[0] == '\0')
        return error_set_field(err, STATUS_INVALID, "webhook.secret_file", "a webhook needs a file with its secret");
    status s = secret_file_read(path, "webhook.secret_file", SECRET_MOST, &text, &n, err);
    if (s != STATUS_OK) return error_prefix(err, s, "cannot read the secret of the webhook");
    while (n > 0 && (text[n - 1] == '\n' || text[n - 1] == '\r')) n--;
    if (n >= SECRET_LEAST) memcpy(w->secret, text, n);
    w->n_secret = n;
    sodium_memzero(text, n);
    free(text);
    return n >= SECRET_LEAST ? STATUS_OK
                             : error_set_field(err, STATUS_INVALID, "webhook.secret_file",
                                               "the secret in '%s' has %zu bytes, but at least %d are needed", path, n,
                                               (int)SECRET_LEAST);
}

/* ---- one try ---- */

/* The answer of the receiver is not stored; an answer without end is cut off. */
static size_t on_answer(char *data, size_t size, size_t n, void *context)
{
    size_t *n_seen = context;
    (void)data;
    *n_seen += size * n;
    return *n_seen > ANSWER_MOST ? 0 : size * n;
}

static int on_progress(void *context, curl_off_t a, curl_off_t b, curl_off_t c, curl_off_t d)
{
    const struct webhook *w = context;
    (void)a, (void)b, (void)c, (void)d;
    return atomic_load(&w->stop);
}

/* Returns {"code", "words"}, or null without a verdict. The words are in the job's folder as long as the job keeps this
 * verdict; afterwards the code stands for them. */
static json_t *verdict_of(const char *data, const struct delivery_row *d)
{
    if (d->verdict[0] == '\0') return json_null();
    json_t *st = worker_status_read(data, d->job_id), *there = json_object_get(st, "verdict");
    const char *code = json_string_value(json_object_get(there, "code")),
               *words = json_string_value(json_object_get(there, "words"));
    bool same = code != NULL && words != NULL && strcmp(code, d->verdict) == 0;
    json_t *out = json_pack("{s:s,s:s}", "code", d->verdict, "words", same ? words : d->verdict);
    json_decref(st);
    return out;
}

/* Returns the body of a delivery: the same bytes at every try while the job is not run again. NULL when memory is out.
 * The caller frees it. */
static char *body_of(const char *data, const struct delivery_row *d)
{
    char event[32], url[80];
    const char *state = job_state_name(d->job_state);
    snprintf(event, sizeof event, "job.%s", state);
    snprintf(url, sizeof url, "/v1/jobs/%s", d->job_id);
    json_t *error = d->error_code[0] == '\0' ? json_null()
                                             : json_pack("{s:s,s:s,s:s}", "code", d->error_code, "field",
                                                         d->error_field, "text", d->error_text);
    json_t *job =
        json_pack("{s:s,s:s,s:s,s:I,s:o,s:o,s:s}", "id", d->job_id, "sample", d->sample, "state", state, "attempt",
                  (json_int_t)d->attempt, "error", error, "verdict", verdict_of(data, d), "url", url);
    json_t *body = json_pack("{s:s,s:s,s:f,s:o}", "delivery", d->id, "event", event, "created_unix_s",
                             d->created_unix_s, "job", job);
    char *text = body == NULL ? NULL : json_dumps(body, JSON_COMPACT);
    json_decref(body);
    return text;
}

static struct curl_slist *headers_of(const struct webhook *w, const struct delivery_row *d, const char *body)
{
    char signature[WEBHOOK_SIGNATURE_BYTES], line[160];
    struct curl_slist *list = curl_slist_append(NULL, "Content-Type: application/json");
    webhook_sign(w->secret, w->n_secret, (long long)clock_wall_s(), body, signature);
    snprintf(line, sizeof line, "Selvedge-Signature: %s", signature);
    list = curl_slist_append(list, line);
    snprintf(line, sizeof line, "Selvedge-Delivery: %s", d->id);
    list = curl_slist_append(list, line);
    snprintf(line, sizeof line, "Selvedge-Event: job.%s", job_state_name(d->job_state));
    list = curl_slist_append(list, line);
    return curl_slist_append(list, "Expect:");
}

/* Returns whether the receiver has answered 2xx; sets http_status and error of the row. */
static bool post(struct webhook *w, struct delivery_row *d)
{
    const struct settings *s = w->use.settings;
    size_t n_answer = 0;
    long code = 0;
    char *body = body_of(s->data, d);
    struct curl_slist *headers = body == NULL ? NULL : headers_of(w, d, body);
    CURL *c = w->curl;
    curl_easy_reset(c);
    w->why[0] = '\0';
    curl_easy_setopt(c, CURLOPT_URL, s->webhook_url);
    curl_easy_setopt(c, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(c, CURLOPT_FOLLOWLOCATION, 0L);
    curl_easy_setopt(c, CURLOPT_PROXY, "");
    curl_easy_setopt(c, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(c, CURLOPT_FORBID_REUSE, 1L);
    curl_easy_setopt(c, CURLOPT_TIMEOUT, (long)s->webhook_timeout_s);
    curl_easy_setopt(c, CURLOPT_USERAGENT, "selvedged/" SELVEDGE_VERSION);
    curl_easy_setopt(c, CURLOPT_HTTPHEADER, headers);
    curl_easy_setopt(c, CURLOPT_POSTFIELDS, body);
    curl_easy_setopt(c, CURLOPT_WRITEFUNCTION, on_answer);
    curl_easy_setopt(c, CURLOPT_WRITEDATA, &n_answer);
    curl_easy_setopt(c, CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(c, CURLOPT_XFERINFOFUNCTION, on_progress);
    curl_easy_setopt(c, CURLOPT_XFERINFODATA, w);
    curl_easy_setopt(c, CURLOPT_ERRORBUFFER, w->why);
    CURLcode result = headers == NULL ? CURLE_OUT_OF_MEMORY : curl_easy_perform(c);
    curl_easy_getinfo(c, CURLINFO_RESPONSE_CODE, &code);
    curl_slist_free_all(headers);
    free(body);
    d->http_status = code;
    d->error[0] = '\0';
    if (n_answer > ANSWER_MOST)
        snprintf(d->error, sizeof d->error, "the answer has more than %d bytes", (int)ANSWER_MOST);
    else if (result != CURLE_OK)
        snprintf(d->error, sizeof d->error, "%.200s", w->why[0] ? w->why : curl_easy_strerror(result));
    else if (code < 200 || code > 299)
        snprintf(d->error, sizeof d->error, "the receiver answered with status %ld", code);
    return d->error[0] == '\0';
}

static void try_once(struct webhook *w, struct delivery_row *d)
{
    struct error err = {0};
    bool delivered = post(w, d);
    if (!delivered && atomic_load(&w->stop)) return; /* broken off by the stop, which is not the receiver's fault */
    double now = clock_wall_s();
    d->n_try++;
    d->next_unix_s = now + webhook_pause_s((double)w->use.settings->webhook_retry_s, d->n_try);
    if (delivered) {
        d->state = DELIVERY_DELIVERED;
        d->delivered_unix_s = now;
    } else if (d->n_try >= w->use.settings->webhook_max_tries) {
        d->state = DELIVERY_FAILED;
        log_warning(w->use.log, "webhook: delivery %s is given up after %lld tries: %s", d->id, (long long)d->n_try,
                    d->error);
    }
    status s = store_delivery_update(w->use.store, d, &err);
    if (s == STATUS_OK) s = store_delivery_prune(w->use.store, KEPT, &err);
    if (s != STATUS_OK) {
        /* the database cannot be written: the same delivery would be sent again at once */
        log_warning(w->use.log, "webhook: %s", err.text);
        change_watch_wait(w->watch, -1, clock_monotonic_s() + 5);
    }
}

static void *run(void *context)
{
    struct webhook *w = context;
    while (!atomic_load(&w->stop)) {
        struct delivery_row d;
        /* with a shared database, jobs end at other daemons too, and one daemon sends all deliveries */
        double wait_s = store_is_shared(w->use.store) ? SHARED_IDLE_S : IDLE_S;
        if (store_duty_is_mine(w->use.store, "webhook") && store_delivery_next(w->use.store, &d, NULL) == STATUS_OK) {
            /* a clock that was set back must not delay a delivery by more than the longest pause */
            wait_s = fmin(d.next_unix_s - clock_wall_s(), store_is_shared(w->use.store) ? SHARED_IDLE_S : PAUSE_MOST_S);
            if (wait_s <= 0) try_once(w, &d);
        }
        if (wait_s > 0) change_watch_wait(w->watch, -1, clock_monotonic_s() + wait_s);
    }
    return NULL;
}

static bool address_valid(const char *url)
{
    return strncmp(url, "http://", 7) == 0 || strncmp(url, "https://", 8) == 0;
}

status webhook_start(const struct webhook_setup *setup, struct webhook **out, struct error *err)
{
    const char *url = setup->settings->webhook_url;
    *out = NULL;
    status s = STATUS_OK;
    /* a daemon that joins others without an address does not switch off their webhook */
    if (url[0] != '\0' || setup->first_daemon) s = store_webhook_enable(setup->store, url[0] != '\0', err);
    if (s != STATUS_OK || url[0] == '\0') return s;
    if (!address_valid(url))
        return error_set_field(err, STATUS_INVALID, "webhook.url", "'%.200s' is not an http:// or https:// address",
                               url);
    struct webhook *w = calloc(1, sizeof *w);
    if (w == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start the webhook: out of memory");
    w->use = *setup;
    s = read_secret(w, err);
    if (s == STATUS_OK) s = change_watch_begin(setup->feed, NULL, &w->watch, err);
    if (s == STATUS_OK && (curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK || (w->curl = curl_easy_init()) == NULL))
        s = error_set(err, STATUS_NO_MEMORY, "cannot start libcurl");
    if (s == STATUS_OK) {
        int e = pthread_create(&w->thread, NULL, run, w);
        w->running = e == 0;
        errno = e;
        if (e != 0) s = error_set_errno(err, "cannot start the webhook");
    }
    if (s == STATUS_OK)
        *out = w;
    else
        webhook_stop(w);
    return s;
}

void webhook_stop(struct webhook *w)
{
    if (w == NULL) return;
    atomic_store(&w->stop, true);
    if (w->running) {
        change_feed_publish(w->use.feed, "");
        pthread_join(w->thread, NULL);
    }
    change_watch_end(w->watch);
    curl_easy_cleanup(w->curl);
    sodium_memzero(w->secret, sizeof w->secret);
    free(w);
}
