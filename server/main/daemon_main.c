/* selvedged, the daemon: HTTP server, database of jobs and supervision of workers. It never reads volumes or
 * pictures and computes nothing; workers do. */
#include "base/files/durable.h"
#include "base/process.h"
#include "base/version.h"
#include "optimizer/job/job_folder.h"
#include "server/endpoints/endpoint_table.h"
#include "server/http/http_server.h"
#include "server/http/static_files.h"
#include "server/jobs/disk_reserve.h"
#include "server/main/first_token.h"
#include "server/main/rescue_commands.h"
#include "server/main/service_open.h"
#include "server/main/webhook.h"
#include "server/rescue/backup_keeper.h"
#include "server/rescue/rebuild.h"
#include "server/retention/retention_watch.h"
#include "server/settings/job_paths.h"
#include "server/store/store_cluster.h"
#include "server/store/store_settings.h"
#include "server/workers/lease_keeper.h"
#include "server/workers/picture_maker.h"
#include "server/workers/queue_planner.h"
#include "server/workers/supervisor.h"

#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <signal.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

static const char usage[] =
    "usage: selvedged [options]\n"
    "  --config FILE     settings (see config/selvedge.conf)\n"
    "  --data DIR        folder of the database and of all jobs\n"
    "  --port N          TCP port; 0 picks a free one\n"
    "  --listen ADDRESS  a loopback address (default 127.0.0.1)\n"
    "  --worker PATH     the worker program (default: selvedge-worker beside this program)\n"
    "  --web DIR         the dashboard's folder\n"
    "  --set KEY=VALUE   any setting, for example --set jobs.workers=2\n"
    "  --make-token NAME make an access token, print it and end; every request needs one from then on\n"
    "  --scope SCOPE     what that token may do: read, submit or admin (default admin)\n"
    "  --print-config    print every setting with its default and an explanation\n"
    "  --version, --help\n"
    "instead of serving (docs/operating.md):\n"
    "  --backup FILE     copy the database, also while a daemon runs\n"
    "  --rebuild         make the database anew from backup and job folders; with --resume,\n"
    "                    jobs that were running are queued\n"
    "  --quarantine list, --quarantine restore ID\n"
    "                    folders that no job in the database had\n"
    "  --doctor [JOB]    examine this machine and the data folder, or a job: its id or its folder\n";

enum { DESCRIPTORS_OF_DAEMON = 128 };
enum { LOCK_TRIES = 41, LOCK_PAUSE_US = 50000 };

static const struct {
    const char *option, *key;
} option_key[] = {{"data", "server.data"},
                  {"port", "server.port"},
                  {"listen", "server.listen"},
                  {"worker", "jobs.worker"},
                  {"web", "server.web"}};

static status set_pair(struct settings *s, const char *pair, struct error *err)
{
    char key[128];
    const char *equal = strchr(pair, '=');
    if (equal == NULL || (size_t)(equal - pair) >= sizeof key)
        return error_set(err, STATUS_INVALID, "--set needs KEY=VALUE, not '%.100s'", pair);
    snprintf(key, sizeof key, "%.*s", (int)(equal - pair), pair);
    return settings_set(s, key, equal + 1, err);
}

/* A token to be made in place of serving. */
struct token_wish {
    const char *name; /* NULL: none */
    enum access_scope scope;
};

/* Returns -1 to go on, or the exit code. The configuration file is read first, so that the other options override it
 * wherever they stand. */
