/* The database that daemons share, and the data folder that they share with it. */
#include "base/clock.h"
#include "server/doctor/doctor_report.h"
#include "server/store/store_cluster.h"
#include "server/store/store_settings.h"
#include "server/workers/shared_folder.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { CLOCK_MOST_S = 1, ROUND_TRIPS = 10 };

static void examine_server(struct doctor *d, struct store *store)
{
    struct error err = {0};
    struct store_server server;
    double now_s = 0, begin_s = clock_monotonic_s();
    status s = store_server_look(store, &server, &err);
    for (int i = 0; s == STATUS_OK && i < ROUND_TRIPS; i++) s = store_clock(store, &now_s, &err);
    if (s != STATUS_OK) {
        doctor_say(d, DOCTOR_FAULT, "database", "%s", err.text);
        return;
    }
    double trip_ms = 1e3 * (clock_monotonic_s() - begin_s) / (ROUND_TRIPS + 1), lag_s = now_s - clock_wall_s();
    if (!server.syncs)
        doctor_say(d, DOCTOR_FAULT, "database",
                   "PostgreSQL %s does not write safely: set fsync and full_page_writes to on in postgresql.conf",
                   server.version);
    else
        doctor_say(d, trip_ms > 20 ? DOCTOR_NOTE : DOCTOR_OK, "database", "PostgreSQL %s%s answers in %.1f ms",
                   server.version, server.encrypted ? " over TLS" : "", trip_ms);
    if (!server.encrypted && !server.local)
        doctor_say(d, DOCTOR_NOTE, "database",
                   "the connection crosses the network without TLS; add ?sslmode=verify-full to server.store");
    if (fabs(lag_s) > CLOCK_MOST_S)
        doctor_say(d, DOCTOR_FAULT, "clock", "this machine's clock is %.1f s %s that of the database; set both by NTP",
                   fabs(lag_s), lag_s > 0 ? "behind" : "ahead of");
}

static void examine_daemons(struct doctor *d, struct store *store)
{
    struct daemon_row *row = NULL;
    size_t n = 0;
    double now_s = 0;
    if (store_clock(store, &now_s, NULL) != STATUS_OK || store_daemon_list(store, &row, &n, NULL) != STATUS_OK) return;
    if (n == 0) doctor_say(d, DOCTOR_OK, "daemons", "none has a lease");
    for (size_t i = 0; i < n; i++) {
        const double left_s = row[i].until_unix_s - now_s;
        const char *url = row[i].url[0] != '\0' ? row[i].url : "no address yet";
        row[i].host[strcspn(row[i].host, " ")] = '\0';
        if (left_s > 0)
            doctor_say(d, DOCTOR_OK, "daemons", "%s, process %lld, %s: its lease lasts %.0f s more", row[i].host,
                       (long long)row[i].pid, url, left_s);
        else
            doctor_say(d, DOCTOR_NOTE, "daemons", "%s, process %lld: its lease ended %.0f s ago; others take over",
                       row[i].host, (long long)row[i].pid, -left_s);
    }
    free(row);
}

static void examine_shared_folder(struct doctor *d)
{
    struct error err = {0};
    double lag_s = 0;
    const char *data = d->settings->data;
    if (shared_folder_check(data, &lag_s, &err) != STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "shared folder", "%s", err.text);
    else
        doctor_say(d, DOCTOR_OK, "shared folder", "locks, syncs, O_EXCL and renames work as seen from this machine");
    if (fabs(lag_s) > CLOCK_MOST_S)
        doctor_say(d, DOCTOR_NOTE, "clock", "the clock of '%s' is %.1f s %s that of this machine", data, fabs(lag_s),
                   lag_s > 0 ? "behind" : "ahead of");
}

void doctor_examine_store(struct doctor *d)
{
    struct store *store = NULL;
    struct error err = {0};
    examine_shared_folder(d);
    status s = store_settings_open(d->settings, true, &store, &err);
    if (s != STATUS_OK) doctor_say(d, s == STATUS_CONFLICT ? DOCTOR_NOTE : DOCTOR_FAULT, "database", "%s", err.text);
    if (store != NULL) examine_server(d, store);
    if (s == STATUS_OK) examine_daemons(d, store);
    store_close(store);
}
