/* Camera raw through LibRaw: its decoder and its table of cameras alone. None of its development is used, so there is
 * no white balance, no gamma, no brightening and no interpolation.
 *
 * A picture of a Bayer sensor becomes one pixel for each cell of 2 x 2 samples: red, the mean of both greens, and blue,
 * as they were measured. It has half of the sensor's width and height, and noise of neighbouring pixels stays
 * independent; info->sample_px says where in the cell each color lies. Monochrome sensors and linear rgb keep their
 * size. The orientation is stated, and applied later. Values
 * are (sample - black) / (white - black), neither clamped at 0 nor cut at 1; a pixel with a sample at or above the
 * camera's limit is at least 1. */
#include "base/files/durable.h"
#include "optimizer/photographs/reader/float_dng.h"
#include "optimizer/photographs/reader/photograph_reader.h"

#include <libraw/libraw.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

enum { MEMORY_LIMIT_MB = 500, LEAST_COMPRESSION = 64 };

/* Where the black level and the limit of each sample come from. */
struct raw_levels {
    const libraw_data_t *lr;
    double override, black, limit, full_scale; /* black: without the parts that depend on place and color */
};

static double black_at(const struct raw_levels *k, unsigned row, unsigned column, int color)
{
    const unsigned *c = k->lr->color.cblack;
    if (!isnan(k->override)) return k->override;
    double black = (double)k->lr->color.black + (double)c[color & 3];
    if (c[4] > 0 && c[5] > 0 && 6 + (size_t)c[4] * c[5] <= LIBRAW_CBLACK_SIZE)
        black += (double)c[6 + row % c[4] * c[5] + column % c[5]];
    return black;
}

static double light_of(const struct raw_levels *k, unsigned value, double black, bool *saturated)
{
    *saturated = *saturated || (double)value >= k->limit;
    return ((double)value - black) / k->full_scale;
}

static void put_pixel(float pixel[3], const double rgb[3], bool saturated)
{
    for (int c = 0; c < 3; c++) pixel[c] = (float)rgb[c];
    if (saturated) /* the channel that is nearest to the limit is the one that passed it */
        for (int c = 0; c < 3; c++)
            if (rgb[c] >= fmax(rgb[0], fmax(rgb[1], rgb[2])) && pixel[c] < 1.0f) pixel[c] = 1.0f;
}

static size_t pitch_of(const libraw_data_t *lr, size_t bytes)
{
    return lr->sizes.raw_pitch != 0 ? lr->sizes.raw_pitch / bytes : lr->sizes.raw_width;
}

/* Index of the rgb channel of a color of the sensor; -1 for others than red, green and blue. */
static int channel_of(const libraw_data_t *lr, int color)
{
    const char *at = color >= 0 && color < 4 ? strchr("RGB", lr->idata.cdesc[color]) : NULL;
    return at != NULL && *at != '\0' ? (int)(at - "RGB") : -1;
}

/* Returns whether each cell of 2 x 2 samples has a red, two greens and a blue. */
static bool is_bayer(libraw_data_t *lr)
{
    int n[3] = {0};
    for (int i = 0; i < 4; i++) {
        int c = channel_of(lr, libraw_COLOR(lr, i / 2, i % 2));
        if (c < 0) return false;
        n[c]++;
    }
    return lr->idata.filters > 1000 && n[0] == 1 && n[1] == 2 && n[2] == 1;
}

static void take_cell(libraw_data_t *lr, const struct raw_levels *k, unsigned y, unsigned x, float pixel[3])
{
    double rgb[3] = {0};
    bool saturated = false;
    for (unsigned i = 0; i < 4; i++) {
        unsigned row = 2 * y + i / 2, column = 2 * x + i % 2;
        int color = libraw_COLOR(lr, (int)row, (int)column), c = channel_of(lr, color);
        unsigned value =
            lr->rawdata.raw_image[(row + lr->sizes.top_margin) * pitch_of(lr, 2) + column + lr->sizes.left_margin];
        rgb[c] += light_of(k, value, black_at(k, row, column, color), &saturated) * (c == 1 ? 0.5 : 1.0);
    }
    put_pixel(pixel, rgb, saturated);
}