static int read_options(int argc, char **argv, struct settings *s, struct token_wish *wish,
                        struct rescue_request *rescue, struct error *err)
{
    static const struct option option[] = {
        {"config", 1, NULL, 'c'},     {"data", 1, NULL, 0},           {"port", 1, NULL, 1},
        {"listen", 1, NULL, 2},       {"worker", 1, NULL, 3},         {"web", 1, NULL, 4},
        {"set", 1, NULL, 's'},        {"print-config", 0, NULL, 'p'}, {"make-token", 1, NULL, 't'},
        {"scope", 1, NULL, 'o'},      {"version", 0, NULL, 'v'},      {"help", 0, NULL, 'h'},
        {"backup", 1, NULL, 'b'},     {"rebuild", 0, NULL, 'r'},      {"resume", 0, NULL, 'm'},
        {"quarantine", 1, NULL, 'q'}, {"doctor", 0, NULL, 'd'},       {NULL, 0, NULL, 0}};
    for (int pass = 0; pass < 2; pass++) {
        optind = 1;
        for (int c; (c = getopt_long(argc, argv, "", option, NULL)) != -1;) {
            status r = STATUS_OK;
            if (c == '?') return 2;
            if (c == 'h') return printf("%s", usage) < 0;
            if (c == 'v') return printf("selvedged %s\n", SELVEDGE_VERSION) < 0;
            if (c == 'p') return settings_print(stdout), 0;
            if (c == 'c' && pass == 0) r = settings_read_file(s, optarg, err);
            if (c == 's' && pass == 1) r = set_pair(s, optarg, err);
            if (c == 'm') rescue->resume = true;
            if (c == 'b' || c == 'q') rescue->word = optarg;
            if (c == 'b') rescue->command = RESCUE_BACKUP;
            if (c == 'q') rescue->command = RESCUE_QUARANTINE;
            if (c == 'r') rescue->command = RESCUE_REBUILD;
            if (c == 'd') rescue->command = RESCUE_DOCTOR;
            if (c < 5 && pass == 1) r = settings_set(s, option_key[c].key, optarg, err);
            if (c == 't') wish->name = optarg;
            if (c == 'o' && !access_scope_parse(optarg, &wish->scope))
                r = error_set(err, STATUS_INVALID, "--scope is read, submit or admin, not '%.40s'", optarg);
            if (r != STATUS_OK) return 2;
        }
        if (optind < argc) rescue->operand = argv[optind++];
        if (optind < argc) {
            error_set(err, STATUS_INVALID, "unexpected argument '%s'", argv[optind]);
            return 2;
        }
    }
    return rescue_check(rescue, err) == STATUS_OK ? -1 : 2;
}

/* Path of the worker program: from the settings, or beside this program. */
static void worker_path(const struct settings *s, char out[PATH_BYTES])
{
    char program[PATH_BYTES];
    program_folder(program, sizeof program);
    if (s->worker[0] != '\0')
        snprintf(out, PATH_BYTES, "%s", s->worker);
    else
        path_join(out, program, "selvedge-worker", NULL);
}

/* Whoever may write into the folder could replace the database, or the files of jobs that others submit. */
static status check_owner(const struct settings *s, struct error *err)
{
    struct stat st;
    if (stat(s->data, &st) != 0) return error_set_errno(err, "cannot examine data folder '%s'", s->data);
    if ((st.st_mode & (S_IWGRP | S_IWOTH)) != 0)
        return error_set(err, STATUS_INVALID,
                         "cannot use data folder '%s': other users may write into it; forbid it with: chmod go-w '%s'",
                         s->data, s->data);
    if (st.st_uid != geteuid() && st.st_uid != 0)
        return error_set(err, STATUS_INVALID,
                         "cannot use data folder '%s': it belongs to another user (number %u), who may write into it",
                         s->data, (unsigned)st.st_uid);
    return STATUS_OK;
}

/* lock: LOCK_EX, or LOCK_SH of daemons that share a database. tries: how often another process may be found to hold it;
 * STATUS_CONFLICT after that. */
