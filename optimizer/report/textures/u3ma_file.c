#include "optimizer/report/textures/u3ma_file.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { MAX_FILE = 32, LOCAL = 0x04034b50, CENTRAL = 0x02014b50, END = 0x06054b50, PATH_ROOM = 4096 };
enum { MADE_BY = 0x003f, NEEDED = 0x14, IS_UTF8 = 1 << 11, STORED = 0 };

struct entry {
    const char *name;
    uint32_t crc, n_byte, at;
};

struct archive_file {
    FILE *out;
    uint16_t time, date; /* of MS-DOS */
    struct entry entry[MAX_FILE];
};

static void put(FILE *out, uint32_t value, int n_byte)
{
    for (int k = 0; k < n_byte; k++) fputc((int)(value >> 8 * k & 0xffu), out);
}

/* The fields that both headers of an entry share. */
static void put_shared(const struct archive_file *a, const struct entry *e)
{
    put(a->out, NEEDED, 2);
    put(a->out, IS_UTF8, 2);
    put(a->out, STORED, 2);
    put(a->out, a->time, 2);
    put(a->out, a->date, 2);
    put(a->out, e->crc, 4);
    put(a->out, e->n_byte, 4);
    put(a->out, e->n_byte, 4);
    put(a->out, (uint32_t)strlen(e->name), 2);
    put(a->out, 0, 2); /* no extra field */
}

static status read_file(const char *path, uint8_t **data, size_t *n, struct error *err)
{
    FILE *in = fopen(path, "rbe");
    if (in == NULL) return error_set_errno(err, "cannot read '%s' for an archive", path);
    long size = fseek(in, 0, SEEK_END) == 0 ? ftell(in) : -1;
    *data = size >= 0 ? malloc((size_t)size + 1) : NULL;
    rewind(in);
    const bool whole = *data != NULL && fread(*data, 1, (size_t)size, in) == (size_t)size;
    *n = (size_t)size;
    fclose(in);
    return whole ? STATUS_OK : error_set(err, STATUS_IO, "cannot read '%s' for an archive", path);
}

static status add(struct archive_file *a, struct entry *e, const char *folder, struct error *err)
{
    char path[PATH_ROOM];
    uint8_t *data = NULL;
    size_t n = 0;
    const long at = ftell(a->out);
    snprintf(path, sizeof path, "%s/%s", folder, e->name);
    status s = read_file(path, &data, &n, err);
    if (s == STATUS_OK && (at < 0 || (uint64_t)at + n + PATH_ROOM > UINT32_MAX))
        s = error_set(err, STATUS_TOO_LARGE, "cannot write a U3M archive: '%s' makes it larger than 4 GB", e->name);
    if (s == STATUS_OK) {
        e->at = (uint32_t)at;
        e->n_byte = (uint32_t)n;
        e->crc = (uint32_t)crc32_z(crc32_z(0, NULL, 0), data, n);
        put(a->out, LOCAL, 4);
        put_shared(a, e);
        fputs(e->name, a->out);
        fwrite(data, 1, n, a->out);
    }
    free(data);
    return s;
}

static void put_directory(const struct archive_file *a, size_t n)
{
    const uint32_t at = (uint32_t)ftell(a->out);
    for (size_t i = 0; i < n; i++) {
        put(a->out, CENTRAL, 4);
        put(a->out, MADE_BY, 2);
        put_shared(a, &a->entry[i]);
        for (int k = 0; k < 3; k++) put(a->out, 0, 2); /* comment, disk, internal attributes */
        put(a->out, 0, 4);                             /* external attributes */
        put(a->out, a->entry[i].at, 4);
        fputs(a->entry[i].name, a->out);
    }
    const uint32_t end = (uint32_t)ftell(a->out);
    put(a->out, END, 4);
    put(a->out, 0, 4); /* disks */
    put(a->out, (uint32_t)n, 2);
    put(a->out, (uint32_t)n, 2);
    put(a->out, end - at, 4);
    put(a->out, at, 4);
    put(a->out, 0, 2); /* no comment */
}

status u3ma_file_write(const char *path, const char *folder, const char *const *name, size_t n, time_t now,
                       struct error *err)
{
    struct archive_file a = {.out = fopen(path, "wbe")};
    struct tm utc = {.tm_year = 80, .tm_mday = 1};
    if (a.out == NULL) return error_set_errno(err, "cannot write '%s'", path);
    if (gmtime_r(&now, &utc) == NULL || utc.tm_year < 80) utc = (struct tm){.tm_year = 80, .tm_mday = 1};
    a.time = (uint16_t)(utc.tm_hour << 11 | utc.tm_min << 5 | utc.tm_sec / 2);
    a.date = (uint16_t)((utc.tm_year - 80) << 9 | (utc.tm_mon + 1) << 5 | utc.tm_mday);
    status s = n <= MAX_FILE ? STATUS_OK : error_set(err, STATUS_INTERNAL, "too many files for a U3M archive");
    for (size_t i = 0; i < n && s == STATUS_OK; i++) {
        a.entry[i].name = name[i];
        s = add(&a, &a.entry[i], folder, err);
    }
    if (s == STATUS_OK) put_directory(&a, n);
    const bool failed = ferror(a.out) != 0;
    if ((fclose(a.out) != 0 || failed) && s == STATUS_OK) s = error_set_errno(err, "cannot write '%s'", path);
    return s;
}
