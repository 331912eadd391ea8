#include "tests/fuzz/fuzz_input.h"

#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

const char *fuzz_file(const uint8_t *data, size_t size)
{
    static char path[64];
    static int fd = -1;
    if (fd < 0) {
        fd = memfd_create("fuzz", 0);
        snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    }
    if (fd < 0 || ftruncate(fd, 0) != 0 || (size > 0 && pwrite(fd, data, size, 0) != (ssize_t)size)) abort();
    return path;
}

static char alias[64];

static void remove_alias(void) { unlink(alias); }

const char *fuzz_file_as(const char *suffix, const uint8_t *data, size_t size)
{
    const char *path = fuzz_file(data, size);
    if (alias[0] == '\0') {
        snprintf(alias, sizeof alias, "/tmp/selvedge-fuzz-%ld%.8s", (long)getpid(), suffix);
        unlink(alias);
        if (symlink(path, alias) != 0 || atexit(remove_alias) != 0) abort();
    }
    return alias;
}

void fuzz_check_error(status s, const struct error *err)
{
    if (s != STATUS_OK && (err->code != s || err->text[0] == '\0')) abort();
    if (s == STATUS_INTERNAL) abort();
}

void fuzz_read_slices(const volume_reader *reader, void *handle, const struct volume_source_info *info)
{
    struct error err = {0};
    size_t n = info->n[0] * info->n[1];
    if (n > 0 && n <= 4u << 20) {
        float *value = malloc(n * sizeof *value);
        if (value == NULL) abort();
        status s = STATUS_OK;
        for (size_t k = 0; k < info->n[2] && k < 64 && s == STATUS_OK; k++) s = reader->read(handle, k, 1, value, &err);
        fuzz_check_error(s, &err);
        err = (struct error){0};
        s = reader->read(handle, 0, 1, value, &err);
        fuzz_check_error(s, &err);
        free(value);
    }
    reader->close(handle);
}

void fuzz_volume(const volume_reader *reader, const uint8_t *data, size_t size)
{
    const char *path = fuzz_file(data, size);
    struct volume_source_info info = {0};
    struct error err = {0};
    void *handle = NULL;
    status s = reader->open(&path, 1, NULL, &handle, &info, &err);
    fuzz_check_error(s, &err);
    if (s == STATUS_OK) fuzz_read_slices(reader, handle, &info);
}
