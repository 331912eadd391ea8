#include "server/main/service_open.h"
#include "base/files/durable.h"
#include "server/jobs/change_feed.h"
#include "server/jobs/queue_forecast.h"
#include "server/main/job_recovery.h"
#include "server/settings/job_paths.h"
#include "server/settings/letterhead.h"
#include "server/store/store_settings.h"
#include "server/workers/lease_keeper.h"
#include "server/workers/shared_folder.h"

#include <stdlib.h>

static status make_data_folders(const char *data, struct error *err)
{
    static const char *const part[] = {"jobs", "quarantine"};
    status s = STATUS_OK;
    for (size_t i = 0; s == STATUS_OK && i < 2; i++) {
        char path[PATH_BYTES];
        path_join(path, data, part[i], NULL);
        s = durable_make_folder(path, err);
        if (s == STATUS_OK) s = durable_sync_folder_of(path, err);
    }
    return s;
}

static void publish(void *context, const char *job_id) { change_feed_publish(context, job_id); }

status service_open(const struct settings *settings, struct log *log, struct job_service **out, struct error *err)
{
    struct job_service *v = calloc(1, sizeof *v);
    if (v == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start: out of memory");
    v->settings = settings;
    v->log = log;
    pthread_mutex_init(&v->change.lock, NULL);
    pthread_cond_init(&v->change.next_turn, NULL);
    status s = letterhead_read(settings, &v->letterhead, err);
    if (s != STATUS_OK) {
        service_close(v);
        return s;
    }
    s = make_data_folders(settings->data, err);
    struct error why = {0};
    if (s == STATUS_OK && journal_key_read(settings->data, true, &v->journal_key, &why) != STATUS_OK)
        log_warning(log, "journals of jobs are not sealed: %s", why.text);
    if (s == STATUS_OK) s = store_settings_open(settings, false, &v->store, err);
    if (s == STATUS_OK) s = shared_folder_admit(v, err);
    if (s == STATUS_OK) s = lease_keeper_start(v, &v->keeper, err);
    if (s == STATUS_OK) s = change_feed_new(&v->feed, err);
    v->forecast = queue_forecast_new();
    if (s == STATUS_OK && v->forecast == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot start: out of memory");
    if (s == STATUS_OK) store_on_change(v->store, publish, v->feed);
    if (s == STATUS_OK) s = upload_set_new(v->store, settings->data, settings->commit_bytes, log, &v->upload, err);
    if (s == STATUS_OK && lease_keeper_is_eldest(v)) s = job_recover(v, err);
    if (s != STATUS_OK) {
        service_close(v);
        return error_prefix(err, s, "cannot open data folder '%s'", settings->data);
    }
    *out = v;
    return STATUS_OK;
}

void service_close(struct job_service *v)
{
    if (v == NULL) return;
    lease_keeper_stop(v->keeper);
    upload_set_free(v->upload);
    store_close(v->store);
    queue_forecast_free(v->forecast);
    change_feed_free(v->feed);
    free(v->letterhead);
    pthread_mutex_destroy(&v->change.lock);
    pthread_cond_destroy(&v->change.next_turn);
    free(v);
}
