#include "server/settings/settings.h"

#include <errno.h>
#include <ini.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

struct setting {
    const char *section, *name;
    size_t offset;
    const char *text;           /* default of a text setting; NULL for a number */
    int64_t value, least, most; /* default and range of a number */
    const char *help;
    const char *const *words; /* the values that a text setting may have; NULL: any */
};

#define TEXT(section, name, member, text, help)                                                                        \
    {                                                                                                                  \
        section, name, offsetof(struct settings, member), text, 0, 0, 0, help, NULL                                    \
    }
#define WORD(section, name, member, text, words, help)                                                                 \
    {                                                                                                                  \
        section, name, offsetof(struct settings, member), text, 0, 0, 0, help, words                                   \
    }
#define NUMBER(section, name, member, value, least, most, help)                                                        \
    {                                                                                                                  \
        section, name, offsetof(struct settings, member), NULL, value, least, most, help, NULL                         \
    }

#define MIB (INT64_C(1) << 20)
#define GIB (INT64_C(1) << 30)

static const char *const sandbox_words[] = {"auto", "required", "off", NULL};
static const char *const backend_words[] = {"local", "slurm", NULL};
static const char *const paper_words[] = {"A4", "letter", NULL};
static const char *const required_words[] = {"auto", "always", NULL};

