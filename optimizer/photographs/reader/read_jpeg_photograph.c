/* JPEG through libjpeg. Its longjmp stays in this file. */
#include "base/files/durable.h"
#include "optimizer/photographs/reader/exif.h"
#include "optimizer/photographs/reader/integer_samples.h"
#include "optimizer/photographs/reader/photograph_reader.h"
#include "optimizer/photographs/reader/xmp.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <jpeglib.h>

#include <jerror.h>

/* At most about 400 pixels a byte: constant blocks of 8 x 8 take less than two bits. */
enum { MOST_PIXELS_PER_BYTE = 4096 };

struct jpeg_failure {
    struct jpeg_error_mgr manager; /* first: libjpeg knows this part alone */
    jmp_buf jump;
    char text[JMSG_LENGTH_MAX], stray[JMSG_LENGTH_MAX];
    bool damaged, in_header;
};

static void on_error(j_common_ptr jpeg)
{
    struct jpeg_failure *f = (struct jpeg_failure *)jpeg->err;
    jpeg->err->format_message(jpeg, f->text);
    longjmp(f->jump, 1);
}

/* Warnings are damaged data: libjpeg would go on with grey. Bytes between the segments before the picture data touch no
 * pixel. */
static void on_message(j_common_ptr jpeg, int level)
{
    struct jpeg_failure *f = (struct jpeg_failure *)jpeg->err;
    if (level >= 0 || f->damaged) return;
    if (f->in_header && jpeg->err->msg_code == JWRN_EXTRANEOUS_DATA) {
        jpeg->err->format_message(jpeg, f->stray);
        return;
    }
    f->damaged = true;
    jpeg->err->format_message(jpeg, f->text);
}

static bool recognise(const uint8_t first[PHOTOGRAPH_FIRST_BYTES]) { return memcmp(first, "\xff\xd8\xff", 3) == 0; }

static status check_header(struct jpeg_decompress_struct *jpeg, const char *name, const struct photograph_request *q,
                           FILE *file, struct error *err)
{
    struct stat st;
    size_t n = (size_t)jpeg->image_width * jpeg->image_height;
    if (jpeg->num_components != 1 && jpeg->num_components != 3)
        return error_set(err, STATUS_UNSUPPORTED, "cannot use photograph '%s': it has %d channels, allowed are 1 and 3",
                         name, jpeg->num_components);
    if (n > q->limit_pixel)
        return error_set(err, STATUS_TOO_LARGE, "cannot read photograph '%s': %u x %u pixels, the limit is %zu in all",
                         name, jpeg->image_width, jpeg->image_height, q->limit_pixel);
    if (fstat(fileno(file), &st) != 0) return error_set_errno(err, "cannot read photograph '%s'", name);
    if (n / MOST_PIXELS_PER_BYTE > (size_t)st.st_size)
        return error_set(err, STATUS_FORMAT,
                         "cannot read photograph '%s': its header promises %u x %u pixels, the file has %lld bytes",
                         name, jpeg->image_width, jpeg->image_height, (long long)st.st_size);
    return STATUS_OK;
}

static void take_exif(const struct jpeg_decompress_struct *jpeg, struct photograph_info *info)
{
    for (const struct jpeg_marker_struct *m = jpeg->marker_list; m != NULL; m = m->next)
        if (m->marker == JPEG_APP0 + 1 && m->data_length > 6 && memcmp(m->data, "Exif\0\0", 6) == 0)
            exif_read_bytes(m->data, m->data_length, info);
    static const char xmp[] = "http://ns.adobe.com/xap/1.0/"; /* its final 0 is part of the marker */
    for (const struct jpeg_marker_struct *m = jpeg->marker_list; m != NULL; m = m->next)
        if (m->marker == JPEG_APP0 + 1 && m->data_length > sizeof xmp && memcmp(m->data, xmp, sizeof xmp) == 0)
            xmp_read(m->data + sizeof xmp, m->data_length - sizeof xmp, info);
}

/* The state that outlives the longjmp. */
struct jpeg_work {
    struct jpeg_decompress_struct jpeg;
    struct jpeg_failure failure;
    struct declared_color color;
    JOCTET *profile;
    float *light;
    JSAMPLE *row;
};