static status lock_data(const struct settings *s, int lock, int tries, int *fd, struct error *err)
{
    char path[PATH_BYTES];
    status r = durable_make_folder(s->data, err);
    if (r == STATUS_OK) r = check_owner(s, err);
    if (r != STATUS_OK) return r;
    path_join(path, s->data, "lock", NULL);
    *fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (*fd < 0) return error_set_errno(err, "cannot open '%s'", path);
    /* a process that a killed daemon was starting holds the lock until it becomes a worker, or ends */
    for (int i = 0; i < tries; i++) {
        if (i > 0) usleep(LOCK_PAUSE_US);
        if (flock(*fd, lock | LOCK_NB) == 0) return STATUS_OK;
    }
    return error_set(err, STATUS_CONFLICT, "cannot use data folder '%s': another selvedged is using it", s->data);
}

/* Makes paths from the command line absolute, because workers run in other folders. */
static status make_absolute(char path[SETTING_TEXT_BYTES], struct error *err)
{
    char full[PATH_BYTES];
    if (path[0] == '\0' || path[0] == '/') return STATUS_OK;
    if (getcwd(full, sizeof full) == NULL) return error_set_errno(err, "cannot find the current folder");
    if (strlen(full) + strlen(path) + 2 > SETTING_TEXT_BYTES)
        return error_set(err, STATUS_INVALID, "path '%.200s' is too long", path);
    size_t n = strlen(full);
    snprintf(full + n, sizeof full - n, "/%s", path);
    snprintf(path, SETTING_TEXT_BYTES, "%.*s", SETTING_TEXT_BYTES - 1, full);
    return STATUS_OK;
}

/* A connection has a descriptor of its own and at most one more, of a file. Where the limit cannot be raised there are
 * fewer connections, so that database and workers never lack a descriptor. */
static void fit_descriptors(struct settings *s, struct log *log)
{
    struct rlimit now;
    rlim_t want = (rlim_t)s->max_connections * 2 + DESCRIPTORS_OF_DAEMON;
    if (getrlimit(RLIMIT_NOFILE, &now) != 0 || now.rlim_cur >= want) return;
    now.rlim_cur = now.rlim_max < want ? now.rlim_max : want;
    if (setrlimit(RLIMIT_NOFILE, &now) == 0 && now.rlim_cur >= want) return;
    int64_t least = 8, n = ((int64_t)now.rlim_cur - DESCRIPTORS_OF_DAEMON) / 2;
    log_warning(log, "%lld descriptors are allowed (LimitNOFILE=, ulimit -n), so %lld connections instead of %lld",
                (long long)now.rlim_cur, (long long)(n > least ? n : least), (long long)s->max_connections);
    s->max_connections = n > least ? n : least;
}

/* Writes daemon.json, {"url", "pid"}, for clients on this machine. A failure is only logged: clients can be given
 * the address, and a full disk is no reason to stop. */
static void announce(const struct settings *s, const char *url, struct log *log)
{
    struct error err = {0};
    char path[PATH_BYTES], text[LISTEN_URL_BYTES + 64];
    int n = snprintf(text, sizeof text, "{\"url\":\"%s\",\"pid\":%d}\n", url, (int)getpid());
    path_join(path, s->data, "daemon.json", NULL);
    if (durable_replace_volatile(path, text, (size_t)n, &err) != STATUS_OK) {
        log_warning(log, "%s", err.text);
        unlink(path); /* an old file would name another port */
    }
    log_info(log, "selvedged %s listens on %s", SELVEDGE_VERSION, url);
    printf("selvedged listens on %s\n", url);
    fflush(stdout);
}

/* Says at the start that reports as PDF cannot be made; where workers run on other machines, nothing is known of it. */
static void note_pdf(const struct settings *s, struct log *log)
{
    char folder[PATH_BYTES];
    if (strcmp(s->backend, "local") == 0 && !program_find(JOB_PDF_PROGRAM, folder, sizeof folder))
        log_info(log, "jobs get no report.pdf: there is no program '" JOB_PDF_PROGRAM
                      "' (Debian package " JOB_PDF_PROGRAM ")");
}

/* Returns whether to try a failed step of the start once more: on a full disk the reserved space is released, so that
 * users can delete jobs. */