static const struct setting table[] = {
    TEXT("server", "listen", listen, "127.0.0.1",
         "IP address to listen on; another than 127.0.0.1 or ::1 needs access tokens and TLS (docs/safety.md)"),
    TEXT("server", "unix_socket", unix_socket, "",
         "path of a unix socket to listen on instead of address and port; only this user may connect to it"),
    TEXT("server", "public_origin", public_origin, "",
         "address under which a proxy on this machine publishes the service, such as https://selvedge.example.org"),
    TEXT("server", "tls_certificate", tls_certificate, "",
         "PEM file of a certificate and its chain; with tls_key, the TCP port speaks https only"),
    TEXT("server", "tls_key", tls_key, "",
         "PEM file of the certificate's key, which other users must not be able to read"),
    NUMBER("server", "port", port, 7878, 0, 65535, "TCP port; 0 picks a free one and prints it"),
    TEXT("server", "data", data, "selvedge-data",
         "folder of the database and of all jobs, on a local file system; with a shared database, on a shared one"),
    TEXT("server", "store", store, "",
         "address postgresql://USER@HOST/DATABASE of a database that several daemons share; empty: a file in the data "
         "folder (docs/shared-database.md)"),
    TEXT("server", "store_password_file", store_password_file, "",
         "file with the password of that database, which other users must not be able to read"),
    NUMBER("server", "lease_s", lease_s, 15, 2, 3600,
           "time in seconds after which daemons that share the database take over the jobs of one that is silent"),
    TEXT("server", "web", web, "", "folder of the dashboard; empty: found from the folder of the program"),
    TEXT("server", "openapi", openapi, "",
         "file served at /v1/openapi.json; empty: found from the folder of the program"),
    NUMBER("server", "max_connections", max_connections, 2048, 8, 60000,
           "number of open connections, each with a thread; further clients wait"),
    NUMBER("server", "idle_timeout_s", idle_timeout_s, 60, 1, 3600,
           "time in seconds after which a silent connection is closed"),
    NUMBER("server", "header_deadline_s", header_deadline_s, 20, 1, 3600,
           "time in seconds in which the head of a request must arrive"),
    NUMBER("server", "min_rate_bytes_per_s", min_rate_bytes_per_s, 1024, 0, GIB,
           "requests that arrive, and answers that are read, more slowly for 10 s are ended; 0: no limit"),
    NUMBER("server", "max_document_bytes", max_document_bytes, MIB, 1024, MIB, "size of the largest JSON body"),
    NUMBER("server", "max_batch_bytes", max_batch_bytes, 16 * MIB, 1024, 256 * MIB,
           "size of the largest JSON body that submits a batch"),
    NUMBER("server", "body_memory_bytes", body_memory_bytes, 64 * MIB, MIB, 64 * GIB,
           "memory for all JSON bodies together; requests beyond it are answered 503 with Retry-After, and slow "
           "ones are ended (docs/api.md)"),
    NUMBER("upload", "max_file_bytes", max_file_bytes, 1024 * GIB, 1, INT64_MAX / 2, "size of the largest input file"),
    NUMBER("upload", "max_patch_bytes", max_patch_bytes, 64 * MIB, MIB, GIB, "size of the largest piece of an upload"),
    NUMBER("upload", "max_files_per_job", max_files_per_job, 8192, 1, 1000000, "number of input files of one job"),
    NUMBER("upload", "commit_bytes", commit_bytes, 8 * MIB, 65536, GIB,
           "an upload is written to disk durably after this many bytes at the latest"),
    NUMBER("jobs", "max_jobs", max_jobs, 10000, 1, 10000000,
           "number of jobs kept; new jobs are refused until some are deleted"),
    NUMBER("jobs", "keep_versions", keep_versions, 5, 0, 1000,
           "number of earlier results that a job keeps when it is edited and run again; 0: none"),
    NUMBER("jobs", "workers", workers, 1, 1, SETTING_MAX_WORKERS,
           "number of jobs that run at the same time; with a cluster, that are in its queue"),
    WORD("jobs", "backend", backend, "local", backend_words,
         "where jobs run: local, as processes of this machine; slurm, on the nodes of a cluster (docs/cluster.md)"),
    TEXT("jobs", "worker", worker, "", "the worker program; empty: selvedge-worker beside the daemon"),
    WORD("jobs", "sandbox", sandbox, "auto", sandbox_words,
         "keeps workers to their job's folder and to the system calls that they need: auto, as far as the kernel can; "
         "required, else jobs fail; off"),
    TEXT("jobs", "pass_environment", pass_environment, "PATH LANG LC_ALL TZ OPENBLAS_NUM_THREADS",
         "names of the environment variables that workers get from the daemon; they see no others"),
    NUMBER("jobs", "threads", threads, 0, 0, 1024, "computing threads of a worker; 0: one for each processor"),
    NUMBER("jobs", "ranks", ranks, 1, 1, 4096,
           "processes of the local backend that share the paths of one job by MPI; 1: none but the worker"),
    NUMBER("jobs", "nice", nice, 10, 0, 19, "niceness of workers (their scheduling priority)"),
    NUMBER("jobs", "memory_limit_bytes", memory_limit_bytes, 0, 0, INT64_MAX / 2,
           "limit on a worker's address space, which includes the files that it maps (see volume_memory_bytes); 0: no "
           "limit"),
    NUMBER("jobs", "resident_limit_bytes", resident_limit_bytes, 8 * GIB, 0, INT64_MAX / 2,
           "memory that a worker may hold, in RAM and swap, without files that it maps; a job that holds more fails; "
           "0: no "
           "limit"),
    NUMBER("jobs", "volume_memory_bytes", volume_memory_bytes, 2 * GIB, 256 * MIB, INT64_MAX / 2,
           "resident memory for scans; larger scans are processed in files of the job's folder (22 bytes per voxel)"),
    NUMBER(
        "jobs", "scratch_limit_bytes", scratch_limit_bytes, 64 * GIB, 0, INT64_MAX / 2,
        "disk that these files of one job may take; a scan that needs more is refused before it is read; 0: no limit"),
    NUMBER("jobs", "file_limit_bytes", file_limit_bytes, 64 * GIB, 0, INT64_MAX / 2,
           "size of the largest file that a worker may write; 0: no limit"),
    NUMBER("jobs", "folder_depth", folder_depth, 16, 0, 64,
           "levels of folders that a worker may nest in its job's folder; a job with more fails; 0: no limit"),
    NUMBER("jobs", "thread_limit", thread_limit, 1024, 0, 60000,
           "threads that a worker may have, those of its libraries too; a job with more fails; 0: no limit"),
    NUMBER("jobs", "open_files", open_files, 1024, 64, 1000000, "number of files that a worker may have open"),
    NUMBER("jobs", "oom_score_adj", oom_score_adj, 500, 0, 1000,
           "how readily the kernel ends a worker, rather than another process, when memory is out"),
    NUMBER("jobs", "cancel_grace_s", cancel_grace_s, 10, 0, 3600,
           "time in seconds from SIGTERM to SIGKILL when a worker must stop"),
    NUMBER("jobs", "max_lost_attempts", max_lost_attempts, 3, 1, 100,
           "a job fails after its worker has died this many times"),
    NUMBER("jobs", "heartbeat_timeout_s", heartbeat_timeout_s, 300, 2, 86400,
           "a worker that reports nothing for this time in seconds is killed (a lost attempt)"),
    TEXT("webhook", "url", webhook_url, "",
         "http:// or https:// address that is told when a job has ended; empty: none (docs/automation.md)"),
    TEXT("webhook", "secret_file", webhook_secret_file, "",
         "file with the secret that signs what is sent, 16 to 1024 bytes, which other users must not be able to read"),
    NUMBER("webhook", "timeout_s", webhook_timeout_s, 10, 1, 300, "time in seconds that the address has to answer"),
    NUMBER("webhook", "retry_s", webhook_retry_s, 5, 1, 3600,
           "pause in seconds before the second try; each further one is twice as long, up to an hour"),
    NUMBER("webhook", "max_tries", webhook_max_tries, 16, 1, 1000, "tries after which a delivery is given up"),
    NUMBER("jobs", "time_limit_s", time_limit_s, 604800, 0, 31536000,
           "time in seconds that a worker may run; its job then fails, and a retry resumes it; 0: no limit"),
    NUMBER("jobs", "check_limit_s", check_limit_s, 300, 1, 86400,
           "time in seconds in which a worker must have judged the files of a job that is not started yet"),
    NUMBER("jobs", "plan_queued", plan_queued, 1, 0, 1,
           "1: jobs that wait in the queue are planned, so that the forecast of the queue knows how long each takes"),
    NUMBER(
        "jobs", "pictures", pictures, 1, 0, 1,
        "1: after the result of a job with a cloth, and while no job waits or runs, its picture in the studio and its "
        "twin are made; with the backend local"),
    TEXT(
        "slurm", "commands", slurm_commands, "",
        "folder of sbatch, squeue and scancel; empty: found in PATH. Read with jobs.backend = slurm (docs/cluster.md), "
        "as all of [slurm]"),
    TEXT("slurm", "partition", slurm_partition, "", "partition of the jobs; empty: the cluster's default"),
    TEXT("slurm", "account", slurm_account, "", "account that the jobs are charged to; empty: the user's default"),
    TEXT("slurm", "qos", slurm_qos, "", "quality of service of the jobs; empty: the user's default"),
    NUMBER("slurm", "time_limit_s", slurm_time_limit_s, 0, 0, 31536000,
           "time in seconds that one start of a worker asks for; it goes on from a checkpoint in the next one; 0: the "
           "partition's"),
    NUMBER("slurm", "warn_s", slurm_warn_s, 120, 10, 65535,
           "time in seconds before the time limit at which a worker is told to write a checkpoint"),
    NUMBER("slurm", "cores", slurm_cores, 4, 1, 1024, "cores of a worker where jobs.threads is 0"),
    NUMBER("slurm", "memory_bytes", slurm_memory_bytes, 0, 0, INT64_MAX / 2,
           "memory that a worker asks for; 0: by the size of its files"),
    NUMBER("slurm", "ranks", slurm_ranks, 1, 1, 1024, "processes of a worker, started by srun where there are several"),
    TEXT("slurm", "mpi", slurm_mpi, "", "kind of MPI that srun starts them with, such as pmix; empty: the cluster's"),
    NUMBER("slurm", "poll_s", slurm_poll_s, 5, 1, 300, "time in seconds between two looks at Slurm's list of jobs"),
    NUMBER("slurm", "file_delay_s", slurm_file_delay_s, 10, 0, 600,
           "time in seconds that the last files of a worker may take to be seen on the shared file system"),
    TEXT("slurm", "extra_arguments", slurm_extra, "",
         "more options of sbatch between blanks, such as --constraint=avx2 --nice=10 (docs/cluster.md lists them)"),
    WORD("access", "required", access_required, "auto", required_words,
         "whether requests need a token: auto, once one was ever made; always, also with a database that has none"),
    NUMBER("access", "requests_per_minute", requests_per_minute, 0, 0, 1000000,
           "requests that a token may make in a minute, unless it was made with a number of its own; 0: no limit"),
    NUMBER("access", "stored_bytes", stored_bytes, 0, 0, INT64_MAX / 2,
           "bytes of input files that the owner of a token may declare, unless the token has its own; 0: no limit"),
    NUMBER("access", "jobs", jobs_of_owner, 0, 0, 10000000,
           "jobs that the owner of a token may keep, unless the token has a number of its own; 0: no limit"),
    NUMBER("access", "session_s", session_s, 43200, 60, 31536000,
           "time in seconds after which a browser must sign in again"),
    NUMBER("retention", "max_age_days", retention_max_age_days, 0, 0, 36500,
           "days after its end at which a job is removed, unless it is kept; 0: never (docs/operating.md)"),
    NUMBER("retention", "max_bytes", retention_max_bytes, 0, 0, INT64_MAX / 2,
           "disk that all jobs may take; while they take more, the jobs that ended first are removed, unless they are "
           "kept; 0: no limit"),
    NUMBER("retention", "check_s", retention_check_s, 600, 1, 86400,
           "time in seconds after which the daemon looks at both, and to the next look"),
    NUMBER("backup", "every_s", backup_every_s, 3600, 0, 31536000,
           "time in seconds between backups of the database (docs/operating.md); 0: none"),
    TEXT("backup", "folder", backup_folder, "",
         "folder of the backups, better on another disk; empty: backup in the data folder"),
    NUMBER("backup", "keep", backup_keep, 24, 1, 10000, "number of the newest backups that are kept"),
    NUMBER("backup", "keep_days", backup_keep_days, 7, 0, 3650,
           "number of days of which, besides, the newest backup is kept"),
    NUMBER("disk", "floor_bytes", floor_bytes, GIB, 0, INT64_MAX / 2,
           "free space below which new work is refused and running jobs pause"),
    NUMBER("disk", "ballast_bytes", ballast_bytes, 8 * MIB, 0, GIB,
           "reserved disk space, which is released when the disk is full so that deleting jobs still works; "
           "at least 1 MiB while there is room"),
    TEXT("report", "laboratory", report_laboratory, "", "name at the head of reports (docs/operating.md); empty: none"),
    TEXT("report", "logo", report_logo, "",
         "PNG or SVG file of at most 256 KiB at the head of reports, which is read at the start; empty: none"),
    WORD("report", "paper", report_paper, "A4", paper_words, "paper on which reports are printed: A4 or letter"),
};
enum { N_SETTING = sizeof table / sizeof table[0] };

