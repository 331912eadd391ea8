/* Deliveries of webhooks, in the database of jobs. A trigger adds one in the transaction that ends a job, so none is
 * lost and none is invented; its account of the job never changes. */
#ifndef SELVEDGE_SERVER_STORE_DELIVERY_H
#define SELVEDGE_SERVER_STORE_DELIVERY_H

#include "server/store/store.h"

enum { DELIVERY_ID_BYTES = 80 };
enum delivery_state { DELIVERY_WAITING, DELIVERY_DELIVERED, DELIVERY_FAILED };

struct delivery_row {
    int64_t serial;
    char id[DELIVERY_ID_BYTES];
    /* the job when it ended */
    char job_id[STORE_ID_BYTES], sample[256];
    enum job_state job_state;
    int64_t attempt;
    char error_code[32], error_field[160], error_text[1024]; /* error_code "": none */
    char verdict[40];                                        /* its code; "": none */
    double created_unix_s;
    /* state of the delivery */
    enum delivery_state state;
    int64_t n_try;
    double next_unix_s;      /* time of the next try, while it waits */
    int64_t http_status;     /* of the last try; 0: there was no answer */
    char error[256];         /* of the last try; "": none */
    double delivered_unix_s; /* 0: not yet */
};

/* Sets whether jobs that end from now on make a delivery. When not, waiting deliveries end as failed: an address that
 * is named later must not get the deliveries for another. */
status store_webhook_enable(struct store *store, bool enabled, struct error *err);
/* The waiting delivery whose next try is the earliest. STATUS_NOT_FOUND: none waits. */
status store_delivery_next(struct store *store, struct delivery_row *row, struct error *err);
/* Writes the outcome of a try. */
status store_delivery_update(struct store *store, const struct delivery_row *row, struct error *err);
/* The newest deliveries before a serial (0: from the newest). job_id NULL: of all jobs; owner NULL: of all owners. The
 * caller frees *row. */
status store_delivery_list(struct store *store, const char *owner, const char *job_id, int64_t before_serial,
                           size_t limit, struct delivery_row **row, size_t *n, struct error *err);
/* Removes the oldest deliveries that do not wait, so that `most` of all are left. */
status store_delivery_prune(struct store *store, int64_t most, struct error *err);

#endif