/* Where the samples of each channel lie from the middle of a cell, in cells. */
static void place_samples(libraw_data_t *lr, double place[3][2])
{
    for (int i = 0; i < 4; i++) {
        const int c = channel_of(lr, libraw_COLOR(lr, i / 2, i % 2));
        place[c][0] += (c == 1 ? 0.5 : 1.0) * (0.5 * (i % 2) - 0.25);
        place[c][1] += (c == 1 ? 0.5 : 1.0) * (0.5 * (i / 2) - 0.25);
    }
}

static void take_sample(const libraw_data_t *lr, const struct raw_levels *k, unsigned y, unsigned x, float pixel[3])
{
    double rgb[3];
    bool saturated = false;
    size_t row = y + lr->sizes.top_margin, column = x + lr->sizes.left_margin;
    for (int c = 0; c < 3; c++) {
        unsigned value = lr->rawdata.raw_image != NULL ? lr->rawdata.raw_image[row * pitch_of(lr, 2) + column]
                         : lr->rawdata.color3_image != NULL
                             ? lr->rawdata.color3_image[row * pitch_of(lr, 6) + column][c]
                             : lr->rawdata.color4_image[row * pitch_of(lr, 8) + column][c];
        rgb[c] = light_of(k, value, black_at(k, y, x, lr->rawdata.raw_image != NULL ? 0 : c), &saturated);
    }
    put_pixel(pixel, rgb, saturated);
}

static status take_picture(libraw_data_t *lr, const char *name, const struct raw_levels *k, struct image *im,
                           struct photograph_info *info, struct error *err)
{
    bool mosaic = lr->rawdata.raw_image != NULL && lr->idata.filters != 0;
    if (mosaic && !is_bayer(lr))
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot read photograph '%s': its sensor has no Bayer pattern of red, green and blue (such as "
                         "X-Trans): convert the raw file to linear DNG or OpenEXR",
                         name);
    size_t step = mosaic ? 2 : 1, width = lr->sizes.width / step, height = lr->sizes.height / step;
    if (width == 0 || height == 0 || lr->sizes.width + lr->sizes.left_margin > lr->sizes.raw_width ||
        lr->sizes.height + lr->sizes.top_margin > lr->sizes.raw_height)
        return error_set(err, STATUS_FORMAT, "cannot read photograph '%s': it has no picture", name);
    if (mosaic) place_samples(lr, info->sample_px);
    status s = image_init(im, width, height, 3, err);
    for (unsigned y = 0; y < height && s == STATUS_OK; y++)
        for (unsigned x = 0; x < width; x++)
            if (mosaic)
                take_cell(lr, k, y, x, im->pixel + (y * width + x) * 3);
            else
                take_sample(lr, k, y, x, im->pixel + (y * width + x) * 3);
    return s;
}

static status take_levels(libraw_data_t *lr, const char *name, const struct photograph_request *q, struct raw_levels *k,
                          struct photograph_info *info, struct error *err)
{
    const libraw_colordata_t *c = &lr->color;
    *k = (struct raw_levels){.lr = lr, .override = q->black_level, .limit = (double)c->maximum};
    double black = 0.0;
    for (unsigned i = 0; i < 4; i++)
        black += black_at(k, i / 2, i % 2, lr->idata.filters > 1000 ? libraw_COLOR(lr, (int)(i / 2), (int)(i % 2)) : 0);
    k->black = black / 4.0;
    k->full_scale = (double)c->maximum - k->black;
    for (int i = 0; i < 4; i++)
        if (c->linear_max[i] > 0) k->limit = fmin(k->limit, (double)c->linear_max[i]);
    if (!(k->full_scale >= 1.0) || k->limit <= k->black)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': its black level %g is not below its white level %u", name,
                         k->black, c->maximum);
    info->black_level = k->black;
    info->full_scale = k->full_scale;
    for (int i = 0; i < 3; i++) info->saturation[i] = 1.0;
    file_ledger_add(&info->ledger, "black level", isnan(q->black_level) ? NULL : "the document gives one", "%g",
                    (double)c->black + (double)c->cblack[0]);
    file_ledger_add(&info->ledger, "white level", NULL, "%u", c->maximum);
    info->bits = 1;
    while (info->bits < 16 && (1u << info->bits) <= c->maximum) info->bits++;
    return STATUS_OK;
}