static char *text_of(struct settings *s, const struct setting *t) { return (char *)s + t->offset; }
static int64_t *number_of(struct settings *s, const struct setting *t)
{
    return (int64_t *)(void *)((char *)s + t->offset);
}

void settings_init(struct settings *s)
{
    memset(s, 0, sizeof *s);
    for (size_t i = 0; i < N_SETTING; i++) {
        if (table[i].text != NULL)
            snprintf(text_of(s, &table[i]), SETTING_TEXT_BYTES, "%s", table[i].text);
        else
            *number_of(s, &table[i]) = table[i].value;
    }
}

static status set_one(struct settings *s, const struct setting *t, const char *value, struct error *err)
{
    char key[96];
    snprintf(key, sizeof key, "%s.%s", t->section, t->name);
    if (t->text != NULL) {
        if (strlen(value) >= SETTING_TEXT_BYTES)
            return error_set_field(err, STATUS_INVALID, key, "setting '%s' has more than %d bytes", key,
                                   SETTING_TEXT_BYTES - 1);
        bool allowed = t->words == NULL;
        for (size_t i = 0; !allowed && t->words[i] != NULL; i++) allowed = strcmp(value, t->words[i]) == 0;
        if (!allowed)
            return error_set_field(err, STATUS_INVALID, key,
                                   "setting '%s' is '%.80s'; its values are in the "
                                   "configuration that 'selvedged --print-config' prints",
                                   key, value);
        snprintf(text_of(s, t), SETTING_TEXT_BYTES, "%s", value);
        return STATUS_OK;
    }
    char *end;
    errno = 0;
    long long v = strtoll(value, &end, 10);
    if (*value == '\0' || *end != '\0' || errno != 0)
        return error_set_field(err, STATUS_INVALID, key, "setting '%s' is '%.80s', which is not a whole number", key,
                               value);
    if (v < t->least || v > t->most)
        return error_set_field(err, STATUS_INVALID, key, "setting '%s' is %lld, which is outside %lld..%lld", key, v,
                               (long long)t->least, (long long)t->most);
    *number_of(s, t) = v;
    return STATUS_OK;
}

