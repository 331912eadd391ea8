#include "optimizer/photographs/reader/photograph_reader.h"

#include "base/files/durable.h"
#include "base/files/reading_note.h"
#include "optimizer/photographs/reader/saturation.h"
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

static void multiply(const double m[9], const float in[3], float out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = (float)(m[3 * c] * (double)in[0] + m[3 * c + 1] * (double)in[1] + m[3 * c + 2] * (double)in[2]);
}

static bool is_saturated(const float p[3], const double saturation[3])
{
    return (double)p[0] >= saturation[0] || (double)p[1] >= saturation[1] || (double)p[2] >= saturation[2];
}

/* Converts the colors. A pixel with a saturated sample is unknown in all channels afterwards: all become larger than
 * the samples of other pixels. */
static void convert_primaries(struct image *im, struct photograph_info *info)
{
    const size_t n = im->width * im->height;
    float limit = 0.0f, out[3];
    bool any = false;
    for (size_t i = 0; i < n; i++) {
        const float *p = im->pixel + 3 * i;
        if (is_saturated(p, info->saturation)) {
            any = true;
            continue;
        }
        multiply(info->to_rec709, p, out);
        limit = fmaxf(limit, fmaxf(out[0], fmaxf(out[1], out[2])));
    }
    limit = nextafterf(limit, INFINITY);
    for (size_t i = 0; i < n; i++) {
        float *p = im->pixel + 3 * i;
        const bool lost = is_saturated(p, info->saturation);
        multiply(info->to_rec709, p, out);
        for (int c = 0; c < 3; c++) p[c] = lost ? fmaxf(out[c], limit) : out[c];
    }
    for (int c = 0; c < 3; c++) info->saturation[c] = any ? (double)limit : INFINITY;
}

/* Turns the places of the samples as `turn` turns pixels. */
static void turn_samples(unsigned k, double place[3][2])
{
    for (size_t c = 0; c < 3; c++) {
        const double across = k == 2 || k == 3 || k == 7 || k == 8 ? -place[c][0] : place[c][0];
        const double down = k == 3 || k == 4 || k == 6 || k == 7 ? -place[c][1] : place[c][1];
        place[c][0] = k >= 5 ? down : across;
        place[c][1] = k >= 5 ? across : down;
    }
}

/* Turns the picture as viewers show it: orientation k of Exif says where the first row and column
 * of the file belong. */
static status turn(struct image *im, struct photograph_info *info, struct error *err)
{
    static const char *const meaning[] = {"",
                                          "upright",
                                          "mirrored",
                                          "half a turn",
                                          "mirrored upside down",
                                          "mirrored, a quarter turn",
                                          "a quarter turn to the right",
                                          "mirrored, a quarter turn to the right",
                                          "a quarter turn to the left"};
    const unsigned k = info->orientation;
    info->orientation = 1;
    if (k == 0 || k > 8) return STATUS_OK;
    info->orientation = k;
    file_ledger_add(&info->ledger, "orientation", NULL, "%u, %s", k, meaning[k]);
    if (k == 1) return STATUS_OK;
    turn_samples(k, info->sample_px);
    const bool exchanged = k >= 5;
    struct image out;
    status s = image_init(&out, exchanged ? im->height : im->width, exchanged ? im->width : im->height, 3, err);
    if (s != STATUS_OK) return s;
    for (size_t y = 0; y < im->height; y++)
        for (size_t x = 0; x < im->width; x++) {
            const size_t to_left = im->width - 1 - x, to_top = im->height - 1 - y;
            const size_t across = k == 2 || k == 3 || k == 7 || k == 8 ? to_left : x;
            const size_t down = k == 3 || k == 4 || k == 6 || k == 7 ? to_top : y;
            const size_t column = exchanged ? down : across, row = exchanged ? across : down;
            memcpy(out.pixel + 3 * (row * out.width + column), im->pixel + 3 * (y * im->width + x), 3 * sizeof(float));
        }
    image_release(im);
    *im = out;
    return STATUS_OK;
}

status photograph_file_read(const char *path, const struct photograph_request *q, struct image *im,
                            struct photograph_info *info, struct error *err)
{
    uint8_t first[PHOTOGRAPH_FIRST_BYTES];
    memset(im, 0, sizeof *im);
    *info = (struct photograph_info){.exposure_s = NAN,
                                     .iso = NAN,
                                     .aperture = NAN,
                                     .full_scale = 1.0,
                                     .saturation = {INFINITY, INFINITY, INFINITY}};
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
    char reader_name[40];
    snprintf(reader_name, sizeof reader_name, "%s photograph", found->title);
    reading_note_set(reader_name, path);
    s = found->read(path, q, im, info, err);
    reading_note_set(NULL, NULL);
    if (s != STATUS_OK) return s;
    saturation_find(im, info);
    if (info->to_rec709[0] != 0.0 && !color_matrix_is_identity(info->to_rec709)) convert_primaries(im, info);
    s = turn(im, info, err);
    if (s != STATUS_OK) image_release(im);
    return s;
}