/* Curve and primaries that the file declares: by its ICC profile, or by the color space of Exif. */
static status take_colors(struct jpeg_work *w, const char *path, struct photograph_info *info, struct error *err)
{
    unsigned n = 0;
    status s = STATUS_OK;
    take_exif(&w->jpeg, info);
    if (jpeg_read_icc_profile(&w->jpeg, &w->profile, &n))
        s = declared_color_icc(&w->color, path, w->profile, n, w->jpeg.num_components == 1, info, err);
    if (s == STATUS_OK) s = declared_color_exif(&w->color, info, err);
    if (w->jpeg.saw_JFIF_marker && w->jpeg.density_unit != 0 && w->jpeg.X_density > 1)
        file_ledger_add(&info->ledger, "JFIF density", "lengths follow from the crop", "%u pixels per %s",
                        w->jpeg.X_density, w->jpeg.density_unit == 1 ? "inch" : "cm");
    return s;
}

static status decode(struct jpeg_work *w, FILE *file, const char *path, const struct photograph_request *q,
                     struct image *im, struct photograph_info *info, struct error *err)
{
    struct jpeg_decompress_struct *jpeg = &w->jpeg;
    jpeg_stdio_src(jpeg, file);
    jpeg_save_markers(jpeg, JPEG_APP0 + 1, 0xffff);
    jpeg_save_markers(jpeg, JPEG_APP0 + 2, 0xffff);
    w->failure.in_header = true;
    jpeg_read_header(jpeg, TRUE);
    w->failure.in_header = false;
    if (w->failure.stray[0] != '\0')
        file_ledger_add(&info->ledger, "damage beside the samples", "bytes between segments touch no pixel", "%s",
                        w->failure.stray);
    status s = check_header(jpeg, path_file_name(path), q, file, err);
    if (s == STATUS_OK) s = take_colors(w, path, info, err);
    if (s == STATUS_OK) s = integer_samples_declare(path, q, 8, &w->color, info, err);
    if (s != STATUS_OK) return s;
    jpeg->out_color_space = JCS_RGB;
    jpeg->dct_method = JDCT_ISLOW;
    w->light = integer_samples_curves(q, &w->color, 255, info);
    w->row = malloc(3 * (size_t)jpeg->image_width);
    if (w->light == NULL || w->row == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", path_file_name(path));
    s = image_init(im, jpeg->image_width, jpeg->image_height, 3, err);
    if (s != STATUS_OK) return s;
    jpeg_start_decompress(jpeg);
    while (jpeg->output_scanline < jpeg->output_height) {
        float *to = im->pixel + (size_t)jpeg->output_scanline * im->width * 3;
        jpeg_read_scanlines(jpeg, &w->row, 1);
        for (size_t i = 0; i < 3 * im->width; i++) to[i] = w->light[256 * (i % 3) + w->row[i]];
    }
    return STATUS_OK;
}

static status read_jpeg(const char *path, const struct photograph_request *q, struct image *im,
                        struct photograph_info *info, struct error *err)
{
    const char *name = path_file_name(path);
    status s;
    FILE *file = fopen(path, "rbe");
    if (file == NULL) return error_set_errno(err, "cannot read photograph '%s'", name);
    struct jpeg_work *w = calloc(1, sizeof *w);
    if (w == NULL) {
        fclose(file);
        return error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", name);
    }
    w->jpeg.err = jpeg_std_error(&w->failure.manager);
    w->failure.manager.error_exit = on_error;
    w->failure.manager.emit_message = on_message;
    if (setjmp(w->failure.jump)) {
        s = error_set(err, STATUS_FORMAT, "cannot read photograph '%s': %s", name, w->failure.text);
    } else {
        jpeg_create_decompress(&w->jpeg);
        s = decode(w, file, path, q, im, info, err);
        if (s == STATUS_OK && w->failure.damaged)
            s = error_set(err, STATUS_FORMAT, "cannot read photograph '%s': %s", name, w->failure.text);
    }
    if (s != STATUS_OK) image_release(im);
    jpeg_destroy_decompress(&w->jpeg);
    declared_color_release(&w->color);
    free(w->profile);
    free(w->light);
    free(w->row);
    free(w);
    fclose(file);
    return s;
}

const photograph_reader jpeg_photograph_reader = {"jpeg.v1", "JPEG", " jpg jpeg ", recognise, read_jpeg};