status settings_set(struct settings *s, const char *key, const char *value, struct error *err)
{
    for (size_t i = 0; i < N_SETTING; i++) {
        size_t n = strlen(table[i].section);
        if (strncmp(key, table[i].section, n) == 0 && key[n] == '.' && strcmp(key + n + 1, table[i].name) == 0)
            return set_one(s, &table[i], value, err);
    }
    return error_set_field(err, STATUS_INVALID, key, "setting '%.100s' does not exist", key);
}

struct reading {
    struct settings *s;
    struct error *err;
    status result;
};

static int on_entry(void *context, const char *section, const char *name, const char *value)
{
    struct reading *r = context;
    char key[160];
    snprintf(key, sizeof key, "%s.%s", section, name);
    if (r->result == STATUS_OK) r->result = settings_set(r->s, key, value, r->err);
    return r->result == STATUS_OK;
}

status settings_read_file(struct settings *s, const char *path, struct error *err)
{
    struct reading r = {s, err, STATUS_OK};
    int line = ini_parse(path, on_entry, &r);
    if (r.result != STATUS_OK) return error_prefix(err, r.result, "cannot use '%s', line %d", path, line);
    if (line == -1) return error_set_errno(err, "cannot read configuration '%s'", path);
    if (line != 0)
        return error_set(err, STATUS_INVALID, "cannot read configuration '%s': line %d is not 'name = value'", path,
                         line);
    return STATUS_OK;
}

void settings_print(FILE *out)
{
    const char *section = "";
    fprintf(out, "; Every setting of selvedged with its default. Options of the command line override this file.\n");
    for (size_t i = 0; i < N_SETTING; i++) {
        const struct setting *t = &table[i];
        if (strcmp(section, t->section) != 0) fprintf(out, "\n[%s]\n", t->section);
        section = t->section;
        fprintf(out, "; %s", t->help);
        if (t->text == NULL && t->most < INT64_MAX / 2)
            fprintf(out, " (%lld..%lld)", (long long)t->least, (long long)t->most);
        if (t->text != NULL)
            fprintf(out, "\n%s =%s%s\n", t->name, *t->text ? " " : "", t->text);
        else
            fprintf(out, "\n%s = %lld\n", t->name, (long long)t->value);
    }
}
