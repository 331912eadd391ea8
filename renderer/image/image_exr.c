#include "renderer/image/image_exr.h"

#include "base/files/durable.h"
#include "base/files/reading_note.h"

#include <OpenEXR/openexr.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* What the library last complained about: its texts are better than its codes. */
struct exr_note {
    char text[256];
    int fd, cause; /* of writing: the file, and errno of the first write that failed */
};

static void on_exr_error(exr_const_context_t context, exr_result_t code, const char *text)
{
    void *user = NULL;
    (void)code;
    if (exr_get_user_data(context, &user) != EXR_ERR_SUCCESS || user == NULL || text == NULL) return;
    struct exr_note *note = user;
    if (note->text[0] == '\0') snprintf(note->text, sizeof note->text, "%s", text);
}

static exr_context_initializer_t initializer(struct exr_note *note)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    note->text[0] = '\0';
    init.error_handler_fn = on_exr_error;
    init.user_data = note;
    return init;
}

static const char *reason(const struct exr_note *note, exr_result_t code)
{
    return note->text[0] != '\0' ? note->text : exr_get_default_error_message(code);
}

/* ---- writing ---- */

/* Writes for the library. It hears of no failure, because OpenEXRCore 3.1.5 waits for itself for ever when it finishes
 * a file whose header could not be written; image_write_exr looks at `cause` afterwards. */
static int64_t write_piece(exr_const_context_t context, void *user, const void *piece, uint64_t n_byte, uint64_t offset,
                           exr_stream_error_func_ptr_t on_error)
{
    (void)context;
    (void)on_error;
    struct exr_note *note = user;
    for (uint64_t done = 0; done < n_byte && note->cause == 0;) {
        ssize_t n = pwrite(note->fd, (const char *)piece + done, n_byte - done, (off_t)(offset + done));
        if (n < 0 && errno != EINTR) note->cause = errno;
        if (n > 0) done += (uint64_t)n;
    }
    return (int64_t)n_byte;
}

/* Uncompressed: the library's ZIP encoder (3.1.5 of Debian 12) damages a chunk whose compressed size happens to equal
 * its plain size (AcademySoftwareFoundation/openexr issue 2306), and path-traced floats hardly shrink anyway. */
