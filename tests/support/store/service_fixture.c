#include "tests/support/store/service_fixture.h"
#include "server/main/service_open.h"
#include "server/settings/job_paths.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char small[] = "{\"sample\":\"small\",\"volume\":{\"files\":[\"scan.tif\"],\"voxel_size_um\":2.0},"
                            "\"measurements\":{\"file\":\"rows.csv\"}}";

static int open_service(struct service_fixture *f)
{
    struct error err = {0};
    struct log *log = NULL;
    f->log_stream = open_memstream(&f->log, &f->n_log);
    if (f->log_stream == NULL || log_open(NULL, f->log_stream, LOG_LEVEL_INFO, &log, &err) != STATUS_OK) return -1;
    if (service_open(&f->settings, log, &f->service, &err) == STATUS_OK) return 0;
    printf("%s\n", err.text);
    return -1;
}

static void close_service(struct service_fixture *f)
{
    struct log *log = f->service->log;
    service_close(f->service);
    log_close(log);
    fclose(f->log_stream);
    free(f->log);
}

int service_fixture_setup(void **state)
{
    struct service_fixture *f = calloc(1, sizeof *f);
    if (f == NULL || scratch_folder_setup(&f->folder) != 0) return -1;
    settings_init(&f->settings);
    snprintf(f->settings.data, sizeof f->settings.data, "%s", (const char *)f->folder);
    f->settings.floor_bytes = 0;
    *state = f;
    return open_service(f);
}

int service_fixture_teardown(void **state)
{
    struct service_fixture *f = *state;
    close_service(f);
    int failed = scratch_folder_teardown(&f->folder);
    free(f);
    return failed;
}

void service_fixture_reopen(struct service_fixture *f)
{
    close_service(f);
    assert_int_equal(open_service(f), 0);
}

void service_fixture_job(struct service_fixture *f, const char *document, enum job_state state, double finished_unix_s,
                         char id[STORE_ID_BYTES])
{
    const struct access_grant grant = {0};
    const char *text = document != NULL ? document : small;
    const struct job_request request = {.document = text, .n_bytes = strlen(text), .grant = &grant};
    struct job_refusal refusal = {0};
    struct error err = {0};
    bool replayed;
    if (job_create(f->service, &request, id, &replayed, &refusal, &err) != STATUS_OK) fail_msg("%s", err.text);
    struct job_row row = service_fixture_row(f, id);
    row.state = state;
    row.finished_unix_s = finished_unix_s;
    if (state == JOB_RUNNING) {
        row.attempt = 1;
        snprintf(row.token, sizeof row.token, "a-token");
    }
    service_fixture_update(f, &row);
}

struct job_row service_fixture_row(struct service_fixture *f, const char *id)
{
    struct job_row row;
    assert_int_equal(store_job_look(f->service->store, id, &row, NULL), STATUS_OK);
    return row;
}

void service_fixture_update(struct service_fixture *f, struct job_row *row)
{
    assert_int_equal(store_job_update(f->service->store, row, NULL), STATUS_OK);
}

void service_fixture_write(struct service_fixture *f, const char *id, const char *name, const char *text)
{
    char path[PATH_BYTES];
    path_join(path, f->settings.data, "jobs", id, name, NULL);
    scratch_write(path, text, strlen(text));
}

bool service_fixture_logged(struct service_fixture *f, const char *text)
{
    fflush(f->log_stream);
    return f->log != NULL && strstr(f->log, text) != NULL;
}
