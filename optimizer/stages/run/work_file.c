#include "optimizer/stages/run/work_file.h"
#include "base/files/durable.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

enum { CHUNK = 8 << 20 };

static const char magic[8] = {'S', 'E', 'L', 'V', 'W', 'R', 'K', '2'};

struct work_header {
    char magic[8];
    char tag[WORK_FILE_TAG_BYTES];
    uint64_t n_section;
    uint64_t n_bytes[WORK_FILE_MAX_SECTION];
};

/* zlib takes 32-bit lengths; sections may be larger. */
static uint32_t checksum(uint32_t sum, const void *data, size_t n_bytes)
{
    return (uint32_t)crc32_z(sum, data, n_bytes);
}

/* Size of the next piece of a section: large sections are read and written in pieces, so that they need not be
 * resident as a whole. */
static size_t chunk(const struct work_section *s, size_t at)
{
    size_t left = s->n_bytes - at;
    scratch_keep_within(s->space);
    return left < CHUNK ? left : CHUNK;
}

static status too_many(const char *path, size_t n_section, struct error *err)
{
    return error_set(err, STATUS_INTERNAL, "checkpoint '%s' would have %zu sections: there is room for %d", path,
                     n_section, WORK_FILE_MAX_SECTION);
}

status work_file_write(const char *path, const char *tag, const struct work_section *section, size_t n_section,
                       struct error *err)
{
    struct work_header h = {.n_section = n_section};
    char temporary[4096];
    status s = STATUS_OK;
    if (n_section > WORK_FILE_MAX_SECTION) return too_many(path, n_section, err);
    memcpy(h.magic, magic, sizeof magic);
    snprintf(h.tag, sizeof h.tag, "%s", tag);
    for (size_t i = 0; i < n_section; i++) h.n_bytes[i] = section[i].n_bytes;
    snprintf(temporary, sizeof temporary, "%s.part", path);
    FILE *f = fopen(temporary, "wbe");
    if (f == NULL) return error_set_errno(err, "cannot write checkpoint '%s'", path);
    uint32_t sum = checksum(0, &h, sizeof h);
    bool ok = fwrite(&h, sizeof h, 1, f) == 1;
    for (size_t i = 0; i < n_section && ok; i++)
        for (size_t at = 0, n; at < section[i].n_bytes && ok; at += n) {
            n = chunk(&section[i], at);
            sum = checksum(sum, (const char *)section[i].data + at, n);
            ok = fwrite((const char *)section[i].data + at, n, 1, f) == 1;
        }
    ok = ok && fwrite(&sum, sizeof sum, 1, f) == 1 && fflush(f) == 0 && fsync(fileno(f)) == 0;
    if (!ok) s = error_set_errno(err, "cannot write checkpoint '%s'", path);
    if (fclose(f) != 0 && s == STATUS_OK) s = error_set_errno(err, "cannot write checkpoint '%s'", path);
    if (s == STATUS_OK && rename(temporary, path) != 0) s = error_set_errno(err, "cannot write checkpoint '%s'", path);
    if (s != STATUS_OK) unlink(temporary);
    return s == STATUS_OK ? durable_sync_folder_of(path, err) : s;
}

/* Provides memory for a section that is read: its own, or, if the caller gives the memory (such sections are small),
 * a copy, so that the caller's data do not change when the checksum is wrong. */
static status open_section(const char *path, const struct work_section *section, size_t n_bytes,
                           struct work_section *read, struct error *err)
{
    *read = *section;
    read->n_bytes = n_bytes;
    if (section->data == NULL) return scratch_new(section->space, n_bytes, "a checkpoint", &read->data, err);
    if (section->n_bytes != n_bytes)
        return error_set(err, STATUS_FORMAT, "cannot read checkpoint '%s': it is of another program version", path);
    read->space = NULL;
    read->data = malloc(n_bytes > 0 ? n_bytes : 1);
    return read->data != NULL ? STATUS_OK
                              : error_set(err, STATUS_NO_MEMORY, "cannot read checkpoint '%s': out of memory", path);
}