static exr_result_t declare(exr_context_t file, const struct image *im, int *part)
{
    exr_result_t r = exr_add_part(file, "image", EXR_STORAGE_SCANLINE, part);
    if (r == EXR_ERR_SUCCESS)
        r = exr_initialize_required_attr_simple(file, *part, (int32_t)im->width, (int32_t)im->height,
                                                EXR_COMPRESSION_NONE);
    for (size_t c = 0; c < im->n_channel && r == EXR_ERR_SUCCESS; c++)
        r = exr_add_channel(file, *part, im->channel_name[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LINEAR, 1, 1);
    if (r == EXR_ERR_SUCCESS) r = exr_write_header(file);
    return r;
}

static size_t channel_index(const struct image *im, const char *name)
{
    size_t c = 0;
    while (c + 1 < im->n_channel && strcmp(im->channel_name[c], name) != 0) c++;
    return c;
}

static exr_result_t write_chunks(exr_context_t file, int part, const struct image *im)
{
    exr_encode_pipeline_t encoder = EXR_ENCODE_PIPELINE_INITIALIZER;
    int32_t lines = 0;
    exr_result_t r = exr_get_scanlines_per_chunk(file, part, &lines);
    bool first = true;
    for (int32_t y = 0; y < (int32_t)im->height && r == EXR_ERR_SUCCESS; y += lines) {
        exr_chunk_info_t chunk;
        r = exr_write_scanline_chunk_info(file, part, y, &chunk);
        if (r != EXR_ERR_SUCCESS) break;
        r = first ? exr_encoding_initialize(file, part, &chunk, &encoder)
                  : exr_encoding_update(file, part, &chunk, &encoder);
        if (r != EXR_ERR_SUCCESS) break;
        for (int16_t k = 0; k < encoder.channel_count; k++) {
            exr_coding_channel_info_t *c = &encoder.channels[k];
            const float *from = im->pixel + (size_t)y * im->width * im->n_channel + channel_index(im, c->channel_name);
            c->user_pixel_stride = (int32_t)(im->n_channel * sizeof(float));
            c->user_line_stride = (int32_t)(im->width * im->n_channel * sizeof(float));
            c->encode_from_ptr = (const uint8_t *)from;
        }
        if (first) r = exr_encoding_choose_default_routines(file, part, &encoder);
        if (r == EXR_ERR_SUCCESS) r = exr_encoding_run(file, part, &encoder);
        first = false;
    }
    if (!first) exr_encoding_destroy(file, &encoder);
    return r;
}

status image_write_exr(const struct image *im, const char *path, struct error *err)
{
    struct exr_note note;
    exr_context_initializer_t init = initializer(&note);
    exr_context_t file = NULL;
    int part = 0;
    if (im->channel_name == NULL || im->width > 1u << 20 || im->height > 1u << 20)
        return error_set(err, STATUS_INVALID, "cannot write image '%s': %s", path,
                         im->channel_name == NULL ? "its channels have no names" : "too large");
    note.cause = 0;
    note.fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (note.fd < 0) return error_set_errno(err, "cannot write image '%s'", path);
    init.write_fn = write_piece;
    exr_result_t r = exr_start_write(&file, path, EXR_WRITE_FILE_DIRECTLY, &init);
    if (r == EXR_ERR_SUCCESS) r = declare(file, im, &part);
    if (r == EXR_ERR_SUCCESS) r = write_chunks(file, part, im);
    exr_result_t finish = file != NULL ? exr_finish(&file) : EXR_ERR_SUCCESS;
    if (r == EXR_ERR_SUCCESS) r = finish;
    if (close(note.fd) != 0 && note.cause == 0) note.cause = errno;
    if (r == EXR_ERR_SUCCESS && note.cause == 0) return STATUS_OK;
    unlink(path);
    errno = note.cause;
    return note.cause != 0 ? error_set_errno(err, "cannot write image '%s'", path)
                           : error_set(err, STATUS_IO, "cannot write image '%s': %s", path, reason(&note, r));
}

/* ---- reading ---- */

struct reader {
    exr_context_t file;
    struct image *im;
    const char *path;
    struct exr_note note;
    int32_t width, height, min_y;
    exr_storage_t storage;
    const char *prefix; /* of the names of the channels: "" or "var." */
    bool grey;
    uint8_t *rest; /* room for a chunk of a channel that is not wanted */
    size_t rest_bytes;
};

static const char channel_letter[] = "RGBY";

/* The place in channel_letter of the channel "prefix + letter"; -1 for any other name. */
static int letter_index(const struct reader *rd, const char *name)
{
    size_t n = strlen(rd->prefix);
    if (strncmp(name, rd->prefix, n) != 0 || strlen(name) != n + 1) return -1;
    const char *which = strchr(channel_letter, name[n]);
    return which != NULL ? (int)(which - channel_letter) : -1;
}

static status refuse(const struct reader *rd, struct error *err, const char *why)
{
    return error_set(err, STATUS_FORMAT, "cannot read image '%s': %s", path_file_name(rd->path), why);
}

static bool has_channel(const exr_attr_chlist_t *list, const char *name)
{
    for (int i = 0; i < list->num_channels; i++)
        if (strcmp(list->entries[i].name.str, name) == 0) return true;
    return false;
}

static status check_channels(struct reader *rd, struct error *err)
{
    const exr_attr_chlist_t *list = NULL;
    if (exr_get_channels(rd->file, 0, &list) != EXR_ERR_SUCCESS || list == NULL)
        return refuse(rd, err, "it has no list of channels");
    bool have[4] = {false, false, false, false};
    if (has_channel(list, "RY") || has_channel(list, "BY"))
        return refuse(rd, err, "it holds luminance and chroma (channels Y, RY, BY): save it as RGB");
    if (has_channel(list, "X") && has_channel(list, "Y") && has_channel(list, "Z"))
        return refuse(rd, err, "it holds tristimulus values (channels X, Y, Z): save it as RGB");
    exr_compression_t packing = EXR_COMPRESSION_NONE;
    exr_get_compression(rd->file, 0, &packing);
    const bool b44 = packing == EXR_COMPRESSION_B44 || packing == EXR_COMPRESSION_B44A;
    for (int i = 0; i < list->num_channels; i++) {
        const exr_attr_chlist_entry_t *e = &list->entries[i];
        int which = letter_index(rd, e->name.str);
        /* OpenEXRCore 3.1.5 mixes up the rows of such channels */
        if (b44 && e->pixel_type != EXR_PIXEL_HALF)
            return refuse(rd, err, "B44 compression of float channels is not supported: save it with ZIP compression");
        if (which < 0) continue;
        if (e->pixel_type == EXR_PIXEL_UINT) return refuse(rd, err, "its pixels are integers, half or float is needed");
        if (e->x_sampling != 1 || e->y_sampling != 1) return refuse(rd, err, "its channels are subsampled");
        have[which] = true;
    }
    rd->grey = !(have[0] && have[1] && have[2]);
    if (rd->grey && have[3] && !(have[0] || have[1] || have[2])) return STATUS_OK;
    if (!rd->grey) return STATUS_OK;
    for (int c = 0; c < 3; c++)
        if (!have[c])
            return error_set(err, STATUS_FORMAT, "cannot read image '%s': channel '%s%c' is missing",
                             path_file_name(rd->path), rd->prefix, channel_letter[c]);
    return refuse(rd, err, "channels are missing");
}

static status read_header(struct reader *rd, size_t limit_pixel, struct error *err)
{
    exr_attr_box2i_t w;
    if (exr_get_storage(rd->file, 0, &rd->storage) != EXR_ERR_SUCCESS)
        return refuse(rd, err, "unknown kind of storage");
    if (rd->storage != EXR_STORAGE_SCANLINE && rd->storage != EXR_STORAGE_TILED)
        return refuse(rd, err, "deep data are not supported");
    if (exr_get_data_window(rd->file, 0, &w) != EXR_ERR_SUCCESS) return refuse(rd, err, "it has no data window");
    int64_t width = (int64_t)w.max.x - w.min.x + 1, height = (int64_t)w.max.y - w.min.y + 1;
    if (width <= 0 || height <= 0) return refuse(rd, err, "it is empty");
    if (width > INT32_MAX / 16 || height > INT32_MAX / 16 || (uint64_t)width * (uint64_t)height > limit_pixel)
        return error_set(err, STATUS_TOO_LARGE, "cannot read image '%s': %lld x %lld pixels, at most %zu are allowed",
                         path_file_name(rd->path), (long long)width, (long long)height, limit_pixel);
    /* a small file that promises a huge picture: no compression makes a photograph 4096 pixels a byte */
    struct stat file;
    if (stat(rd->path, &file) != 0) return error_set_errno(err, "cannot read image '%s'", path_file_name(rd->path));
    if ((uint64_t)width * (uint64_t)height / 4096 > (uint64_t)file.st_size)
        return error_set(err, STATUS_FORMAT,
                         "cannot read image '%s': its header promises %lld x %lld pixels, the file has %lld bytes",
                         path_file_name(rd->path), (long long)width, (long long)height, (long long)file.st_size);
    rd->width = (int32_t)width;
    rd->height = (int32_t)height;
    rd->min_y = w.min.y;
    return check_channels(rd, err);
}

/* A channel that is not wanted is decoded all the same: the routines of OpenEXRCore 3.1.5 for three half channels write
 * through its pointer without asking whether there is one. */
static bool decode_unwanted(struct reader *rd, exr_coding_channel_info_t *c)
{
    const size_t sample = (size_t)c->bytes_per_element, bytes = (size_t)c->width * (size_t)c->height * sample;
    if (bytes > rd->rest_bytes) {
        uint8_t *larger = realloc(rd->rest, bytes);
        if (larger == NULL) return false;
        rd->rest = larger;
        rd->rest_bytes = bytes;
    }
    c->user_bytes_per_element = c->bytes_per_element;
    c->user_data_type = c->data_type;
    c->user_pixel_stride = (int32_t)sample;
    c->user_line_stride = (int32_t)((size_t)c->width * sample);
    c->decode_to_ptr = rd->rest;
    return true;
}

/* Decodes one chunk whose top left pixel is (x, y) of the image. Outputs beyond the image cannot happen: sizes are
 * checked. */
static exr_result_t decode_chunk(struct reader *rd, exr_decode_pipeline_t *decoder, const exr_chunk_info_t *chunk,
                                 int32_t x, int32_t y, bool *first)
{
    if (x < 0 || y < 0 || chunk->width <= 0 || chunk->height <= 0 || x > rd->width - chunk->width ||
        y > rd->height - chunk->height)
        return EXR_ERR_BAD_CHUNK_LEADER;
    exr_result_t r = *first ? exr_decoding_initialize(rd->file, 0, chunk, decoder)
                            : exr_decoding_update(rd->file, 0, chunk, decoder);
    if (r != EXR_ERR_SUCCESS) return r;
    for (int16_t k = 0; k < decoder->channel_count; k++) {
        exr_coding_channel_info_t *c = &decoder->channels[k];
        int which = letter_index(rd, c->channel_name);
        bool wanted = rd->grey ? which == 3 : which >= 0 && which < 3;
        if (!wanted && !decode_unwanted(rd, c)) return EXR_ERR_OUT_OF_MEMORY;
        if (!wanted) continue;
        size_t channel = rd->grey ? 0 : (size_t)which;
        c->user_bytes_per_element = sizeof(float);
        c->user_data_type = EXR_PIXEL_FLOAT;
        c->user_pixel_stride = 3 * sizeof(float);
        c->user_line_stride = rd->width * 3 * (int32_t)sizeof(float);
        c->decode_to_ptr = (uint8_t *)(rd->im->pixel + ((size_t)y * (size_t)rd->width + (size_t)x) * 3 + channel);
    }
    if (*first) r = exr_decoding_choose_default_routines(rd->file, 0, decoder);
    *first = false;
    return r == EXR_ERR_SUCCESS ? exr_decoding_run(rd->file, 0, decoder) : r;
}

static exr_result_t read_scanlines(struct reader *rd, exr_decode_pipeline_t *decoder, bool *first)
{
    int32_t lines = 0;
    exr_result_t r = exr_get_scanlines_per_chunk(rd->file, 0, &lines);
    if (r == EXR_ERR_SUCCESS && lines <= 0) r = EXR_ERR_BAD_CHUNK_LEADER;
    for (int32_t y = 0; y < rd->height && r == EXR_ERR_SUCCESS; y += lines) {
        exr_chunk_info_t chunk;
        r = exr_read_scanline_chunk_info(rd->file, 0, rd->min_y + y, &chunk);
        if (r == EXR_ERR_SUCCESS) r = decode_chunk(rd, decoder, &chunk, 0, y, first);
    }
    return r;
}

static exr_result_t read_tiles(struct reader *rd, exr_decode_pipeline_t *decoder, bool *first)
{
    uint32_t tile_x = 0, tile_y = 0;
    exr_tile_level_mode_t levels;
    exr_tile_round_mode_t rounding;
    exr_result_t r = exr_get_tile_descriptor(rd->file, 0, &tile_x, &tile_y, &levels, &rounding);
    if (r != EXR_ERR_SUCCESS) return r;
    if (tile_x == 0 || tile_y == 0 || tile_x > INT32_MAX / 2 || tile_y > INT32_MAX / 2) return EXR_ERR_INVALID_ATTR;
    for (int32_t y = 0, j = 0; y < rd->height && r == EXR_ERR_SUCCESS; y += (int32_t)tile_y, j++)
        for (int32_t x = 0, i = 0; x < rd->width && r == EXR_ERR_SUCCESS; x += (int32_t)tile_x, i++) {
            exr_chunk_info_t chunk; /* level 0 is the whole picture, whatever else is stored */
            r = exr_read_tile_chunk_info(rd->file, 0, i, j, 0, 0, &chunk);
            if (r == EXR_ERR_SUCCESS) r = decode_chunk(rd, decoder, &chunk, x, y, first);
        }
    return r;
}

static status read_pixels(struct reader *rd, struct error *err)
{
    exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
    bool first = true;
    status st = image_init(rd->im, (size_t)rd->width, (size_t)rd->height, 3, err);
    if (st != STATUS_OK) return st;
    exr_result_t r =
        rd->storage == EXR_STORAGE_TILED ? read_tiles(rd, &decoder, &first) : read_scanlines(rd, &decoder, &first);
    if (!first) exr_decoding_destroy(rd->file, &decoder);
    if (r != EXR_ERR_SUCCESS) return refuse(rd, err, reason(&rd->note, r));
    float *p = rd->im->pixel;
    for (size_t i = 0; rd->grey && i < rd->im->width * rd->im->height; i++) p[3 * i + 1] = p[3 * i + 2] = p[3 * i];
    return STATUS_OK;
}

/* said: NULL, or the place for the statements of the file. */
static status read_channels(struct image *im, const char *path, const char *prefix, size_t limit_pixel,
                            struct exr_statements *said, struct error *err)
{
    struct reader rd = {.im = im, .path = path, .prefix = prefix};
    memset(im, 0, sizeof *im);
    exr_context_initializer_t init = initializer(&rd.note);
    if (access(path, R_OK) != 0) return error_set_errno(err, "cannot read image '%s'", path_file_name(path));
    reading_note_set("OpenEXR", path);
    exr_result_t r = exr_start_read(&rd.file, path, &init);
    if (r != EXR_ERR_SUCCESS) {
        reading_note_set(NULL, NULL);
        return refuse(&rd, err, reason(&rd.note, r));
    }
    status st = read_header(&rd, limit_pixel, err);
    if (st == STATUS_OK) st = read_pixels(&rd, err);
    if (st == STATUS_OK && said != NULL) exr_statements_read(rd.file, said);
    if (st != STATUS_OK) image_release(im);
    free(rd.rest);
    exr_finish(&rd.file);
    reading_note_set(NULL, NULL);
    return st;
}

status image_read_exr_stated(struct image *im, const char *path, size_t limit_pixel, struct exr_statements *said,
                             struct error *err)
{
    return read_channels(im, path, "", limit_pixel, said, err);
}

status image_read_exr(struct image *im, const char *path, size_t limit_pixel, struct error *err)
{
    struct exr_statements said;
    double matrix[9];
    status st = read_channels(im, path, "", limit_pixel, &said, err);
    if (st != STATUS_OK || !said.has_primaries) return st;
    if (!color_primaries_matrix(&said.primaries, matrix)) {
        image_release(im);
        return error_set(err, STATUS_FORMAT, "cannot read image '%s': its chromaticities are no primaries",
                         path_file_name(path));
    }
    if (!color_matrix_is_identity(matrix)) image_apply_matrix(im, matrix);
    return STATUS_OK;
}

status image_read_exr_variance(struct image *im, const char *path, size_t limit_pixel, struct error *err)
{
    return read_channels(im, path, "var.", limit_pixel, NULL, err);
}

status image_read_exr_filtered(struct image *im, const char *path, size_t limit_pixel, struct error *err)
{
    return read_channels(im, path, "filtered.", limit_pixel, NULL, err);
}
