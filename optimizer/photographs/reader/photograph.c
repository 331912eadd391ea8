#include "optimizer/photographs/reader/photograph.h"

#include "base/files/durable.h"
#include "optimizer/job/document/job_photograph.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { LIMIT_PIXEL = 200 * 1000 * 1000, MAX_BLOCK = PHOTOGRAPH_PARTS, MIN_BLOCK_PX = 4, FEW_PX = 16 };

static const double saturated_limit = 0.02;
static const double resampled_limit = 0.2; /* of neighbour_power */
/* Largest standard deviation of sub-block means over the mean without a warning. Cloth at 1 cm has a few per cent; a
 * shadow edge or a wrong crop has much more. */
static const double contrast_limit = 0.35;

static status crop_image(struct image *im, const size_t crop[4], const char *name, struct error *err)
{
    if (crop[2] == 0) return STATUS_OK;
    if (crop[2] > im->width || crop[3] > im->height)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': the crop ends at (%zu, %zu), the picture at (%zu, %zu)", name,
                         crop[2], crop[3], im->width, im->height);
    size_t w = crop[2] - crop[0], h = crop[3] - crop[1], n = im->n_channel;
    for (size_t y = 0; y < h; y++)
        memmove(im->pixel + y * w * n, im->pixel + ((y + crop[1]) * im->width + crop[0]) * n, w * n * sizeof(float));
    im->width = w;
    im->height = h;
    return STATUS_OK;
}

/* Share of the pixels that have a saturated channel. */
static double saturated_part(const struct image *im, const double saturation[3])
{
    size_t n = im->width * im->height, n_saturated = 0;
    for (size_t i = 0; i < n; i++) {
        const float *p = im->pixel + i * im->n_channel;
        n_saturated += (double)p[0] >= saturation[0] || (double)p[1] >= saturation[1] || (double)p[2] >= saturation[2];
    }
    return (double)n_saturated / (double)n;
}

/* Returns the power of the second differences of neighbours over the power for every other pixel, the larger ratio of
 * rows and columns. 1 for independent noise, 0.4 and more for photographs as a camera made them, 0.15 and less after an
 * enlargement by 2 or a blur by a pixel. 1 for pictures without structure. */
static double neighbour_power(const struct image *im)
{
    double largest = 0.0;
    for (int axis = 0; axis < 2; axis++) {
        size_t step = (axis == 0 ? 1 : im->width) * im->n_channel, n = axis == 0 ? im->width : im->height;
        double near = 0.0, far = 0.0;
        for (size_t y = 0; y < im->height; y++)
            for (size_t x = 0; x < im->width; x++) {
                size_t along = axis == 0 ? x : y;
                if (along < 2 || along + 2 >= n) continue;
                const float *p = im->pixel + (y * im->width + x) * im->n_channel + 1;
                double a = (double)(p[step] + *(p - step) - 2.0f * *p);
                double b = (double)(p[2 * step] + *(p - 2 * step) - 2.0f * *p);
                near += a * a;
                far += b * b;
            }
        if (!(far > 1e-12 * (double)(im->width * im->height))) return 1.0;
        largest = fmax(largest, near / far);
    }
    return largest;
}

/* Returns the document's value, or else the file's, and enters the file's into its ledger. */
static double chosen(struct file_ledger *ledger, const char *name, const char *unit, double given, double of_file)
{
    char reason[FILE_STATEMENT_BYTES];
    snprintf(reason, sizeof reason, "the document says %.6g%s", given, unit);
    if (!isnan(of_file)) file_ledger_add(ledger, name, given > 0.0 ? reason : NULL, "%.6g%s", of_file, unit);
    return given > 0.0 ? given : of_file;
}

static double exposure_of(const struct job_photograph *p, struct photograph_info *info)
{
    info->exposure_s = chosen(&info->ledger, "exposure time", " s", p->exposure_s, info->exposure_s);
    info->iso = chosen(&info->ledger, "ISO", "", p->iso, info->iso);
    info->aperture = chosen(&info->ledger, "f-number", "", p->aperture, info->aperture);
    double exposure = 1.0;
    if (!isnan(info->exposure_s)) exposure *= info->exposure_s;
    if (!isnan(info->iso)) exposure *= info->iso / 100.0;
    if (!isnan(info->aperture)) exposure /= info->aperture * info->aperture;
    return exposure;
}

