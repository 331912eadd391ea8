#include "optimizer/photographs/reader/photograph_reader.h"

#include "base/files/durable.h"
#include "renderer/image/color_primaries.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define READER_ADDRESS(name) &name,
static const photograph_reader *const reader[] = {PHOTOGRAPH_READERS(READER_ADDRESS)};

size_t photograph_reader_count(void) { return sizeof reader / sizeof *reader; }
const photograph_reader *photograph_reader_at(size_t i) { return reader[i]; }

static status read_first_bytes(const char *path, uint8_t first[PHOTOGRAPH_FIRST_BYTES], struct error *err)
{
    memset(first, 0, PHOTOGRAPH_FIRST_BYTES);
    FILE *file = fopen(path, "rbe");
    if (file == NULL) return error_set_errno(err, "cannot read photograph '%s'", path_file_name(path));
    size_t n = fread(first, 1, PHOTOGRAPH_FIRST_BYTES, file);
    int failed = ferror(file);
    fclose(file);
    if (failed) return error_set_errno(err, "cannot read photograph '%s'", path_file_name(path));
    if (n == 0)
        return error_set(err, STATUS_FORMAT, "cannot read photograph '%s': the file is empty", path_file_name(path));
    return STATUS_OK;
}

static const photograph_reader *reader_of_name(const char *path)
{
    char suffix[12] = " ";
    const char *dot = strrchr(path_file_name(path), '.');
    size_t n = dot != NULL ? strlen(dot + 1) : 0;
    if (n == 0 || n > sizeof suffix - 3) return NULL;
    for (size_t i = 0; i < n; i++) suffix[i + 1] = (char)tolower((unsigned char)dot[i + 1]);
    suffix[n + 1] = ' ';
    for (size_t i = 0; i < photograph_reader_count(); i++)
        if (strstr(reader[i]->suffix, suffix) != NULL) return reader[i];
    return NULL;
}

static const photograph_reader *reader_of_content(const uint8_t first[PHOTOGRAPH_FIRST_BYTES])
{
    for (size_t k = 0; k < photograph_reader_count(); k++)
        if (reader[k]->recognise != NULL && reader[k]->recognise(first)) return reader[k];
    return NULL;
}

static status no_reader_takes(const char *path, struct error *err)
{
    return error_set(err, STATUS_UNSUPPORTED,
                     "cannot read photograph '%s': it is neither OpenEXR (.exr), TIFF, camera raw (.dng, .cr2, .nef, "
                     ".arw and others), PNG nor JPEG",
                     path_file_name(path));
}

status photograph_file_read(const char *path, const struct photograph_request *q, struct image *im,
                            struct photograph_info *info, struct error *err)
{
    uint8_t first[PHOTOGRAPH_FIRST_BYTES];
    memset(im, 0, sizeof *im);
    *info = (struct photograph_info){.exposure_s = NAN, .iso = NAN, .aperture = NAN, .full_scale = 1.0};
    status s = read_first_bytes(path, first, err);
    if (s != STATUS_OK) return s;
    const photograph_reader *named = reader_of_name(path), *found = reader_of_content(first);
    if (named != NULL && (named->recognise == NULL || found == NULL)) found = named;
    if (found == NULL) return no_reader_takes(path, err);
    if (named != NULL && named != found)
        return error_set(
            err, STATUS_FORMAT,
            "cannot read photograph '%s': its name ends as that of a %s file, but it is a %s file: give it "
            "the right suffix",
            path_file_name(path), named->title, found->title);
    info->format = found->title;
    s = found->read(path, q, im, info, err);
    if (s == STATUS_OK && info->to_rec709[0] != 0.0 && !color_matrix_is_identity(info->to_rec709))
        image_apply_matrix(im, info->to_rec709);
    return s;
}
