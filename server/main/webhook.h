/* The webhook: a thread that POSTs each delivery of the database to the address of the settings, signed, until the
 * receiver answers 2xx or the tries are over. A receiver that fails, hangs or sends too much delays other deliveries
 * only. The address comes from the settings alone; redirects are not followed, and proxies of the environment not used.
 *
 * The header Selvedge-Signature is "t=TIME,v1=HEX": the HMAC-SHA256 of "TIME.BODY" with the secret. TIME is the time
 * of the try, so that a receiver can refuse old requests. */
#ifndef SELVEDGE_SERVER_WEBHOOK_H
#define SELVEDGE_SERVER_WEBHOOK_H

#include "base/log.h"
#include "server/jobs/change_feed.h"
#include "server/settings/settings.h"
#include "server/store/store.h"

enum { WEBHOOK_SIGNATURE_BYTES = 96 };

/* The parts of the daemon that a webhook uses; they outlive it. */
struct webhook_setup {
    const struct settings *settings;
    struct store *store;
    struct change_feed *feed;
    struct log *log;
    bool first_daemon; /* no other daemon uses the database, or this one began before all others */
};

struct webhook;
/* Starts the thread; without an address in the settings *webhook is NULL and nothing is sent. STATUS_INVALID names the
 * setting at fault; STATUS_IO, STATUS_NO_MEMORY. */
status webhook_start(const struct webhook_setup *setup, struct webhook **webhook, struct error *err);
/* Ends the present try and joins the thread. NULL is accepted. */
void webhook_stop(struct webhook *webhook);

/* The value of the header Selvedge-Signature. */
void webhook_sign(const unsigned char *secret, size_t n_secret, long long time_unix_s, const char *body,
                  char out[WEBHOOK_SIGNATURE_BYTES]);
/* Seconds until the next try, after n_try >= 1 tries. */
double webhook_pause_s(double first_s, int64_t n_try);

#endif
