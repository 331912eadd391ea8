#include "base/clock.h"
#include "server/store/drivers/driver_table.h"
#include "server/store/store.h"
#include "server/store/store_rows.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const state_name[JOB_N_STATE] = {"draft",     "queued", "running",  "paused",
                                                    "succeeded", "failed", "cancelled"};

const char *job_state_name(enum job_state state) { return state_name[state]; }

bool job_state_parse(const char *name, enum job_state *state)
{
    for (int i = 0; i < JOB_N_STATE; i++)
        if (strcmp(name, state_name[i]) == 0) {
            *state = (enum job_state)i;
            return true;
        }
    return false;
}

status store_check_place(const char *address, struct error *err)
{
    const struct store_driver *driver = store_driver_of(address);
    return driver->check_place == NULL ? STATUS_OK : driver->check_place(address, err);
}

void store_place_release(struct store_place *place)
{
    if (place->password != NULL) {
        sodium_memzero(place->password, strlen(place->password));
        free(place->password);
    }
    place->password = NULL;
}

static status open_link(struct store *store, struct store_link *link, bool only_reads, bool create, struct error *err)
{
    link->phrase = &store->driver->phrase;
    snprintf(link->application, sizeof link->application, "selvedge-tool");
    if (link->calls->open(&store->place, link->application, only_reads, create, &link->db) == STATUS_OK)
        return STATUS_OK;
    if (link->db == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot open the database: out of memory");
    return store_error(link, "cannot open the database", err);
}

static status copy_place(struct store *store, const struct store_place *place, struct error *err)
{
    store->place = *place;
    if (place->password == NULL) return STATUS_OK;
    store->place.password = strdup(place->password);
    return store->place.password != NULL ? STATUS_OK
                                         : error_set(err, STATUS_NO_MEMORY, "cannot open the database: out of memory");
}

/* The second connection only reads: it waits neither for a change nor for the sync that ends it, and sees every change
 * whose call has returned. */
static status open_links(struct store *store, bool migrate, struct error *err)
{
    const struct store_calls *calls = NULL;
    status s = store->driver->load(&calls, err);
    if (s != STATUS_OK) return s;
    store->write.calls = store->read.calls = store->gate.link.calls = store->lease.calls = calls;
    s = open_link(store, &store->write, false, migrate, err);
    if (s == STATUS_OK) s = store->driver->prepare(&store->write, store->place.address, migrate, err);
    if (s == STATUS_OK) s = open_link(store, &store->read, true, false, err);
    if (s == STATUS_OK && store->driver->shared) s = open_link(store, &store->gate.link, false, false, err);
    if (s == STATUS_OK && store->driver->shared) s = open_link(store, &store->lease, false, false, err);
    store->write.gate = &store->gate;
    return s;
}

static status open_store(const struct store_place *place, bool migrate, struct store **out, struct error *err)
{
    status s = store_check_place(place->address, err);
    if (s != STATUS_OK) return s;
    struct store *store = calloc(1, sizeof *store);
    if (store == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot open the database: out of memory");
    store->driver = store_driver_of(place->address);
    pthread_mutex_init(&store->write.lock, NULL);
    pthread_mutex_init(&store->read.lock, NULL);
    pthread_mutex_init(&store->gate.link.lock, NULL);
    pthread_mutex_init(&store->lease.lock, NULL);
    pthread_mutex_init(&store->name_lock, NULL);
    s = copy_place(store, place, err);
    if (s == STATUS_OK) s = open_links(store, migrate, err);
    *out = NULL;
    if (s == STATUS_OK || (s == STATUS_CONFLICT && !migrate))
        *out = store;
    else
        store_close(store);
    return s;
}

status store_open_place(const struct store_place *place, struct store **out, struct error *err)
{
    return open_store(place, true, out, err);
}

status store_open_place_beside(const struct store_place *place, struct store **out, struct error *err)
{
    return open_store(place, false, out, err);
}

status store_open(const char *path, struct store **out, struct error *err)
{
    struct store_place place = {0};
    snprintf(place.address, sizeof place.address, "%s", path);
    return store_open_place(&place, out, err);
}

static void close_link(struct store_link *link)
{
    if (link->db != NULL) link->calls->close(link->db);
    pthread_mutex_destroy(&link->lock);
}

void store_close(struct store *store)
{
    if (store == NULL) return;
    close_link(&store->read); /* first, so that the last connection can write and remove the WAL of SQLite */
    close_link(&store->write);
    close_link(&store->gate.link);
    close_link(&store->lease);
    pthread_mutex_destroy(&store->name_lock);
    store_place_release(&store->place);
    free(store);
}

void store_on_change(struct store *store, void (*changed)(void *context, const char *job_id), void *context)
{
    store->changed = changed;
    store->changed_context = context;
}

status store_report(const struct store *store, status s, const char *job_id)
{
    if (s == STATUS_OK && store->changed != NULL) store->changed(store->changed_context, job_id);
    return s;
}

status store_probe(struct store *store, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = store_run(&store->write, NULL, err,
                         "INSERT INTO probe (one, at) VALUES (1, ?) ON CONFLICT (one) DO UPDATE SET at = excluded.at",
                         "d", clock_wall_s());
    pthread_mutex_unlock(&store->write.lock);
    return s;
}

void store_make_room(struct store *store)
{
    if (store->driver->make_room == NULL) return;
    pthread_mutex_lock(&store->write.lock);
    store->driver->make_room(&store->write, store->place.address);
    pthread_mutex_unlock(&store->write.lock);
}
