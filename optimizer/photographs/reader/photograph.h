/* One photograph to its mean rgb radiance.
 *
 * Reads any format of photograph_reader.h, takes the crop, divides by the exposure where it is known, multiplies by the
 * photograph's scale. The exposure is t (ISO / 100) / N^2, time t in seconds and f-number N; a factor that neither the
 * document nor the file states is 1 (photographs_check_exposure requires that all photographs state the same ones). The
 * standard error of the mean comes from the means of square sub-blocks (8 x 8 of them where the crop allows, 8 along a
 * column): cloth has texture that is correlated from pixel to pixel, so single pixels would state an error that is far
 * too small. STATUS_FORMAT / STATUS_INVALID naming the file: unreadable, NaN or infinite pixels, negative mean, all
 * black, saturated (more than 2 % of the crop at the value where the picture is clipped), crop outside the picture,
 * linear samples that are declared as srgb. */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_H

#include "optimizer/job/document/job_limits.h"
#include "optimizer/job/document/picture_words.h"
#include "optimizer/photographs/reader/photograph_reader.h"

struct job_photograph;

/* Causes of errors that all photographs of a camera share: three of the color matrix for each channel of radiance, the
 * rounding of exposure times, of f-numbers and of ISO values. */
enum {
    PHOTOGRAPH_TIME_CAUSE = 9,
    PHOTOGRAPH_APERTURE_CAUSE,
    PHOTOGRAPH_ISO_CAUSE,
    PHOTOGRAPH_CAUSES,
    PHOTOGRAPH_EXPOSURES = JOB_MAX_MORE_EXPOSURES + 1,
    PHOTOGRAPH_PARTS = 8 /* along an edge of the crop */
};

/* The record of a file on its way to radiances. */
struct photograph_record {
    struct photograph_info info; /* with the exposure that the document overrides */
    size_t width, height;        /* of the file, in pixels of the image that was read */
    double saturated_share;      /* of the crop's pixels that have a saturated channel */
    double exposure;             /* pixel values were divided by it; 1 when nothing is known */
    bool merged;                 /* by the estimator of exposure_merge.h, of n_exposure pictures */
    size_t n_exposure;
    double scale_s;                        /* stated time of the exposure that the scale of the values belongs to */
    double fitted_s[PHOTOGRAPH_EXPOSURES]; /* times by the light of the exposures (exposure_ratio.h) */
    double exposure_se_rgb[3];             /* of the mean, by the errors of fitted_s; in all channels by one cause */
    char exposure_warning[400];            /* "", or why exposures or their stated times are doubtful */
    double noise_se_rgb[3]; /* of the mean, by the camera's noise; with merged alone, NaN without a noise record */
    /* Errors of the mean of channel c by independent causes of one standard deviation each, which are the same for all
     * channels and photographs: of the color matrix and of the rounding of exposures. */
    double color_error[3][PHOTOGRAPH_CAUSES];
    bool is_column; /* of a cylinder: light changes across it, so parts are compared along it alone, and the weights of
                       pixels fall from the middle to both sides */
    size_t n_part;  /* of a column: parts along it, and their means */
    double part_rgb[PHOTOGRAPH_PARTS][3];
    bool resampled; /* pixels depend on their neighbours as after an enlargement or a strong filter */
};

struct photograph_mean {
    struct photograph_record record;
    double mean_rgb[3];
    double se_rgb[3];      /* by the scatter of sub-blocks, and by the errors of the color matrix */
    double block_contrast; /* standard deviation of sub-block means over the mean, largest channel */
    char warning[400];     /* "" or why the mean describes the crop badly */
};

/* Standard error of the mean of channel c by all causes of color_error. */
double photograph_color_se(const struct photograph_record *r, size_t c);

/* Reads one file (photograph_read) and measures it. */
status photograph_measure(const char *path, const struct job_photograph *p, struct photograph_mean *mean,
                          struct error *err);
/* Measures a crop that has been read; name: of its file. mean->record is set before. transfer: as declared. */
status photograph_measure_image(const struct image *im, const char *name, enum job_transfer transfer,
                                struct photograph_mean *mean, struct error *err);

/* Returns a photograph that declares nothing but its transfer: scale 1, no crop, exposure and black level as the file
 * states. */
struct job_photograph photograph_plain(enum job_transfer transfer);
/* The same for a picture whose transfer nobody declared: this one is taken where the file states no curve. */
struct job_photograph photograph_assumed(enum job_transfer transfer);

/* The crop as the file's values: neither divided by the exposure, which record states, nor scaled. */
status photograph_read_values(const char *path, const struct job_photograph *p, struct image *im,
                              struct photograph_record *record, struct error *err);
/* Multiplies all pixels. */
void image_scale(struct image *im, double factor);
/* The crop as an image, divided by the exposure and scaled. record may be NULL. The transfer of p applies to integer
 * samples alone: linear files are read as they are. */
status photograph_read(const char *path, const struct job_photograph *p, struct image *im,
                       struct photograph_record *record, struct error *err);

#endif
