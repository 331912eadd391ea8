#include "server/rescue/backup_files.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define NAME_FORMAT "selvedge-%Y%m%dT%H%M%SZ.db"
enum { DAY_S = 86400 };

void backup_folder(const struct settings *settings, char out[PATH_BYTES])
{
    if (settings->backup_folder[0] != '\0')
        snprintf(out, PATH_BYTES, "%s", settings->backup_folder);
    else
        path_join(out, settings->data, "backup", NULL);
}

static void name_of(int64_t made_unix_s, char out[40])
{
    time_t t = (time_t)made_unix_s;
    struct tm utc;
    if (gmtime_r(&t, &utc) == NULL || strftime(out, 40, NAME_FORMAT, &utc) == 0) out[0] = '\0';
}

void backup_path(const char *folder, int64_t made_unix_s, char out[PATH_BYTES])
{
    char name[40];
    name_of(made_unix_s, name);
    path_join(out, folder, name, NULL);
}

/* Whether it is the name of a backup; temporary files have other names. */
static bool parse(const char *name, struct backup_file *out)
{
    struct tm utc = {0};
    char again[40];
    const char *end = strptime(name, NAME_FORMAT, &utc);
    if (end == NULL || *end != '\0') return false;
    out->made_unix_s = (int64_t)timegm(&utc);
    name_of(out->made_unix_s, again);
    snprintf(out->name, sizeof out->name, "%s", again);
    return strcmp(name, again) == 0;
}

static int newest_first(const void *a, const void *b)
{
    const struct backup_file *x = a, *y = b;
    return (x->made_unix_s < y->made_unix_s) - (x->made_unix_s > y->made_unix_s);
}

status backup_list(const char *folder, struct backup_file **out, size_t *n_out, struct error *err)
{
    struct backup_file *file = NULL;
    size_t n = 0;
    status s = STATUS_OK;
    DIR *d = opendir(folder);
    if (d == NULL && errno != ENOENT) return error_set_errno(err, "cannot list backups in '%s'", folder);
    for (struct dirent *e; s == STATUS_OK && d != NULL && (e = readdir(d)) != NULL;) {
        struct backup_file found;
        if (!parse(e->d_name, &found)) continue;
        struct backup_file *more = realloc(file, (n + 1) * sizeof *more);
        if (more == NULL) {
            s = error_set(err, STATUS_NO_MEMORY, "cannot list backups: out of memory");
            break;
        }
        file = more;
        file[n++] = found;
    }
    if (d != NULL) closedir(d);
    if (s != STATUS_OK) {
        free(file);
        return s;
    }
    if (n > 0) qsort(file, n, sizeof *file, newest_first);
    *out = file;
    *n_out = n;
    return STATUS_OK;
}

void backup_choose(const struct backup_file *file, size_t n, int64_t keep, int64_t days, bool *kept)
{
    int64_t n_day = 0, last_day = INT64_MIN;
    for (size_t i = 0; i < n; i++) {
        int64_t day = file[i].made_unix_s / DAY_S;
        bool first_of_day = day != last_day;
        if (first_of_day) n_day++;
        last_day = day;
        kept[i] = (int64_t)i < keep || (first_of_day && n_day <= days);
    }
}

/* Removes unfinished backups of a killed daemon. */
static void remove_parts(const char *folder)
{
    static const char ending[] = ".part";
    DIR *d = opendir(folder);
    for (struct dirent *e; d != NULL && (e = readdir(d)) != NULL;) {
        struct backup_file whole;
        char path[PATH_BYTES], name[256];
        char *end = NULL;
        snprintf(name, sizeof name, "%s", e->d_name);
        for (char *p = name; (p = strstr(p, ending)) != NULL; p++) end = p;
        if (end == NULL) continue;
        *end = '\0'; /* SQLite may have a journal beside it */
        path_join(path, folder, e->d_name, NULL);
        if (parse(name, &whole)) unlink(path);
    }
    if (d != NULL) closedir(d);
}

status backup_prune(const char *folder, int64_t keep, int64_t days, struct error *err)
{
    struct backup_file *file = NULL;
    size_t n = 0;
    status s = backup_list(folder, &file, &n, err);
    bool *kept = s == STATUS_OK ? calloc(n + 1, sizeof *kept) : NULL;
    if (s == STATUS_OK && kept == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot prune backups: out of memory");
    if (s == STATUS_OK) remove_parts(folder);
    if (s == STATUS_OK) backup_choose(file, n, keep, days, kept);
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        char path[PATH_BYTES];
        path_join(path, folder, file[i].name, NULL);
        if (!kept[i] && unlink(path) != 0 && errno != ENOENT)
            s = error_set_errno(err, "cannot remove the old backup '%s'", path);
    }
    free(kept);
    free(file);
    return s;
}