static double known(float value) { return value > 0.0f && isfinite(value) ? (double)value : NAN; }

static status decode(libraw_data_t *lr, const char *path, const struct photograph_request *q, struct image *im,
                     struct photograph_info *info, struct error *err)
{
    const char *name = path_file_name(path);
    struct raw_levels k;
    struct stat st;
    lr->params.max_raw_memory_mb = MEMORY_LIMIT_MB;
    int r = libraw_open_file(lr, path);
    size_t n = r == 0 ? (size_t)lr->sizes.raw_width * lr->sizes.raw_height : 0;
    if (n > q->limit_pixel)
        return error_set(err, STATUS_TOO_LARGE, "cannot read photograph '%s': %u x %u pixels, the limit is %zu in all",
                         name, lr->sizes.raw_width, lr->sizes.raw_height, q->limit_pixel);
    if (r == 0 && stat(path, &st) == 0 && n / LEAST_COMPRESSION > (size_t)st.st_size)
        return error_set(err, STATUS_FORMAT,
                         "cannot read photograph '%s': its header promises %u x %u pixels, the file has %lld bytes",
                         name, lr->sizes.raw_width, lr->sizes.raw_height, (long long)st.st_size);
    if (r == 0) r = libraw_unpack(lr);
    if (r != 0)
        return error_set(err, r == LIBRAW_UNSUFFICIENT_MEMORY ? STATUS_NO_MEMORY : STATUS_FORMAT,
                         "cannot read photograph '%s': LibRaw says: %s", name, libraw_strerror(r));
    if (lr->rawdata.raw_image == NULL && lr->rawdata.color3_image == NULL && lr->rawdata.color4_image == NULL)
        return error_set(err, STATUS_UNSUPPORTED, "cannot read photograph '%s': it holds no integer raw samples", name);
    status s = take_levels(lr, name, q, &k, info, err);
    if (s != STATUS_OK) return s;
    info->exposure_s = known(lr->other.shutter);
    info->iso = known(lr->other.iso_speed);
    info->aperture = known(lr->other.aperture);
    static const unsigned orientation_of_flip[8] = {1, 2, 4, 3, 5, 8, 6, 7};
    info->orientation = orientation_of_flip[lr->sizes.flip & 7];
    snprintf(info->camera, sizeof info->camera, "%.40s %.40s", lr->idata.make, lr->idata.model);
    return take_picture(lr, name, &k, im, info, err);
}

static void ignore_data_error(void *context, const char *file, const int offset)
{
    int *n_damaged = context;
    (void)file, (void)offset;
    ++*n_damaged;
}

static status read_raw(const char *path, const struct photograph_request *q, struct image *im,
                       struct photograph_info *info, struct error *err)
{
    int n_damaged = 0;
    status s = float_dng_read(path, q, im, info, err);
    if (s != STATUS_NOT_FOUND) return s;
    libraw_data_t *lr = libraw_init(LIBRAW_OPIONS_NO_MEMERR_CALLBACK | LIBRAW_OPIONS_NO_DATAERR_CALLBACK);
    if (lr == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", path_file_name(path));
    libraw_set_dataerror_handler(lr, ignore_data_error, &n_damaged);
    s = decode(lr, path, q, im, info, err);
    if (s == STATUS_OK && n_damaged > 0) {
        image_release(im);
        s = error_set(err, STATUS_FORMAT, "cannot read photograph '%s': its raw data are damaged or end too early",
                      path_file_name(path));
    }
    libraw_close(lr);
    return s;
}

const photograph_reader raw_photograph_reader = {
    "raw.v1", "camera raw",
    " dng cr2 cr3 crw nef nrw arw sr2 srf raf rw2 orf pef srw kdc dcr 3fr iiq erf mef mos mrw rwl x3f ", NULL,
    read_raw};
