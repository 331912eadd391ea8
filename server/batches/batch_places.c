#include "server/batches/batch_places.h"
#include "base/files/file_tree.h"
#include "server/jobs/job_access.h"
#include "server/settings/job_paths.h"

#include <stdio.h>

static const char aside[] = "new";
enum { SLICE = 250 };

status batch_places_make(struct job_service *v, const char *batch, const struct job_row *row, size_t n,
                         struct error *err)
{
    char folder[PATH_BYTES];
    status s = STATUS_OK;
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        path_join(folder, v->settings->data, aside, batch, row[i].id, NULL);
        s = job_fill_place(v, &row[i], folder, err);
        if (s == STATUS_OK && (i % SLICE == SLICE - 1 || i + 1 == n)) s = job_sync_all(v, err);
    }
    return s;
}

void batch_places_move(struct job_service *v, const char *batch, const struct job_row *row, size_t n)
{
    char from[PATH_BYTES], to[PATH_BYTES];
    for (size_t i = 0; i < n; i++) {
        path_join(from, v->settings->data, aside, batch, row[i].id, NULL);
        path_join(to, v->settings->data, "jobs", row[i].id, NULL);
        if (rename(from, to) != 0) return;
    }
}

void batch_places_discard(struct job_service *v, const char *batch)
{
    char folder[PATH_BYTES];
    struct error err = {0};
    path_join(folder, v->settings->data, aside, batch, NULL);
    if (file_tree_remove(folder, &err) != STATUS_OK) log_warning(v->log, "%s", err.text);
}

void batch_places_clear(struct job_service *v)
{
    char folder[PATH_BYTES];
    struct error err = {0};
    path_join(folder, v->settings->data, aside, NULL);
    if (file_tree_remove(folder, &err) != STATUS_OK) log_warning(v->log, "%s", err.text);
}