struct job_photograph photograph_plain(enum job_transfer transfer)
{
    return (struct job_photograph){.scale = 1.0,
                                   .weight = 1.0,
                                   .transfer = transfer,
                                   .exposure_s = NAN,
                                   .iso = NAN,
                                   .aperture = NAN,
                                   .black_level = NAN};
}

struct job_photograph photograph_assumed(enum job_transfer transfer)
{
    struct job_photograph p = photograph_plain(transfer);
    p.transfer_assumed = true;
    return p;
}

status photograph_read_values(const char *path, const struct job_photograph *p, struct image *im,
                              struct photograph_record *record, struct error *err)
{
    const struct photograph_request q = {.transfer = p->transfer,
                                         .transfer_assumed = p->transfer_assumed,
                                         .black_level = p->black_level,
                                         .limit_pixel = LIMIT_PIXEL};
    struct photograph_record r = {0};
    status s = photograph_file_read(path, &q, im, &r.info, err);
    if (s != STATUS_OK) return s;
    r.width = im->width;
    r.height = im->height;
    s = crop_image(im, p->crop_px, path_file_name(path), err);
    if (s != STATUS_OK) {
        image_release(im);
        return s;
    }
    r.saturated_share = saturated_part(im, r.info.saturation);
    r.resampled = r.info.encoded && neighbour_power(im) < resampled_limit;
    r.exposure = exposure_of(p, &r.info);
    r.n_exposure = 1;
    r.scale_s = r.fitted_s[0] = r.info.exposure_s;
    *record = r;
    return STATUS_OK;
}

void image_scale(struct image *im, double factor)
{
    for (size_t i = 0; i < im->width * im->height * im->n_channel; i++) im->pixel[i] *= (float)factor;
}

status photograph_read(const char *path, const struct job_photograph *p, struct image *im,
                       struct photograph_record *record, struct error *err)
{
    struct photograph_record r;
    status s = photograph_read_values(path, p, im, &r, err);
    if (s != STATUS_OK) return s;
    image_scale(im, p->scale / r.exposure);
    if (record != NULL) *record = r;
    return STATUS_OK;
}

/* Weight of the pixel x of a column: a cut through the weave at another phase then changes the mean little. */
static double column_weight(const struct image *im, size_t x)
{
    return 1.0 - fabs(2.0 * ((double)x + 0.5) / (double)im->width - 1.0);
}

/* Mean over all pixels, weighted across a column, and the scatter of the means of n_block[0] x n_block[1] sub-blocks,
 * which are kept for a column. */
static void measure_channel(const struct image *im, size_t c, const size_t n_block[2], struct photograph_record *r,
                            double *mean, double *block_sd)
{
    double total = 0.0, weights = 0.0, sum = 0.0, sum2 = 0.0;
    for (size_t i = 0; i < n_block[0] * n_block[1]; i++) {
        const size_t bx = i % n_block[0], by = i / n_block[0];
        const size_t x0 = bx * im->width / n_block[0], x1 = (bx + 1) * im->width / n_block[0];
        const size_t y0 = by * im->height / n_block[1], y1 = (by + 1) * im->height / n_block[1];
        double block = 0.0, own = 0.0;
        for (size_t y = y0; y < y1; y++)
            for (size_t x = x0; x < x1; x++) {
                const double weight = r->is_column ? column_weight(im, x) : 1.0;
                block += weight * (double)im->pixel[(y * im->width + x) * im->n_channel + c];
                own += weight;
            }
        total += block;
        weights += own;
        block /= own;
        if (r->is_column) r->part_rgb[i][c] = block;
        sum += block;
        sum2 += block * block;
    }
    double n = (double)(n_block[0] * n_block[1]), block_mean = sum / n;
    *mean = total / weights;
    *block_sd = n > 1.0 ? sqrt(fmax(0.0, (sum2 - n * block_mean * block_mean) / (n - 1.0))) : 0.0;
}

static status check_pixels(const struct image *im, const char *name, struct error *err)
{
    for (size_t i = 0; i < im->width * im->height; i++)
        for (size_t c = 0; c < 3; c++)
            if (!isfinite(im->pixel[i * im->n_channel + c]))
                return error_set(err, STATUS_INVALID,
                                 "cannot use photograph '%s': pixel (%zu, %zu) is not a finite number", name,
                                 i % im->width, i / im->width);
    return STATUS_OK;
}

