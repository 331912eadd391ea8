#include "base/version.h"
#include "optimizer/job/document/catalogue_json.h"
#include "optimizer/job/document/job_limits.h"
#include "optimizer/job/options/option_json.h"
#include "optimizer/job/stage_table.h"
#include "server/endpoints/handlers.h"
#include "server/http/http_reply.h"
#include "server/http/http_server.h"
#include "server/http/static_files.h"
#include "server/rescue/backup_keeper.h"
#include "server/settings/job_paths.h"
#include "server/views/job_view.h"
#include "server/views/result_files.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

void handle_about(struct http_request *r)
{
    const struct settings *s = r->service->settings;
    size_t n_stage = 0;
    const struct pipeline_stage_info *stage = pipeline_stage_table(&n_stage);
    json_t *stages = json_array(), *states = json_array();
    for (size_t i = 0; i < n_stage; i++)
        json_array_append_new(stages, json_pack("{s:s,s:s,s:f}", "name", stage[i].name, "title", stage[i].title,
                                                "weight", stage[i].weight));
    for (int i = 0; i < JOB_N_STATE; i++) json_array_append_new(states, json_string(job_state_name((enum job_state)i)));
    json_t *limits =
        json_pack("{s:I,s:I,s:I,s:I,s:I,s:I,s:I}", "max_document_bytes", (json_int_t)s->max_document_bytes,
                  "max_file_bytes", (json_int_t)s->max_file_bytes, "max_patch_bytes", (json_int_t)s->max_patch_bytes,
                  "max_files_per_job", (json_int_t)s->max_files_per_job, "max_jobs", (json_int_t)s->max_jobs,
                  "max_photographs", (json_int_t)JOB_MAX_PHOTOGRAPH, "workers", (json_int_t)s->workers);
    reply_json(r, MHD_HTTP_OK,
               json_pack("{s:s,s:s,s:o,s:o,s:o}", "name", "selvedge", "version", SELVEDGE_VERSION, "stages", stages,
                         "states", states, "limits", limits));
}

/* The options of a job document, and the models with the meanings of their parameters. */
void handle_options(struct http_request *r)
{
    json_t *options = job_options_json(), *catalogue = catalogue_json();
    json_object_set(options, "models", json_object_get(catalogue, "models"));
    json_decref(catalogue);
    reply_json(r, MHD_HTTP_OK, options);
}