static bool make_room(const struct settings *s, struct log *log, status failed, const struct error *err)
{
    if ((failed != STATUS_DISK_FULL && failed != STATUS_IO) || !disk_reserve_release(s->data)) return false;
    log_warning(log, "%s; the reserved disk space (disk.ballast_bytes) has been released to try once more", err->text);
    return true;
}

static status open_service(const struct settings *s, struct log *log, struct job_service **service, struct error *err)
{
    status r;
    do {
        r = rebuild_is_needed(s, err);
        if (r == STATUS_OK) r = service_open(s, log, service, err);
    } while (make_room(s, log, r, err));
    if (r == STATUS_OK) disk_reserve_keep(s, true); /* the space that this start has not needed */
    return r;
}

static status start_webhook(struct job_service *v, struct webhook **webhook, struct error *err)
{
    const struct webhook_setup setup = {.settings = v->settings,
                                        .store = v->store,
                                        .feed = v->feed,
                                        .log = v->log,
                                        .first_daemon = lease_keeper_is_eldest(v)};
    return webhook_start(&setup, webhook, err);
}

static void wait_for_signal(const sigset_t *signals, struct http_server *server, struct log *log)
{
    for (;;) {
        struct timespec second = {1, 0};
        int got = sigtimedwait(signals, NULL, &second);
        http_server_reap(server);
        if (got <= 0) continue;
        /* sent by programs that rotate logs, or to have settings read; a terminal that is closed means it otherwise */
        if (got == SIGHUP && isatty(STDIN_FILENO) != 1) {
            log_info(log, "SIGHUP changes nothing: there is no log file, and settings are read at the start");
            continue;
        }
        log_info(log, "stopping: %s", strsignal(got));
        return;
    }
}

static status serve(struct settings *s, struct log *log, const sigset_t *signals, struct error *err)
{
    struct job_service *service = NULL;
    struct supervisor *supervisor = NULL;
    struct webhook *webhook = NULL;
    struct retention_watch *retention = NULL;
    struct queue_planner *planner = NULL;
    struct picture_maker *pictures = NULL;
    struct backup_keeper *backup = NULL;
    struct static_files *files = NULL;
    struct http_server *server = NULL;
    char worker[PATH_BYTES];
    char url[LISTEN_URL_BYTES] = "";
    worker_path(s, worker);
    status r = static_files_new(s->web, s->openapi, log, &files, err);
    if (r == STATUS_OK) r = open_service(s, log, &service, err);
    if (r != STATUS_OK) goto out;
    r = start_webhook(service, &webhook, err);
    if (make_room(s, log, r, err)) r = start_webhook(service, &webhook, err);
    if (r == STATUS_OK) r = backup_keeper_start(service, &backup, err);
    if (r == STATUS_OK) r = supervisor_start(service, worker, &supervisor, err);
    if (r == STATUS_OK) r = retention_watch_start(service, &retention, err);
    if (r == STATUS_OK) r = queue_planner_start(service, &planner, err);
    if (r == STATUS_OK) r = picture_maker_start(service, &pictures, err);
    if (r == STATUS_OK) r = http_server_start(service, endpoint_find, files, &server, url, err);
    if (r == STATUS_OK) {
        announce(s, url, log);
        note_pdf(s, log);
        if (store_daemon_announce(service->store, url, err) != STATUS_OK) log_warning(log, "%s", err->text);
        wait_for_signal(signals, server, log);
    }
    if (service != NULL) atomic_store(&service->stopping, true);
out:
    http_server_stop(server); /* first, because its threads wake the supervisor */
    picture_maker_stop(pictures);
    queue_planner_stop(planner);
    retention_watch_stop(retention); /* before the supervisor, because it wakes it */
    supervisor_stop(supervisor);
    webhook_stop(webhook);
    backup_keeper_stop(backup);
    service_close(service);
    disk_reserve_keep(s, true);
    static_files_free(files);
    return r;
}

