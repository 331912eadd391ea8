/* Examines the data folder and the other things that the service needs with these settings. */
#include "base/clock.h"
#include "base/process.h"
#include "base/version.h"
#include "optimizer/job/job_folder.h"
#include "server/doctor/doctor_report.h"
#include "server/http/http_listen.h"
#include "server/http/http_tls.h"
#include "server/http/static_files.h"
#include "server/rescue/backup_files.h"
#include "server/rescue/rebuild.h"
#include "server/settings/job_paths.h"
#include "server/settings/letterhead.h"
#include "server/settings/secret_file.h"
#include "server/store/drivers/store_backup.h"
#include "server/store/store.h"
#include "server/store/store_settings.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

enum { TRY_BYTES = 1 << 20, SECRET_MOST_BYTES = 1 << 16 };

/* Returns whether the folder is there and the user of this process owns it. */
static bool examine_folder(struct doctor *d)
{
    struct stat st;
    const char *data = d->settings->data;
    if (stat(data, &st) != 0 && errno == ENOENT) {
        doctor_say(d, DOCTOR_NOTE, "data", "'%s' does not exist; the first start makes it", data);
        return false;
    }
    if (stat(data, &st) != 0 || !S_ISDIR(st.st_mode)) {
        doctor_say(d, DOCTOR_FAULT, "data", "'%s' cannot be used: %s", data,
                   S_ISDIR(st.st_mode) ? strerror(errno) : "it is not a folder");
        return false;
    }
    if ((st.st_mode & (S_IWGRP | S_IWOTH)) != 0)
        doctor_say(d, DOCTOR_FAULT, "data", "other users may write into it; forbid it with: chmod go-w '%s'", data);
    if (st.st_uid != geteuid()) {
        doctor_say(d, geteuid() == 0 ? DOCTOR_NOTE : DOCTOR_FAULT, "data",
                   "'%s' belongs to another user (number %u); start service and doctor as that user", data,
                   (unsigned)st.st_uid);
        return geteuid() == 0;
    }
    if (access(data, R_OK | W_OK | X_OK) != 0) {
        doctor_say(d, DOCTOR_FAULT, "data", "'%s' cannot be used: %s", data, strerror(errno));
        return false;
    }
    if ((st.st_mode & (S_IWGRP | S_IWOTH)) == 0) doctor_say(d, DOCTOR_OK, "data", "'%s' belongs to this user", data);
    return true;
}

