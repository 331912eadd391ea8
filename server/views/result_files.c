/* Lists and opens the files under results/ or a version of them, always relative to an open folder and never through a
 * link. */
#include "server/views/result_files.h"
#include "base/files/foreign_file.h"
#include "server/settings/job_paths.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct listing {
    struct result_file *file;
    size_t n, capacity;
};

/* Checks one component of a result's path. Temporary files of durable_replace ("x.tmp-AbCdEf") are not results. */
static bool component_valid(const char *name, size_t n)
{
    if (n == 0 || name[0] == '.') return false;
    for (size_t i = 0; i < n; i++) {
        char c = name[i];
        bool fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
                    c == '_' || c == '-';
        if (!fine) return false;
        if (n - i >= 5 && strncmp(name + i, ".tmp-", 5) == 0) return false;
    }
    return true;
}

static status add(struct listing *l, const char *path, const struct stat *st, struct error *err)
{
    if (l->n == RESULT_MAX_FILE)
        return error_set(err, STATUS_TOO_LARGE, "there are more than %d result files", RESULT_MAX_FILE);
    if (l->n == l->capacity) {
        size_t more = l->capacity == 0 ? 64 : l->capacity * 2;
        struct result_file *p = realloc(l->file, more * sizeof *p);
        if (p == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list results: out of memory");
        l->file = p;
        l->capacity = more;
    }
    struct result_file *f = &l->file[l->n++];
    snprintf(f->path, sizeof f->path, "%s", path);
    f->size_bytes = (long long)st->st_size;
    f->modified_unix_s = (double)st->st_mtim.tv_sec + 1e-9 * (double)st->st_mtim.tv_nsec;
    return STATUS_OK;
}

/* Takes ownership of folder_fd. */
static status walk(int folder_fd, const char *prefix, int depth, struct listing *l, struct error *err)
{
    DIR *d = fdopendir(folder_fd);
    if (d == NULL) {
        close(folder_fd);
        return error_set_errno(err, "cannot list results");
    }
    status s = STATUS_OK;
    for (struct dirent *e; s == STATUS_OK && (e = readdir(d)) != NULL;) {
        char path[RESULT_PATH_BYTES];
        struct stat st;
        int n = snprintf(path, sizeof path, "%s%s%s", prefix, *prefix ? "/" : "", e->d_name);
        if (!component_valid(e->d_name, strlen(e->d_name)) || n < 0 || (size_t)n >= sizeof path) continue;
        if (fstatat(dirfd(d), e->d_name, &st, AT_SYMLINK_NOFOLLOW) != 0) continue;
        if (S_ISREG(st.st_mode)) s = add(l, path, &st, err);
        if (!S_ISDIR(st.st_mode) || depth + 1 >= RESULT_MAX_DEPTH) continue;
        int fd = openat(dirfd(d), e->d_name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
        if (fd >= 0) s = walk(fd, path, depth + 1, l, err);
    }
    closedir(d);
    return s;
}

static int by_path(const void *a, const void *b)
{
    return strcmp(((const struct result_file *)a)->path, ((const struct result_file *)b)->path);
}

static int open_results(struct job_service *v, const char *job_id, const char *folder)
{
    char path[PATH_BYTES];
    path_join(path, v->settings->data, "jobs", job_id, folder, NULL);
    return open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

status result_list(struct job_service *v, const char *job_id, const char *folder, struct result_file **file, size_t *n,
                   struct error *err)
{
    struct listing l = {0};
    int fd = open_results(v, job_id, folder);
    status s = STATUS_OK;
    if (fd < 0 && errno != ENOENT && errno != ENOTDIR && errno != ELOOP)
        return error_set_errno(err, "cannot list results");
    if (fd >= 0) s = walk(fd, "", 0, &l, err);
    if (s != STATUS_OK && s != STATUS_TOO_LARGE) {
        free(l.file);
        return s;
    }
    if (l.n > 0) qsort(l.file, l.n, sizeof *l.file, by_path);
    *file = l.file;
    *n = l.n;
    return s;
}

/* Whether every part of a path is one that is listed. */
static bool path_valid(const char *path)
{
    for (int depth = 0; depth < RESULT_MAX_DEPTH; depth++) {
        const size_t n = strcspn(path, "/");
        if (!component_valid(path, n)) return false;
        if (path[n] == '\0') return true;
        path += n + 1;
    }
    return false;
}

status result_open(struct job_service *v, const char *job_id, const char *root, const char *path, int *out,
                   struct error *err)
{
    char folder[PATH_BYTES], name[PATH_BYTES];
    path_join(folder, v->settings->data, "jobs", job_id, NULL);
    path_join(name, root, path, NULL);
    status s = path_valid(path) && strlen(path) < RESULT_PATH_BYTES ? foreign_file_open(folder, name, out, NULL, err)
                                                                    : STATUS_NOT_FOUND;
    return s == STATUS_NOT_FOUND ? error_set(err, s, "there is no such result") : s;
}

const char *content_type_of(const char *name)
{
    static const char *const table[][2] = {
        {".html", "text/html; charset=utf-8"},
        {".css", "text/css; charset=utf-8"},
        {".js", "text/javascript; charset=utf-8"},
        {".mjs", "text/javascript; charset=utf-8"},
        {".json", "application/json"},
        {".svg", "image/svg+xml"},
        {".png", "image/png"},
        {".jpg", "image/jpeg"},
        {".ico", "image/x-icon"},
        {".woff2", "font/woff2"},
        {".txt", "text/plain; charset=utf-8"},
        {".csv", "text/csv; charset=utf-8"},
        {".md", "text/plain; charset=utf-8"},
        {".tif", "image/tiff"},
        {".tiff", "image/tiff"},
        {".exr", "image/x-exr"},
        {".tar", "application/x-tar"},
    };
    size_t n = strlen(name);
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        size_t m = strlen(table[i][0]);
        if (n > m && strcasecmp(name + n - m, table[i][0]) == 0) return table[i][1];
    }
    return "application/octet-stream";
}

json_t *result_files_json(const struct result_file *file, size_t n, const char *root)
{
    char url[2 * RESULT_PATH_BYTES];
    json_t *list = json_array();
    for (size_t i = 0; i < n; i++) {
        snprintf(url, sizeof url, "%s/%s", root, file[i].path);
        json_array_append_new(list,
                              json_pack("{s:s,s:I,s:f,s:s,s:s}", "path", file[i].path, "size",
                                        (json_int_t)file[i].size_bytes, "modified_unix_s", file[i].modified_unix_s,
                                        "content_type", content_type_of(file[i].path), "url", url));
    }
    return list;
}