static status read_sections(FILE *f, const char *path, const struct work_header *h, const struct work_section *section,
                            struct work_section *read, struct error *err)
{
    uint32_t sum = checksum(0, h, sizeof *h), stored;
    for (size_t i = 0; i < h->n_section; i++) {
        status s = open_section(path, &section[i], h->n_bytes[i], &read[i], err);
        if (s != STATUS_OK) {
            read[i].data = NULL;
            return s;
        }
        for (size_t at = 0, n; at < h->n_bytes[i]; at += n) {
            n = chunk(&read[i], at);
            if (fread((char *)read[i].data + at, n, 1, f) != 1)
                return error_set(err, STATUS_FORMAT, "cannot read checkpoint '%s': it is truncated", path);
            sum = checksum(sum, (char *)read[i].data + at, n);
        }
    }
    if (fread(&stored, sizeof stored, 1, f) != 1 || stored != sum)
        return error_set(err, STATUS_CHECKSUM, "cannot read checkpoint '%s': its checksum is wrong", path);
    return STATUS_OK;
}

/* Ends the reading of a section: a good one is given to the caller or copied to the caller's memory, any other is
 * released. */
static void close_section(bool good, struct work_section *section, struct work_section *read)
{
    if (section->data != NULL) {
        if (good) memcpy(section->data, read->data, section->n_bytes);
        free(read->data);
    } else if (good) {
        *section = *read;
    } else if (read->data != NULL) {
        scratch_release(section->space, read->data);
    }
}

/* Checks the header, so that impossible sizes do not reach malloc. */
static status check_header(FILE *f, const char *path, const struct work_header *h, const char *tag, size_t n_section,
                           struct error *err)
{
    char want[WORK_FILE_TAG_BYTES] = {0};
    struct stat st;
    uint64_t total = sizeof *h + sizeof(uint32_t);
    snprintf(want, sizeof want, "%s", tag);
    if (memcmp(h->magic, magic, sizeof magic) != 0 || memcmp(h->tag, want, sizeof want) != 0 ||
        h->n_section != n_section)
        return error_set(err, STATUS_FORMAT, "cannot read checkpoint '%s': it is of another kind or program version",
                         path);
    for (size_t i = 0; i < n_section; i++) {
        if (h->n_bytes[i] > (uint64_t)1 << 48)
            return error_set(err, STATUS_FORMAT, "cannot read checkpoint '%s': it is damaged", path);
        total += h->n_bytes[i];
    }
    if (fstat(fileno(f), &st) != 0 || (uint64_t)st.st_size != total)
        return error_set(err, STATUS_FORMAT, "cannot read checkpoint '%s': its length is wrong", path);
    return STATUS_OK;
}

status work_file_read(const char *path, const char *tag, struct work_section *section, size_t n_section,
                      struct error *err)
{
    struct work_header h;
    struct work_section read[WORK_FILE_MAX_SECTION] = {0};
    if (n_section > WORK_FILE_MAX_SECTION) return too_many(path, n_section, err);
    FILE *f = fopen(path, "rbe");
    if (f == NULL && errno == ENOENT) return error_set(err, STATUS_NOT_FOUND, "there is no checkpoint '%s'", path);
    if (f == NULL) return error_set_errno(err, "cannot read checkpoint '%s'", path);
    status s = STATUS_OK;
    if (fread(&h, sizeof h, 1, f) != 1)
        s = error_set(err, STATUS_FORMAT, "cannot read checkpoint '%s': it is truncated", path);
    if (s == STATUS_OK) s = check_header(f, path, &h, tag, n_section, err);
    if (s == STATUS_OK) s = read_sections(f, path, &h, section, read, err);
    fclose(f);
    for (size_t i = 0; i < n_section; i++) close_section(s == STATUS_OK, &section[i], &read[i]);
    return s;
}
