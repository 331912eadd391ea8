#include "geometry/volume/format/volume_source.h"
#include "base/option_id.h"

#include "base/files/durable.h"
#include "base/files/reading_note.h"
#include "geometry/volume/format/raw_source.h"
#include "geometry/volume/format/volume_reader.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static const volume_reader *const reader[] = {
#undef VOLUME_FORMAT
#define VOLUME_FORMAT(name, ...) &name,
#include "generated/volume_formats.def"
#undef VOLUME_FORMAT
};
/* Not in the table, because raw files cannot be recognised. Opened by raw_source_open with a declaration. */
static const volume_reader raw_reader = {.id = "raw.v1", .read = raw_source_read, .close = raw_source_close};

struct volume_source {
    const volume_reader *reader;
    void *handle;
    struct volume_source_info info;
    char name[256]; /* of the first file */
};

size_t volume_reader_count(void) { return sizeof reader / sizeof *reader; }
const volume_reader *volume_reader_at(size_t i) { return reader[i]; }

static status read_first_bytes(const char *path, uint8_t first_byte[16], struct error *err)
{
    memset(first_byte, 0, 16);
    FILE *file = fopen(path, "rbe");
    if (file == NULL) {
        if (errno == ENOENT)
            return error_set_field(err, STATUS_NOT_FOUND, OPTION_SCAN_FILES, "cannot read volume '%s': no such file",
                                   path_file_name(path));
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", path_file_name(path));
    }
    size_t n = fread(first_byte, 1, 16, file);
    int failed = ferror(file);
    fclose(file);
    if (failed)
        return error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", path_file_name(path));
    if (n == 0)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': the file is empty",
                               path_file_name(path));
    return STATUS_OK;
}

/* The error of a file that no reader takes: names every format, "neither TIFF nor ... nor .vol". */
static status no_reader_takes(const char *path, struct error *err)
{
    char list[300] = "";
    int n = 0;
    for (size_t i = 0; i < volume_reader_count() && n < (int)sizeof list; i++)
        n += snprintf(list + n, sizeof list - (size_t)n, "%s %s", i == 0 ? "neither" : " nor", reader[i]->title);
    return error_set_field(err, STATUS_UNSUPPORTED, OPTION_SCAN_FILES,
                           "cannot read volume '%s': %s (samples without a header are described by 'raw')",
                           path_file_name(path), list);
}

status volume_source_open_declared(const char *const *path, size_t n_path, const struct volume_raw_declaration *raw,
                                   const struct volume_part *part, struct volume_source **source, struct error *err)
{
    *source = NULL;
    if (n_path == 0)
        return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES, "cannot read volume: no file named");
    uint8_t first_byte[16];
    status s = read_first_bytes(path[0], first_byte, err);
    if (s != STATUS_OK) return s;
    const volume_reader *found = raw != NULL && raw->n[0] > 0 ? &raw_reader : NULL;
    for (size_t i = 0; i < volume_reader_count() && found == NULL; i++)
        if (reader[i]->recognise(first_byte, path[0])) found = reader[i];
    if (found == NULL) return no_reader_takes(path[0], err);
    if (part != NULL && part->dataset[0] != '\0' && !found->has_datasets)
        return error_set_field(err, STATUS_INVALID, OPTION_SCAN_DATASET,
                               "cannot read volume '%s': it has no data sets, so none can be chosen",
                               path_file_name(path[0]));
    struct volume_source *v = calloc(1, sizeof *v);
    if (v == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot read volume '%s': out of memory", path_file_name(path[0]));
    v->reader = found;
    snprintf(v->name, sizeof v->name, "%s", path_file_name(path[0]));
    reading_note_set(found->title, v->name);
    s = found == &raw_reader ? raw_source_open(path, n_path, raw, &v->handle, &v->info, err)
                             : found->open(path, n_path, part, &v->handle, &v->info, err);
    reading_note_set(NULL, NULL);
    if (s != STATUS_OK) {
        free(v);
        return s;
    }
    *source = v;
    return STATUS_OK;
}

status volume_source_open(const char *const *path, size_t n_path, struct volume_source **source, struct error *err)
{
    return volume_source_open_declared(path, n_path, NULL, NULL, source, err);
}

void volume_source_close(struct volume_source *source)
{
    if (source == NULL) return;
    source->reader->close(source->handle);
    free(source);
}

const struct volume_source_info *volume_source_describe(const struct volume_source *source) { return &source->info; }

status volume_source_read(struct volume_source *source, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    if (i_slice > source->info.n[2] || n_slice > source->info.n[2] - i_slice)
        return error_set(err, STATUS_INTERNAL, "cannot read slices %zu..%zu of %zu", i_slice, i_slice + n_slice,
                         source->info.n[2]);
    reading_note_set(source->reader->title, source->name);
    status s = source->reader->read(source->handle, i_slice, n_slice, value, err);
    reading_note_set(NULL, NULL);
    return s;
}