/* Writes and syncs a file without a name; returns the time of the sync, or -1 with *err. */
static double try_sync(const char *folder, struct error *err)
{
    static const char zero[TRY_BYTES];
    double begin_s = clock_monotonic_s();
    int fd = open(folder, O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
    bool written = fd >= 0 && write(fd, zero, sizeof zero) == (ssize_t)sizeof zero && fdatasync(fd) == 0;
    if (!written) error_set_errno(err, "cannot write into '%s'", folder);
    if (fd >= 0) close(fd);
    return written ? clock_monotonic_s() - begin_s : -1;
}

static void examine_disk(struct doctor *d)
{
    char database[PATH_BYTES];
    struct statvfs fs;
    struct error err = {0};
    const char *data = d->settings->data;
    if (statvfs(data, &fs) != 0) return;
    double free_gb = (double)fs.f_bavail * (double)fs.f_frsize / 1e9, floor_gb = (double)d->settings->floor_bytes / 1e9;
    double sync_s = try_sync(data, &err);
    path_join(database, data, "selvedge.db", NULL);
    if (sync_s < 0 || (!store_settings_shared(d->settings) && store_check_place(database, &err) != STATUS_OK))
        doctor_say(d, DOCTOR_FAULT, "disk", "%s", err.text);
    else if (free_gb < floor_gb)
        doctor_say(d, DOCTOR_FAULT, "disk",
                   "%.2f GB are free, and disk.floor_bytes keeps %.2f GB in reserve: no work is taken; free space, or "
                   "remove jobs (selvedge retention)",
                   free_gb, floor_gb);
    else if (fs.f_files > 0 && fs.f_favail < 10000)
        doctor_say(d, DOCTOR_NOTE, "disk", "%llu files can still be made, and a job has some dozens",
                   (unsigned long long)fs.f_favail);
    else if (free_gb < 2 * floor_gb || sync_s > 0.5)
        doctor_say(d, DOCTOR_NOTE, "disk",
                   "%.2f GB are free, %.2f GB of them in reserve; writing 1 MB safely takes %.2f s", free_gb, floor_gb,
                   sync_s);
    else
        doctor_say(d, DOCTOR_OK, "disk", "%.1f GB are free; writing 1 MB safely takes %.3f s", free_gb, sync_s);
}

/* Whether a daemon holds the lock of the data folder. */
static bool daemon_runs(const struct doctor *d)
{
    char path[PATH_BYTES];
    path_join(path, d->settings->data, "lock", NULL);
    int fd = open(path, O_RDWR | O_CLOEXEC);
    /* daemons that share a database share the lock */
    int lock = store_settings_shared(d->settings) ? LOCK_EX : LOCK_SH;
    bool held = fd >= 0 && flock(fd, lock | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (fd >= 0) close(fd); /* and with it the lock */
    return held;
}

static void examine_address(struct doctor *d, bool runs)
{
    struct error err = {0};
    char url[LISTEN_URL_BYTES];
    int fd = -1;
    if (runs)
        doctor_say(d, DOCTOR_OK, "daemon", "it is running on this data folder");
    else if (http_listen(d->settings, true, &fd, url, &err) != STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "address", "%s", err.text);
    else {
        doctor_say(d, DOCTOR_OK, "address", "no daemon runs on this data folder, and it could listen on %s", url);
        close(fd);
        http_listen_end(d->settings);
    }
}

static void examine_database(struct doctor *d)
{
    char path[PATH_BYTES];
    struct store_summary found;
    struct stat st;
    struct error err = {0};
    path_join(path, d->settings->data, "selvedge.db", NULL);
    status s = rebuild_is_needed(d->settings, &err);
    if (s == STATUS_OK) s = store_examine(path, true, &found, &err);
    if (s == STATUS_NOT_FOUND)
        doctor_say(d, DOCTOR_NOTE, "database", "there is none; the first start makes it");
    else if (s != STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "database", "%s", err.text);
    else
        doctor_say(d, DOCTOR_OK, "database", "whole: %lld jobs, %lld files, %.1f MB", (long long)found.n_job,
                   (long long)found.n_file, (double)found.n_bytes / 1e6);
    if (s == STATUS_OK && stat(path, &st) == 0 && (double)st.st_mtim.tv_sec > clock_wall_s() + 60)
        doctor_say(d, DOCTOR_NOTE, "clock", "the database was written %.0f s from now: the clock has been set back",
                   (double)st.st_mtim.tv_sec - clock_wall_s());
}

static void examine_backups(struct doctor *d, bool runs)
{
    char folder[PATH_BYTES];
    struct backup_file *file = NULL;
    size_t n = 0;
    struct error err = {0};
    struct stat data, backup;
    const int64_t every_s = d->settings->backup_every_s;
    backup_folder(d->settings, folder);
    if (backup_list(folder, &file, &n, &err) != STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "backup", "%s", err.text);
    else if (every_s == 0)
        doctor_say(d, DOCTOR_NOTE, "backup", "none is made, because backup.every_s is 0");
    else if (n == 0)
        doctor_say(d, DOCTOR_NOTE, "backup", "there is none yet in '%s'", folder);
    else {
        double age_s = fmax(clock_wall_s() - (double)file[0].made_unix_s, 0);
        bool old = runs && age_s > 3 * (double)every_s;
        bool same = stat(d->settings->data, &data) == 0 && stat(folder, &backup) == 0 && data.st_dev == backup.st_dev;
        doctor_say(d, old ? DOCTOR_NOTE : DOCTOR_OK, "backup", "%zu, the newest %.1f h old%s%s", n, age_s / 3600,
                   old ? ", although one should be made more often: see the log" : "",
                   same ? "; they lie on the disk of the data" : "");
    }
    free(file);
}

static void examine_quarantine(struct doctor *d)
{
    char path[PATH_BYTES];
    size_t n = 0;
    path_join(path, d->settings->data, "quarantine", NULL);
    DIR *folder = opendir(path);
    for (struct dirent *e; folder != NULL && (e = readdir(folder)) != NULL;) n += e->d_name[0] != '.';
    if (folder != NULL) closedir(folder);
    if (n > 0)
        doctor_say(d, DOCTOR_NOTE, "quarantine", "%zu folders; list them with: selvedged --data '%s' --quarantine list",
                   n, d->settings->data);
}

static void examine_secrets(struct doctor *d)
{
    struct error err = {0};
    struct http_tls tls = {0};
    char *secret = NULL;
    size_t n = 0;
    const struct settings *s = d->settings;
    if (http_tls_wanted(s) && http_tls_read(s, &tls, &err) != STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "TLS", "%s", err.text);
    else if (http_tls_wanted(s))
        doctor_say(d, DOCTOR_OK, "TLS", "certificate and key can be read, the key by this user only");
    http_tls_release(&tls);
    if (s->webhook_url[0] == '\0') return;
    if (secret_file_read(s->webhook_secret_file, "webhook.secret_file", SECRET_MOST_BYTES, &secret, &n, &err) !=
        STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "webhook", "%s", err.text);
    else {
        doctor_say(d, DOCTOR_OK, "webhook", "its secret can be read by this user only");
        sodium_memzero(secret, n);
    }
    free(secret);
}

/* Programs of one version belong together; that it runs at all says that its libraries are there. */
static bool examine_worker(struct doctor *d)
{
    char text[400], program[PATH_BYTES], option[] = "--version";
    int code = 0;
    struct error err = {0};
    snprintf(program, sizeof program, "%s", d->worker);
    char *argv[] = {program, option, NULL};
    status s = doctor_execute(argv, text, sizeof text, &code, &err);
    text[strcspn(text, "\n")] = '\0';
    if (s != STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "worker", "%s", err.text);
    else if (code != 0)
        doctor_say(d, DOCTOR_FAULT, "worker", "'%s' does not run: %s", program,
                   code == 132 ? "illegal instruction: this processor lacks what it needs" : text);
    else if (strstr(text, SELVEDGE_VERSION) == NULL)
        doctor_say(d, DOCTOR_FAULT, "worker", "'%s' is '%s', but this program has version %s; install them together",
                   program, text, SELVEDGE_VERSION);
    else
        doctor_say(d, DOCTOR_OK, "worker", "'%s' runs with all its libraries (%s)", program, text);
    return s == STATUS_OK && code == 0;
}

/* A worker enters its sandbox and reads a document there. */
static void examine_sandbox(struct doctor *d)
{
    char folder[] = "/tmp/selvedge-doctor-XXXXXX", path[64], text[700], program[PATH_BYTES];
    char option[] = "--sandbox", mode[] = "required", check[] = "--check";
    int code = 0;
    struct error err = {0};
    if (strcmp(d->settings->sandbox, "off") == 0) {
        doctor_say(d, DOCTOR_NOTE, "sandbox", "workers have none, because jobs.sandbox is off");
        return;
    }
    if (mkdtemp(folder) == NULL) return;
    snprintf(path, sizeof path, "%s/job.json", folder);
    FILE *f = fopen(path, "we");
    if (f != NULL) fputs("{}", f);
    if (f != NULL) fclose(f);
    snprintf(program, sizeof program, "%s", d->worker);
    char *argv[] = {program, option, mode, check, path, folder, NULL};
    status s = doctor_execute(argv, text, sizeof text, &code, &err);
    unlink(path);
    rmdir(folder);
    text[strcspn(text, "\n")] = '\0';
    if (s == STATUS_OK && code == 1) /* an empty document has faults, which it has found in its sandbox */
        doctor_say(d, DOCTOR_OK, "sandbox", "a worker has entered it and worked there");
    else
        doctor_say(d, strcmp(d->settings->sandbox, "required") == 0 ? DOCTOR_FAULT : DOCTOR_NOTE, "sandbox",
                   "a worker could not enter it: %s", s == STATUS_OK ? text : err.text);
}

static void examine_dashboard(struct doctor *d)
{
    static const char *const needed[] = {"/", "/v1/openapi.json", "/vendor/dygraph.min.js", "/vendor/three.module.js"};
    static const char *const from[] = {"its folder", "openapi.json", "package libjs-dygraphs", "package libjs-three"};
    struct static_files *files = NULL;
    struct error err = {0};
    size_t n = 0;
    if (static_files_new(d->settings->web, d->settings->openapi, NULL, &files, &err) != STATUS_OK) {
        doctor_say(d, DOCTOR_FAULT, "dashboard", "%s", err.text);
        return;
    }
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++) {
        bool there = static_files_find(files, needed[i]) != NULL;
        n += there;
        if (!there) doctor_say(d, DOCTOR_NOTE, "dashboard", "'%s' cannot be served: %s is missing", needed[i], from[i]);
    }
    if (n == sizeof needed / sizeof *needed) doctor_say(d, DOCTOR_OK, "dashboard", "it and its libraries are there");
    static_files_free(files);
}

/* The letterhead of reports, and the program that makes PDFs of them. */
static void examine_reports(struct doctor *d)
{
    char folder[PATH_BYTES], *text = NULL;
    struct error err = {0};
    if (letterhead_read(d->settings, &text, &err) != STATUS_OK)
        doctor_say(d, DOCTOR_FAULT, "letterhead", "%s", err.text);
    else if (d->settings->report_laboratory[0] != '\0' || d->settings->report_logo[0] != '\0')
        doctor_say(d, DOCTOR_OK, "letterhead", "name and logo of reports can be used");
    free(text);
    if (strcmp(d->settings->backend, "local") != 0) return; /* reports are made on other machines */
    if (program_find(JOB_PDF_PROGRAM, folder, sizeof folder))
        doctor_say(d, DOCTOR_OK, "pdf", "reports as PDF are made by '%s/" JOB_PDF_PROGRAM "'", folder);
    else
        doctor_say(d, DOCTOR_NOTE, "pdf",
                   "jobs get no report.pdf, because there is no program '" JOB_PDF_PROGRAM
                   "'; install the Debian package " JOB_PDF_PROGRAM);
}

void doctor_examine_service(struct doctor *d)
{
    bool usable = examine_folder(d), runs = usable && daemon_runs(d);
    if (usable) {
        examine_disk(d);
        if (store_settings_shared(d->settings))
            doctor_examine_store(d);
        else {
            examine_database(d);
            examine_backups(d, runs);
        }
        examine_quarantine(d);
    }
    examine_address(d, runs);
    examine_secrets(d);
    if (examine_worker(d)) examine_sandbox(d);
    examine_dashboard(d);
    examine_reports(d);
}
