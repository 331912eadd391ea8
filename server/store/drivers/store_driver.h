/* The databases that a store can use, one row of a table each. The SQL of the store is the subset that all of them
 * understand; the row has the differences. The calls of a row may come from a plug-in, a shared object that is loaded
 * when the settings ask for it (postgres_plugin.c): this header is all that it shares with the daemon. */
#ifndef SELVEDGE_SERVER_STORE_DRIVER_H
#define SELVEDGE_SERVER_STORE_DRIVER_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* STORE_CALLS_VERSION rises with each change of struct store_calls and of the structs in it. */
enum { STORE_CALLS_VERSION = 1, STORE_WHY_BYTES = 400, STORE_ADDRESS_BYTES = 1024, STORE_APPLICATION_BYTES = 64 };
#define STORE_CALLS_SYMBOL "selvedge_store_calls"

/* Which database, and how it is opened. */
struct store_place {
    char address[STORE_ADDRESS_BYTES]; /* a path, or an address postgresql://... */
    char *password;                    /* NULL: none, or it is part of the address; owned (store_place_release) */
};

enum store_step { STORE_ROW, STORE_DONE, STORE_FAILED };

/* A value that is bound to a statement. kind: s text, i integer, d double, b blob. */
struct store_value {
    char kind;
    const void *bytes; /* of texts and blobs; NULL: null */
    size_t n_bytes;
    int64_t integer;
    double real;
};

struct store_calls;
/* A statement that runs. Each driver has a struct of its own that begins with this one. */
struct store_query {
    const struct store_calls *calls;
};

/* The operations of a database. db is a connection; a connection is used by one thread at a time. */
struct store_calls {
    int version; /* STORE_CALLS_VERSION */
    /* application names the connection to the server, and may change while the connection is closed; it outlives db.
     * *db is set after an error too, unless memory is out, so that `fault` can say why. */
    status (*open)(const struct store_place *place, const char *application, bool only_reads, bool create, void **db);
    void (*close)(void *db);
    /* Runs statements without values or rows. */
    status (*script)(void *db, const char *sql);
    /* Starts a statement. Parameters are `?`, in the order of the values, or `?1`, `?2`. */
    status (*query)(void *db, const char *sql, const struct store_value *value, size_t n, struct store_query **query);
    enum store_step (*step)(struct store_query *query);
    /* Columns of the present row, from 0. Text and blob are valid until the next step. */
    bool (*is_null)(struct store_query *query, int column);
    int64_t (*integer)(struct store_query *query, int column);
    double (*real)(struct store_query *query, int column);
    const char *(*text)(struct store_query *query, int column);
    const void *(*blob)(struct store_query *query, int column, size_t *n);
    /* The number of rows that a finished statement has changed. */
    int64_t (*n_changed)(struct store_query *query);
    void (*finish)(struct store_query *query);
    /* The kind and the text of the last failure: STATUS_DISK_FULL, STATUS_EXISTS (a constraint), STATUS_CONFLICT (the
     * wait for a lock has ended in vain), STATUS_INVALID (the address) or STATUS_IO. */
    status (*fault)(void *db, char *text, size_t n_text);
    /* Whether the connection is as it was opened; false when it was lost since, which ends its locks. It says nothing
     * about the next moment. */
    bool (*is_alive)(void *db);
    /* Calls `changed` with the id of each job that any daemon has changed since the last call, and with NULL when the
     * connection was lost meanwhile, so that ids may be missing; the connection is one that reads. Without other
     * daemons this function is NULL. */
    void (*notices)(void *db, void (*changed)(void *context, const char *job_id), void *context);
};

struct store_link;

/* SQL that differs. */
struct store_phrases {
    const char *begin;      /* begins a transaction that writes */
    const char *sample_key; /* the key by which samples are sorted, whatever the case of A-Z */
    const char *queue;      /* the query of store_job_queue */
};

struct store_driver {
    const char *id;     /* "sqlite.v1"; also in the report of the doctor */
    const char *scheme; /* how addresses begin: "postgres"; "": any path */
    bool shared;        /* several daemons may use the database at once (store_cluster.h) */
    struct store_phrases phrase;
    /* Gives the calls, and loads them first where they are a plug-in. STATUS_UNSUPPORTED names the missing file or
     * library. */
    status (*load)(const struct store_calls **calls, struct error *err);
    /* Whether a database may lie here; NULL: anywhere. */
    status (*check_place)(const char *address, struct error *err);
    /* Brings the schema to the present version, or only checks that it has it. */
    status (*prepare)(struct store_link *link, const char *address, bool migrate, struct error *err);
    /* Lets the next changes need as little new space as possible; NULL: the server's disk is another one. */
    void (*make_room)(struct store_link *link, const char *address);
};

#endif
