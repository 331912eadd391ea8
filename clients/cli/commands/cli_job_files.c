#include "clients/cli/commands/cli_job_files.h"
#include "base/files/alike_name.h"
#include "base/files/durable.h"
#include "base/natural_order.h"
#include "clients/cli/text/cli_text.h"

#include <errno.h>
#include <fcntl.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static status add(struct cli_file_list *list, const char *folder, const json_t *name_json, const char *role,
                  const char *field, struct error *err)
{
    const char *name = json_string_value(name_json);
    if (name == NULL || name[0] == '\0')
        return error_set_field(err, STATUS_INVALID, field, "'%s' must be a file name", field);
    if (strchr(name, '/') != NULL)
        return error_set_field(err, STATUS_INVALID, field,
                               "'%s' contains a '/'; give the file name alone, and its folder with --input-dir", name);
    for (size_t i = 0; i < list->n_file; i++)
        if (strcmp(list->file[i].name, name) == 0) return STATUS_OK;
    struct cli_file *grown = realloc(list->file, (list->n_file + 1) * sizeof *grown);
    if (grown == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list the input files: out of memory");
    list->file = grown;
    struct cli_file f = {.role = role, .name = strdup(name)};
    size_t n = strlen(folder) + strlen(name) + 2;
    f.path = malloc(n);
    if (f.name == NULL || f.path == NULL) {
        free(f.name);
        free(f.path);
        return error_set(err, STATUS_NO_MEMORY, "cannot list the input files: out of memory");
    }
    snprintf(f.path, n, "%s/%s", folder, name);
    list->file[list->n_file++] = f;
    return STATUS_OK;
}

/* A file that one key of a section names. */
struct named_file {
    const char *section[2], *key, *role, *field;
};

static const struct named_file named[] = {
    {{"fibers", NULL}, "file", "fibers", "fibers.file"},
    {{"cloth", NULL}, "draft_file", "draft", "cloth.draft_file"},
    {{"cloth", NULL}, "texture", "photograph", "cloth.texture"},
    {{"environment", NULL}, "file", "environment", "environment.file"},
    {{"measurements", NULL}, "file", "measurements", "measurements.file"},
    {{"profile", NULL}, "file", "profile", "profile.file"},
    {{"profile", "bowl"}, "mask", "photograph", "profile.bowl.mask"},
    {{"rig", NULL}, "file", "rig", "rig.file"},
    {{"camera", NULL}, "noise_file", "camera_noise", "camera.noise_file"},
    {{"color", "chart"}, "file", "chart", "color.chart.file"},
    {{"color", "chart"}, "reference", "measurements", "color.chart.reference"},
    {{"color", "white"}, "file", "white_reference", "color.white.file"},
};

static status add_named(const json_t *document, const char *folder, struct cli_file_list *list, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; i < sizeof named / sizeof *named && s == STATUS_OK; i++) {
        const json_t *section = json_object_get(document, named[i].section[0]);
        if (named[i].section[1] != NULL) section = json_object_get(section, named[i].section[1]);
        const json_t *name = json_object_get(section, named[i].key);
        if (name != NULL) s = add(list, folder, name, named[i].role, named[i].field, err);
    }
    return s;
}

/* The files of a list of names, or of objects with a key "file". */
static status add_list(const json_t *names, const char *folder, const char *role, const char *field,
                       struct cli_file_list *list, struct error *err)
{
    size_t i, j;
    json_t *item, *more;
    json_array_foreach(names, i, item)
    {
        char path[128];
        const json_t *name = json_is_object(item) ? json_object_get(item, "file") : item;
        snprintf(path, sizeof path, "%s[%zu]%s", field, i, json_is_object(item) ? ".file" : "");
        status s = add(list, folder, name, role, path, err);
        if (s != STATUS_OK) return s;
        const json_t *background = json_object_get(item, "background"); /* of photographs of a bowl */
        snprintf(path, sizeof path, "%s[%zu].background", field, i);
        if (background != NULL) s = add(list, folder, background, role, path, err);
        if (s != STATUS_OK) return s;
        json_array_foreach(json_object_get(item, "more_exposures"), j, more)
        {
            snprintf(path, sizeof path, "%s[%zu].more_exposures[%zu].file", field, i, j);
            s = add(list, folder, json_object_get(more, "file"), role, path, err);
            if (s != STATUS_OK) return s;
        }
    }
    return STATUS_OK;
}

/* Meshes of pictures; most pictures need none. */
static status add_meshes(const json_t *pictures, const char *folder, struct cli_file_list *list, struct error *err)
{
    size_t i;
    json_t *picture;
    status s = STATUS_OK;
    json_array_foreach(pictures, i, picture)
    {
        char path[64];
        const json_t *name = json_object_get(picture, "mesh_file");
        snprintf(path, sizeof path, "pictures[%zu].mesh_file", i);
        if (name != NULL) s = add(list, folder, name, "mesh", path, err);
        if (s != STATUS_OK) break;
    }
    return s;
}