/* Makes a token and prints it. A daemon may use the data folder meanwhile; without one the lock keeps others away. */
static int make_token(struct settings *s, const struct token_wish *wish)
{
    struct error err = {0};
    char text[ACCESS_SECRET_TEXT_BYTES];
    int lock_fd = -1;
    umask(077);
    status r = sodium_init() < 0 ? error_set(&err, STATUS_INTERNAL, "cannot start libsodium") : STATUS_OK;
    if (r == STATUS_OK) r = make_absolute(s->data, &err);
    if (r == STATUS_OK) r = lock_data(s, LOCK_EX, 1, &lock_fd, &err);
    bool used = r == STATUS_CONFLICT;
    /* a new database in place of a lost one would hide that it is lost */
    if (r == STATUS_OK) r = rebuild_is_needed(s, &err);
    if (r == STATUS_OK || used) r = first_token_make(s, used, wish->name, wish->scope, text, &err);
    if (lock_fd >= 0) close(lock_fd);
    if (r == STATUS_OK) {
        fprintf(stderr, "token '%s' with scope %s; it is shown only now:\n", wish->name,
                access_scope_name(wish->scope));
        r = printf("%s\n", text) > 0 && fflush(stdout) == 0 ? STATUS_OK
                                                            : error_set_errno(&err, "cannot print the token");
        sodium_memzero(text, sizeof text);
    }
    if (r != STATUS_OK) fprintf(stderr, "error: %s\n", err.text);
    return r == STATUS_OK ? 0 : 1;
}

int main(int argc, char **argv)
{
    struct settings settings;
    struct error err = {0};
    struct log *log = NULL;
    struct rescue_request rescue = {0};
    int lock_fd = -1;
    sigset_t signals;
    struct token_wish wish = {.scope = ACCESS_ADMIN};
    settings_init(&settings);
    int code = read_options(argc, argv, &settings, &wish, &rescue, &err);
    if (code >= 0) {
        if (code != 0) fprintf(stderr, "error: %s\n%s", err.text[0] ? err.text : "wrong options", usage);
        return code;
    }
    if (wish.name != NULL) return make_token(&settings, &wish);
    umask(077);
    signal(SIGPIPE, SIG_IGN);
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGHUP);
    pthread_sigmask(SIG_BLOCK, &signals, NULL); /* before any thread starts, so that all threads inherit the mask */
    status r = sodium_init() < 0 ? error_set(&err, STATUS_INTERNAL, "cannot start libsodium") : STATUS_OK;
    if (r == STATUS_OK) r = make_absolute(settings.data, &err);
    if (r == STATUS_OK) r = make_absolute(settings.worker, &err);
    int lock = rescue.command == RESCUE_NONE && store_settings_shared(&settings) ? LOCK_SH : LOCK_EX;
    if (r == STATUS_OK && (rescue.command == RESCUE_NONE || rescue_needs_lock(&rescue)))
        r = lock_data(&settings, lock, LOCK_TRIES, &lock_fd, &err);
    if (r == STATUS_OK) r = log_open(NULL, stderr, LOG_LEVEL_INFO, &log, &err);
    if (r == STATUS_OK) fit_descriptors(&settings, log);
    if (r == STATUS_OK && rescue.command != RESCUE_NONE) {
        char worker[PATH_BYTES];
        worker_path(&settings, worker);
        rescue.worker = worker;
        pthread_sigmask(SIG_UNBLOCK, &signals, NULL);
        r = rescue_run(&settings, &rescue, stdout, &err);
    } else if (r == STATUS_OK)
        r = serve(&settings, log, &signals, &err);
    if (r != STATUS_OK) fprintf(stderr, "error: %s\n", err.text);
    log_close(log);
    if (lock_fd >= 0) close(lock_fd);
    return r == STATUS_OK ? 0 : 1;
}
