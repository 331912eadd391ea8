/* Several daemons on one database, where the driver allows it (store_is_shared). Each daemon has a row with a lease,
 * which it renews; times are read from the server's clock. A daemon without its row has lost its lease: another one has
 * taken over its jobs. A daemon claims a queued job before it starts it, by a lock of the row that others skip. Work
 * that is done once for all daemons is a duty, which one daemon has as long as it lives. Changes of a job that start
 * from an earlier row are made behind a gate, by locks of the server that end with the connection. With a database of
 * one daemon, claims and duties are granted, and the rest does nothing. As all of store.h. */
#ifndef SELVEDGE_SERVER_STORE_CLUSTER_H
#define SELVEDGE_SERVER_STORE_CLUSTER_H

#include "server/store/store.h"

enum { STORE_HOST_BYTES = 160, STORE_URL_BYTES = 320, STORE_DUTY_BYTES = 32 };

struct daemon_row {
    char id[STORE_ID_BYTES];
    char host[STORE_HOST_BYTES]; /* "name boot-id pid-namespace": processes of equal hosts see each other */
    int64_t pid;
    char url[STORE_URL_BYTES]; /* "" before it listens */
    double started_unix_s, until_unix_s;
    bool ended; /* until_unix_s is past by the server's clock */
};

bool store_is_shared(const struct store *store);
/* An id that the database got when it was made. */
status store_identity(struct store *store, char id[STORE_ID_BYTES], struct error *err);
/* The kind of server. */
struct store_server {
    char version[64];
    bool syncs;     /* it writes so that changes survive power loss */
    bool encrypted; /* the connection is */
    bool local;     /* the connection does not leave this machine */
};
/* Reads the server's answer: three letters, t or f, for the three members in their order. A missing letter is an
 * f. */
void store_server_read(const char *letters, struct store_server *server);
status store_server_look(struct store *store, struct store_server *server, struct error *err);
/* The server's clock. */
status store_clock(struct store *store, double *now_unix_s, struct error *err);

/* Makes a row with a new id, which also names the connections of this store. */
status store_daemon_begin(struct store *store, const char *host, int64_t pid, double lease_s, struct error *err);
status store_daemon_announce(struct store *store, const char *url, struct error *err);
/* *held: false when the row is gone. */
status store_daemon_renew(struct store *store, double lease_s, bool *held, struct error *err);
/* Removes the row of this daemon. */
status store_daemon_end(struct store *store, struct error *err);
/* Removes the row of a daemon that is known to have ended. */
status store_daemon_remove(struct store *store, const char *id, struct error *err);
/* Removes the other daemons whose lease has ended, and ends the connections of daemons that have no row, so that their
 * changes are rolled back and their locks are free. Connections that are younger than grace_s are spared: their row
 * may be in the making. */
status store_daemons_remove(struct store *store, double grace_s, int *n_ended, struct error *err);
/* All daemons, the oldest first. The caller frees *row. */
status store_daemon_list(struct store *store, struct daemon_row **row, size_t *n, struct error *err);
/* The id of this daemon; "" before it has begun. */
void store_daemon_id(struct store *store, char id[STORE_ID_BYTES]);

/* Claims a queued job for this daemon. STATUS_CONFLICT: another daemon is about to start it or has done so, it is not
 * queued any more, or this daemon has lost its lease. */
status store_job_claim(struct store *store, const char *id, struct error *err);
/* Gives back a claim of a job that was not started. */
status store_job_unclaim(struct store *store, const char *id, struct error *err);
/* Takes a running job that no daemon holds. STATUS_CONFLICT: another one holds it, or it does not run any more. */
status store_job_take(struct store *store, const char *id, struct error *err);
/* Whether another daemon that lives holds this job. */
status store_job_elsewhere(struct store *store, const char *id, bool *elsewhere, struct error *err);
/* Running jobs that no daemon holds. The caller frees *id. */
status store_job_orphans(struct store *store, char (**id)[STORE_ID_BYTES], size_t *n, struct error *err);

/* Calls the function of store_on_change for each job that any daemon has changed since the last call, or with NULL
 * where that is not known. */
void store_read_changes(struct store *store);

/* Whether a duty is this daemon's: it is, or no daemon that lives has it. An error counts as no. */
bool store_duty_is_mine(struct store *store, const char *duty);

/* Enters the gate for changes of a job, of the use of an owner, or of both; without either for changes of all. Waits
 * for others at most 30 s. After an error, and when the connection with the locks is lost, every change that this
 * thread tries before it leaves is refused with that error. One thread of a daemon at a time. */
void store_gate_enter(struct store *store, const char *job_id, const char *owner);
void store_gate_leave(struct store *store);

#endif