status cli_job_files_list(const json_t *document, const char *folder, struct cli_file_list *list, struct error *err)
{
    *list = (struct cli_file_list){0};
    const json_t *volume = json_object_get(document, "volume"), *camera = json_object_get(document, "camera");
    status s = add_list(json_object_get(volume, "files"), folder, "volume", "volume.files", list, err);
    if (s == STATUS_OK) s = add_named(document, folder, list, err);
    if (s == STATUS_OK)
        s = add_list(json_object_get(camera, "dark_frames"), folder, "dark_frame", "camera.dark_frames", list, err);
    if (s == STATUS_OK)
        s = add_list(json_object_get(document, "photographs"), folder, "photograph", "photographs", list, err);
    const json_t *bowl = json_object_get(json_object_get(document, "profile"), "bowl");
    if (s == STATUS_OK)
        s = add_list(json_object_get(bowl, "photographs"), folder, "photograph", "profile.bowl.photographs", list, err);
    if (s == STATUS_OK) s = add_meshes(json_object_get(document, "pictures"), folder, list, err);
    if (s != STATUS_OK) cli_job_files_release(list);
    return s;
}

void cli_job_files_note(const json_t *document, FILE *note)
{
    const json_t *files = json_object_get(json_object_get(document, "volume"), "files");
    const size_t n = json_array_size(files);
    const char **name = n > 1 ? calloc(n, sizeof *name) : NULL;
    enum { ORDER_ROOM = 200 };
    char text[ORDER_ROOM], clean[ORDER_ROOM];
    for (size_t i = 0; i < n && name != NULL; i++)
        if ((name[i] = json_string_value(json_array_get(files, i))) == NULL) name[i] = "";
    if (name != NULL) {
        natural_order_text(name, n, text, sizeof text);
        text_clean(text, clean, sizeof clean);
        fprintf(note, "scan of %s\n", clean);
    }
    free(name);
}

status cli_job_files_list_strict(const json_t *document, const char *folder, struct cli_file_list *list,
                                 struct error *err)
{
    status s = cli_job_files_list(document, folder, list, err);
    for (size_t i = 0; i < list->n_file; i++) list->file[i].no_links = true;
    return s;
}

int cli_file_open(const struct cli_file *file)
{
    if (!file->no_links) return open(file->path, O_RDONLY | O_CLOEXEC);
    char *folder = strdup(file->path);
    char *slash = folder == NULL ? NULL : strrchr(folder, '/');
    if (slash == NULL) {
        free(folder);
        errno = ENOMEM;
        return -1;
    }
    *slash = '\0';
    int at = open(folder, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    int fd = at < 0 ? -1 : openat(at, slash + 1, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC), failed = errno;
    if (at >= 0) close(at);
    free(folder);
    errno = failed;
    return fd;
}

void cli_job_files_release(struct cli_file_list *list)
{
    for (size_t i = 0; i < list->n_file; i++) {
        free(list->file[i].name);
        free(list->file[i].path);
    }
    free(list->file);
    *list = (struct cli_file_list){0};
}

static status cannot_open(const char *path, struct error *err)
{
    char folder[4096], hint[400];
    if (errno != ENOENT) return error_set_errno(err, "cannot open input file '%s'", path);
    const char *name = path_file_name(path);
    snprintf(folder, sizeof folder, "%.*s", name > path ? (int)(name - path) : 1, name > path ? path : ".");
    alike_name_hint(folder, name, hint, sizeof hint);
    return error_set(err, STATUS_NOT_FOUND,
                     "input file '%s' does not exist, which the job document names%s; `selvedge check` lists all that "
                     "is wrong",
                     path, hint);
}

status cli_file_hash(struct cli_file *file, bool (*changed)(void *context, uint64_t n_done), void *context,
                     struct error *err)
{
    enum { CHUNK = 1 << 20 };
    status s = STATUS_OK;
    unsigned char *buffer = malloc(CHUNK), digest[crypto_hash_sha256_BYTES];
    struct stat info;
    crypto_hash_sha256_state hash;
    crypto_hash_sha256_init(&hash);
    file->n_bytes = 0;
    int fd = cli_file_open(file);
    if (fd < 0) {
        s = cannot_open(file->path, err);
        goto out;
    }
    if (fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
        s = error_set(err, STATUS_INVALID, "input '%s' is not a regular file", file->path);
        goto out;
    }
    if (buffer == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot read '%s': out of memory", file->path);
        goto out;
    }
    for (;;) {
        ssize_t n = read(fd, buffer, CHUNK);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            s = error_set_errno(err, "cannot read input file '%s'", file->path);
            goto out;
        }
        if (n == 0) break;
        crypto_hash_sha256_update(&hash, buffer, (unsigned long long)n);
        file->n_bytes += (uint64_t)n;
        if (changed != NULL && !changed(context, file->n_bytes)) {
            s = error_set(err, STATUS_CANCELLED, "interrupted");
            goto out;
        }
    }
    crypto_hash_sha256_final(&hash, digest);
    sodium_bin2hex(file->sha256, sizeof file->sha256, digest, sizeof digest);
out:
    if (fd >= 0) close(fd);
    free(buffer);
    return s;
}