/* The most important reason why the mean may describe the cloth badly. */
static void warn(const struct image *im, const char *name, struct photograph_mean *mean)
{
    const size_t n_bytes = sizeof mean->warning;
    if (mean->block_contrast > contrast_limit)
        snprintf(
            mean->warning, n_bytes,
            "photograph '%s' is not uniform: the means of its parts scatter by %.0f %%, so one mean describes it badly",
            name, 100.0 * mean->block_contrast);
    else if (mean->record.info.encoded && !mean->record.is_column && (im->width < FEW_PX || im->height < FEW_PX))
        snprintf(mean->warning, n_bytes,
                 "photograph '%s' has only %zu x %zu pixels of cloth: too few for a mean with a standard error", name,
                 im->width, im->height);
    else if (mean->record.resampled)
        snprintf(mean->warning, n_bytes,
                 "photograph '%s' was enlarged or strongly filtered: its neighbouring pixels hardly differ. Give the "
                 "picture as the camera made it",
                 name);
    else if (file_ledger_find(&mean->record.info.ledger, "damage beside the samples") != NULL)
        snprintf(mean->warning, n_bytes, "photograph '%s' is damaged beside its samples: %.120s", name,
                 file_ledger_find(&mean->record.info.ledger, "damage beside the samples")->value);
    else if (mean->record.info.has_alpha)
        snprintf(mean->warning, n_bytes,
                 "photograph '%s' has an alpha channel, as edited pictures have: it is opaque and was left out", name);
}

double photograph_color_se(const struct photograph_record *r, size_t c)
{
    const double *e = r->color_error[c];
    double square = 0.0;
    for (size_t k = 0; k < PHOTOGRAPH_CAUSES; k++) square += e[k] * e[k];
    return sqrt(square);
}

status photograph_measure_image(const struct image *im, const char *name, enum job_transfer transfer,
                                struct photograph_mean *mean, struct error *err)
{
    struct photograph_record *r = &mean->record;
    if (!r->info.encoded && transfer == JOB_TRANSFER_SRGB)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': its transfer is declared as srgb, but %s%s is linear: leave "
                         "'transfer' out",
                         name, r->info.bits == 32 ? "float " : "", r->info.format);
    status s = check_pixels(im, name, err);
    if (s != STATUS_OK) return s;
    const size_t least = im->width < im->height ? im->width : im->height, side = r->is_column ? im->height : least,
                 n = side / MIN_BLOCK_PX > MAX_BLOCK ? MAX_BLOCK
                     : side / MIN_BLOCK_PX < 1       ? 1
                                                     : side / MIN_BLOCK_PX,
                 n_block[2] = {r->is_column ? 1 : n, n};
    const double n_part = sqrt((double)(n_block[0] * n_block[1]));
    r->n_part = r->is_column ? n : 0;
    for (size_t c = 0; c < 3; c++) {
        double block_sd;
        measure_channel(im, c, n_block, r, &mean->mean_rgb[c], &block_sd);
        mean->se_rgb[c] = hypot(hypot(block_sd / n_part, r->exposure_se_rgb[c]), photograph_color_se(r, c));
        if (mean->mean_rgb[c] > 0.0) mean->block_contrast = fmax(mean->block_contrast, block_sd / mean->mean_rgb[c]);
    }
    const double *m = mean->mean_rgb;
    if (m[0] < 0.0 || m[1] < 0.0 || m[2] < 0.0)
        return error_set(err, STATUS_INVALID, "cannot use photograph '%s': its mean rgb (%g, %g, %g) is negative", name,
                         m[0], m[1], m[2]);
    if (m[0] + m[1] + m[2] <= 0.0)
        return error_set(err, STATUS_INVALID, "cannot use photograph '%s': it is all black", name);
    if (r->saturated_share > saturated_limit)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': %.1f %% of its pixels are saturated, allowed are %.0f %%", name,
                         100.0 * r->saturated_share, 100.0 * saturated_limit);
    warn(im, name, mean);
    return STATUS_OK;
}

status photograph_measure(const char *path, const struct job_photograph *p, struct photograph_mean *mean,
                          struct error *err)
{
    struct image im;
    memset(mean, 0, sizeof *mean);
    status s = photograph_read(path, p, &im, &mean->record, err);
    if (s != STATUS_OK) return s;
    s = photograph_measure_image(&im, path_file_name(path), p->transfer, mean, err);
    image_release(&im);
    return s;
}
