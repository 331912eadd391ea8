#include "server/workers/backends/slurm_request.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define MIB (INT64_C(1) << 20)

/* Memory of a job without scan and photographs, and of each core's own buffers. */
static const int64_t base_bytes = 256 * MIB, core_bytes = 32 * MIB;
/* Memory for each byte of a scan's files: 22 bytes for a voxel of one byte, and files are compressed to a quarter at
 * best. Of other files: photographs of one or two bytes a channel are decoded to numbers of four bytes, twice. */
enum { SCAN_BYTES = 22 * 4, OTHER_BYTES = 16, PLAN_PERCENT = 150, SECONDS_OF_MINUTE = 60 };

/* Options of sbatch that slurm.extra_arguments may have. Others are set by the daemon, or would make it lose its jobs:
 * another cluster, arrays, another name. */
static const char *const allowed[] = {"bb",
                                      "begin",
                                      "constraint",
                                      "core-spec",
                                      "cpu-freq",
                                      "deadline",
                                      "distribution",
                                      "exclude",
                                      "exclusive",
                                      "gpus",
                                      "gres",
                                      "hint",
                                      "hold",
                                      "licenses",
                                      "mail-type",
                                      "mail-user",
                                      "mcs-label",
                                      "network",
                                      "nice",
                                      "nodelist",
                                      "oversubscribe",
                                      "power",
                                      "prefer",
                                      "priority",
                                      "profile",
                                      "reservation",
                                      "spread-job",
                                      "switches",
                                      "thread-spec",
                                      "threads-per-core",
                                      "tmp",
                                      "use-min-nodes",
                                      "wckey",
                                      "cores-per-socket"};

static bool is_allowed(const char *argument, size_t n)
{
    if (n < 3 || strncmp(argument, "--", 2) != 0) return false;
    size_t length = 0;
    while (length < n - 2 && argument[2 + length] != '=') length++;
    for (size_t i = 0; i < sizeof allowed / sizeof *allowed; i++)
        if (strlen(allowed[i]) == length && strncmp(argument + 2, allowed[i], length) == 0) return true;
    return false;
}

/* A name that stands behind an option: no blank, and nothing that begins another option. */
static status check_name(const char *key, const char *value, struct error *err)
{
    static const char good[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.,:@+-";
    if (value[0] != '-' && strspn(value, good) == strlen(value)) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, key, "setting '%s' is '%.80s', which is no name that Slurm could have",
                           key, value);
}

static status check_extra(const char *list, struct error *err)
{
    size_t n_argument = 0;
    for (const char *at = list; *at != '\0';) {
        size_t n = strcspn(at, " ");
        if (n > 0 && ++n_argument > SLURM_MAX_ARGUMENT / 2)
            return error_set_field(err, STATUS_INVALID, "slurm.extra_arguments",
                                   "setting 'slurm.extra_arguments' has more than %d options", SLURM_MAX_ARGUMENT / 2);
        if (n > 0 && !is_allowed(at, n))
            return error_set_field(err, STATUS_INVALID, "slurm.extra_arguments",
                                   "setting 'slurm.extra_arguments' has '%.*s', which is none of the options that it "
                                   "may have (docs/cluster.md), written as --name=value",
                                   n > 80 ? 80 : (int)n, at);
        at += n + (at[n] == ' ');
    }
    return STATUS_OK;
}

status slurm_request_check(const struct settings *s, struct error *err)
{
    status r = check_name("slurm.partition", s->slurm_partition, err);
    if (r == STATUS_OK) r = check_name("slurm.account", s->slurm_account, err);
    if (r == STATUS_OK) r = check_name("slurm.qos", s->slurm_qos, err);
    if (r == STATUS_OK) r = check_name("slurm.mpi", s->slurm_mpi, err);
    if (r == STATUS_OK) r = check_extra(s->slurm_extra, err);
    if (r != STATUS_OK) return r;
    if (strchr(s->data, '%') != NULL || strchr(s->data, '\\') != NULL || strchr(s->data, '\n') != NULL)
        return error_set_field(err, STATUS_INVALID, "server.data",
                               "with jobs.backend = slurm the data folder's path must not have '%%', '\\' or a line "
                               "end, which Slurm would take for something else: '%.200s'",
                               s->data);
    if (s->slurm_time_limit_s > 0 && s->slurm_warn_s >= s->slurm_time_limit_s)
        return error_set_field(err, STATUS_INVALID, "slurm.warn_s",
                               "setting 'slurm.warn_s' is %lld, which leaves nothing of slurm.time_limit_s = %lld",
                               (long long)s->slurm_warn_s, (long long)s->slurm_time_limit_s);
    return STATUS_OK;
}

