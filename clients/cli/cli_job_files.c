#include "clients/cli/cli_job_files.h"

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

status cli_job_files_list(const json_t *document, const char *folder, struct cli_file_list *list, struct error *err)
{
    *list = (struct cli_file_list){0};
    status s = STATUS_OK;
    size_t i;
    json_t *item;
    json_array_foreach(json_object_get(json_object_get(document, "volume"), "files"), i, item)
    {
        char field[64];
        snprintf(field, sizeof field, "volume.files[%zu]", i);
        if ((s = add(list, folder, item, "volume", field, err)) != STATUS_OK) goto out;
    }
    const json_t *one = json_object_get(json_object_get(document, "fibers"), "file");
    if (one != NULL && (s = add(list, folder, one, "fibers", "fibers.file", err)) != STATUS_OK) goto out;
    one = json_object_get(json_object_get(document, "environment"), "file");
    if (one != NULL && (s = add(list, folder, one, "environment", "environment.file", err)) != STATUS_OK) goto out;
    one = json_object_get(json_object_get(document, "measurements"), "file");
    if (one != NULL && (s = add(list, folder, one, "measurements", "measurements.file", err)) != STATUS_OK) goto out;
    json_array_foreach(json_object_get(document, "photographs"), i, item)
    {
        char field[64];
        snprintf(field, sizeof field, "photographs[%zu].file", i);
        if ((s = add(list, folder, json_object_get(item, "file"), "photograph", field, err)) != STATUS_OK) goto out;
    }
out:
    if (s != STATUS_OK) cli_job_files_release(list);
    return s;
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
    int fd = open(file->path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
        s = errno == ENOENT ? error_set(err, STATUS_NOT_FOUND,
                                        "input file '%s' does not exist (the job document names it)", file->path)
                            : error_set_errno(err, "cannot open input file '%s'", file->path);
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