static void reply_static(struct http_request *r, const char *url)
{
    const struct static_file *f = static_files_find(http_server_files(r->server), url);
    int fd = f == NULL ? -1 : open(f->path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        reply_code(r, "not_found", "", "there is nothing at this address");
    else
        reply_file(r, fd, content_type_of(f->path));
    reply_policy(r, POLICY_DASHBOARD);
}

void handle_static(struct http_request *r) { reply_static(r, r->url); }
void handle_openapi(struct http_request *r) { reply_static(r, "/v1/openapi.json"); }

void handle_livez(struct http_request *r) { reply_json(r, MHD_HTTP_OK, json_pack("{s:s}", "status", "alive")); }

void handle_readyz(struct http_request *r)
{
    struct error err = {0};
    status s = job_disk_check(r->service, 0, &err);
    if (s == STATUS_OK) s = store_probe(r->service->store, &err);
    if (s == STATUS_OK)
        reply_json(r, MHD_HTTP_OK, json_pack("{s:s}", "status", "ready"));
    else
        reply_problem(r, "not_ready", &err, NULL);
}

static void print_counts(FILE *out, const struct http_request *r)
{
    int64_t n[JOB_N_STATE] = {0};
    store_job_count(r->service->store, n, NULL);
    fprintf(out, "# HELP selvedge_jobs Jobs by state.\n# TYPE selvedge_jobs gauge\n");
    for (int i = 0; i < JOB_N_STATE; i++)
        fprintf(out, "selvedge_jobs{state=\"%s\"} %lld\n", job_state_name((enum job_state)i), (long long)n[i]);
    fprintf(out, "# HELP selvedge_jobs_finished_total Jobs that have ended since the daemon started.\n# TYPE "
                 "selvedge_jobs_finished_total counter\n");
    for (int i = JOB_SUCCEEDED; i < JOB_N_STATE; i++)
        fprintf(out, "selvedge_jobs_finished_total{state=\"%s\"} %llu\n", job_state_name((enum job_state)i),
                (unsigned long long)atomic_load(&r->service->n_finished_total[i]));
    fprintf(out, "# HELP selvedge_verdicts_total Jobs that have succeeded since the daemon started, by their verdict.\n"
                 "# TYPE selvedge_verdicts_total counter\n");
    for (int i = 0; i < VERDICT_N_CODE; i++)
        fprintf(out, "selvedge_verdicts_total{verdict=\"%s\"} %llu\n", verdict_code_id((enum verdict_code)i),
                (unsigned long long)atomic_load(&r->service->n_verdict_total[i]));
    fprintf(
        out,
        "# HELP selvedge_http_requests_total Replies by status code.\n# TYPE selvedge_http_requests_total counter\n");
    for (unsigned i = 100; i < HTTP_MAX_STATUS; i++) {
        unsigned long long k = http_server_n_reply(r->server, i);
        if (k > 0) fprintf(out, "selvedge_http_requests_total{code=\"%u\"} %llu\n", i, k);
    }
}

static void print_one(FILE *out, const char *name, const char *kind, const char *help, double value)
{
    fprintf(out, "# HELP %s %s\n# TYPE %s %s\n%s %.17g\n", name, help, name, kind, name, value);
}

static void print_backup(FILE *out, const struct job_service *v)
{
    struct backup_state b;
    backup_keeper_state(v->backup, &b);
    print_one(out, "selvedge_backup_last_success_timestamp_seconds", "gauge",
              "Time of the newest backup of the database; 0: there is none, or backups are off.",
              (double)b.last_good_unix_s);
    print_one(out, "selvedge_backup_size_bytes", "gauge", "Size of that backup.", (double)b.last_good_bytes);
    print_one(out, "selvedge_backups_total", "counter", "Backups since the daemon started.", (double)b.n_good);
    print_one(out, "selvedge_backup_failures_total", "counter", "Backups that failed since the daemon started.",
              (double)b.n_failed);
}

static double resident_bytes(void)
{
    long total = 0, resident = 0;
    FILE *f = fopen("/proc/self/statm", "re");
    if (f == NULL) return 0;
    int n = fscanf(f, "%ld %ld", &total, &resident);
    fclose(f);
    return n == 2 ? (double)resident * (double)sysconf(_SC_PAGESIZE) : 0;
}

void handle_metrics(struct http_request *r)
{
    char *text = NULL;
    size_t n = 0;
    long long free_bytes = 0;
    FILE *out = open_memstream(&text, &n);
    if (out == NULL) {
        reply_code(r, "internal", "", "out of memory");
        return;
    }
    const struct job_service *v = r->service;
    path_free_bytes(v->settings->data, &free_bytes, NULL);
    print_counts(out, r);
    print_one(out, "selvedge_attempts_total", "counter", "Workers started.", (double)atomic_load(&v->n_attempt_total));
    print_one(out, "selvedge_attempts_lost_total", "counter", "Workers that died.",
              (double)atomic_load(&v->n_lost_total));
    print_one(out, "selvedge_upload_bytes_total", "counter", "Bytes of input files received.",
              (double)upload_bytes_total(v->upload));
    print_one(out, "selvedge_disk_free_bytes", "gauge", "Free space under the data folder.", (double)free_bytes);
    print_one(out, "selvedge_disk_floor_bytes", "gauge", "Free space below which work stops.",
              (double)v->settings->floor_bytes);
    print_backup(out, v);
    print_one(out, "selvedge_http_connections", "gauge", "Open connections.",
              (double)http_server_n_connection(r->server));
    print_one(out, "process_resident_memory_bytes", "gauge", "Memory of the daemon itself.", resident_bytes());
    if (fclose(out) == 0 && text != NULL)
        reply_text(r, MHD_HTTP_OK, "text/plain; version=0.0.4; charset=utf-8", text, n);
    free(text);
}