struct slurm_need slurm_need_of(const struct settings *s, const struct file_row *file, size_t n_file,
                                struct slurm_memory known)
{
    struct slurm_need need = {.cores = s->threads > 0 ? s->threads : s->slurm_cores};
    int64_t scan_bytes = 0, other_bytes = 0;
    for (size_t i = 0; i < n_file; i++) {
        if (strcmp(file[i].role, "volume") == 0)
            scan_bytes += file[i].size_bytes;
        else
            other_bytes += file[i].size_bytes;
    }
    scan_bytes = scan_bytes > s->volume_memory_bytes / SCAN_BYTES ? s->volume_memory_bytes : scan_bytes * SCAN_BYTES;
    need.memory_bytes = base_bytes + need.cores * core_bytes;
    need.memory_bytes +=
        known.planned_bytes > 0 ? known.planned_bytes / 100 * PLAN_PERCENT : scan_bytes + other_bytes * OTHER_BYTES;
    if (s->slurm_memory_bytes > 0) need.memory_bytes = s->slurm_memory_bytes;
    if (known.least_bytes > need.memory_bytes) need.memory_bytes = known.least_bytes;
    if (s->resident_limit_bytes > 0 && need.memory_bytes > s->resident_limit_bytes)
        need.memory_bytes = s->resident_limit_bytes;
    return need;
}

void slurm_comment(const char *job_id, int64_t attempt, char comment[SLURM_COMMENT_BYTES])
{
    snprintf(comment, SLURM_COMMENT_BYTES, "selvedge:%s:%lld", job_id, (long long)attempt);
}

/* Text that grows in an array of fixed size; an overflow is noted. */
struct writer {
    char *text;
    size_t n, most;
    bool full;
};

__attribute__((format(printf, 2, 3))) static void print(struct writer *w, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    int n = vsnprintf(w->text + w->n, w->most - w->n, format, list);
    va_end(list);
    if (n < 0 || (size_t)n >= w->most - w->n)
        w->full = true;
    else
        w->n += (size_t)n;
}

/* As one word of the shell. */
static void print_quoted(struct writer *w, const char *text)
{
    print(w, "'");
    for (; *text != '\0'; text++) print(w, *text == '\'' ? "'\\''" : "%c", *text);
    print(w, "'");
}

/* Adds an argument that is made here. */
__attribute__((format(printf, 3, 4))) static void add(struct slurm_request *q, struct writer *w, const char *format,
                                                      ...)
{
    va_list list;
    size_t n = 0;
    while (q->argument[n] != NULL) n++;
    if (n >= SLURM_MAX_ARGUMENT || w->full) {
        w->full = true;
        return;
    }
    char *at = w->text + w->n;
    va_start(list, format);
    int k = vsnprintf(at, w->most - w->n, format, list);
    va_end(list);
    if (k < 0 || (size_t)k + 1 >= w->most - w->n) {
        w->full = true;
        return;
    }
    w->n += (size_t)k + 1;
    q->argument[n] = at;
}

/* Writes "selvedge-" and the sample. Characters other than letters, digits, '.', '_' and '-' become '_'. */
static void name_of(const char *sample, char name[80])
{
    snprintf(name, 80, "selvedge-%.60s", sample);
    for (char *c = name; *c != '\0'; c++)
        if (strchr("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-", *c) == NULL) *c = '_';
}

