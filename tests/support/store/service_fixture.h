/* A job service on an empty data folder with SQLite, without threads, workers or HTTP: for tests of the state of
 * jobs. */
#ifndef SELVEDGE_TESTS_SERVICE_FIXTURE_H
#define SELVEDGE_TESTS_SERVICE_FIXTURE_H

#include "server/jobs/job_service.h"

struct service_fixture {
    struct settings settings;
    struct job_service *service;
    void *folder; /* of scratch_folder.h */
    char *log;    /* what the service has logged; owned */
    size_t n_log;
    FILE *log_stream;
};

/* cmocka set-up and tear-down: *state becomes a struct service_fixture *. */
int service_fixture_setup(void **state);
int service_fixture_teardown(void **state);
/* Closes the service and opens it again on the same folder. */
void service_fixture_reopen(struct service_fixture *f);

/* Makes a job with this document (NULL: a small one) and writes this state and end into its row. */
void service_fixture_job(struct service_fixture *f, const char *document, enum job_state state, double finished_unix_s,
                         char id[STORE_ID_BYTES]);
/* Reads a job's row, without the document. */
struct job_row service_fixture_row(struct service_fixture *f, const char *id);
void service_fixture_update(struct service_fixture *f, struct job_row *row);
/* Writes a file of a job's folder. */
void service_fixture_write(struct service_fixture *f, const char *id, const char *name, const char *text);
/* Whether the log has this text. */
bool service_fixture_logged(struct service_fixture *f, const char *text);

#endif