static void add_resources(struct slurm_request *q, struct writer *w, const struct settings *s,
                          const struct slurm_need *need)
{
    const long long memory_mib = (long long)((need->memory_bytes + MIB - 1) / MIB), cores = (long long)need->cores;
    add(q, w, "--ntasks=%lld", (long long)s->slurm_ranks);
    add(q, w, "--cpus-per-task=%lld", cores);
    if (s->slurm_ranks > 1)
        add(q, w, "--mem-per-cpu=%lldM", (memory_mib + cores - 1) / cores);
    else {
        add(q, w, "--nodes=1");
        add(q, w, "--mem=%lldM", memory_mib);
    }
    if (s->slurm_time_limit_s > 0)
        add(q, w, "--time=%lld:%02lld", (long long)(s->slurm_time_limit_s / SECONDS_OF_MINUTE),
            (long long)(s->slurm_time_limit_s % SECONDS_OF_MINUTE));
    /* the worker has taken the place of the script; srun's steps get the signal themselves */
    add(q, w, "--signal=%sTERM@%lld", s->slurm_ranks > 1 ? "" : "B:", (long long)s->slurm_warn_s);
}

static void add_extra(struct slurm_request *q, struct writer *w, const char *list)
{
    for (const char *at = list; *at != '\0';) {
        size_t n = strcspn(at, " ");
        if (n > 0) add(q, w, "%.*s", (int)n, at);
        at += n + (at[n] == ' ');
    }
}

static void write_script(const struct settings *s, const struct slurm_submission *m, const char *folder,
                         struct writer *w)
{
    char speeds[PATH_BYTES];
    struct worker_arguments a;
    path_join(speeds, s->data, "speeds.json", NULL);
    const struct worker_paths paths = {
        .program = m->program, .job_folder = folder, .speeds = speeds, .threads = m->need.cores};
    worker_arguments_set(&a, &paths, s);
    print(w, "#!/bin/sh\numask 077\nulimit -c 0\nulimit -n %lld\n", (long long)s->open_files);
    if (s->file_limit_bytes > 0) print(w, "ulimit -f %lld\n", (long long)((s->file_limit_bytes + 511) / 512));
    if (s->memory_limit_bytes > 0) print(w, "ulimit -v %lld\n", (long long)(s->memory_limit_bytes / 1024));
    print(w, "exec ");
    if (s->slurm_ranks > 1) {
        char srun[PATH_BYTES] = "srun";
        if (s->slurm_commands[0] != '\0') path_join(srun, s->slurm_commands, "srun", NULL);
        print_quoted(w, srun);
        if (s->slurm_mpi[0] != '\0') print(w, " --mpi=%s", s->slurm_mpi);
        print(w, " --kill-on-bad-exit=0 ");
    }
    for (size_t i = 0; a.argument[i] != NULL; i++) {
        /* each start claims the attempt under a name of its own, so one that Slurm repeats finds it taken */
        if (a.argument[i + 1] == NULL) print(w, "--start \"slurm-$SLURM_JOB_ID.${SLURM_RESTART_COUNT:-0}\" ");
        print_quoted(w, a.argument[i]);
        print(w, "%s", a.argument[i + 1] == NULL ? "\n" : " ");
    }
}

status slurm_request_make(const struct settings *s, const struct slurm_submission *m, struct slurm_request *q,
                          struct error *err)
{
    char folder[PATH_BYTES], name[80], comment[SLURM_COMMENT_BYTES];
    struct writer w = {.text = q->text, .most = sizeof q->text}, script = {.text = q->script, .most = sizeof q->script};
    memset(q->argument, 0, sizeof q->argument);
    path_join(folder, s->data, "jobs", m->row->id, NULL);
    name_of(m->row->sample, name);
    slurm_comment(m->row->id, m->row->attempt, comment);
    add(q, &w, "%s", m->sbatch);
    add(q, &w, "--parsable");
    add(q, &w, "--job-name=%s", name);
    add(q, &w, "--comment=%s", comment);
    add(q, &w, "--no-requeue"); /* the daemon starts it again, with a token of its own */
    add(q, &w, "--export=ALL");
    add(q, &w, "--chdir=%s", folder);
    add(q, &w, "--output=%s/console.txt", folder);
    add(q, &w, "--open-mode=append");
    if (s->slurm_partition[0] != '\0') add(q, &w, "--partition=%s", s->slurm_partition);
    if (s->slurm_account[0] != '\0') add(q, &w, "--account=%s", s->slurm_account);
    if (s->slurm_qos[0] != '\0') add(q, &w, "--qos=%s", s->slurm_qos);
    add_resources(q, &w, s, &m->need);
    add_extra(q, &w, s->slurm_extra);
    write_script(s, m, folder, &script);
    if (!w.full && !script.full) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "cannot submit job %s to Slurm: its folder's path is too long", m->row->id);
}
