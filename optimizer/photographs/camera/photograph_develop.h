/* From the files of one view to an image in radiance units, by the job's knowledge of its camera: dark frames, the
 * record of its noise, several exposures, a color chart or a white reference.
 *
 * Steps: each exposure is read and cropped; the mean of the dark frames of its exposure time is subtracted; exposures
 * are merged (exposure_merge.h); the errors of the lens are removed (lens.h); the values are divided by the exposure
 * (photograph.h), multiplied by the color matrix, by the scale, and by the square of the lamp's distance over the
 * document's distance. Ownership: init/release. */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_DEVELOP_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_DEVELOP_H

#include "base/warning.h"
#include "optimizer/photographs/camera/color_chart.h"
#include "optimizer/photographs/camera/lens.h"
#include "optimizer/photographs/camera/marker_board.h"
#include "optimizer/photographs/camera/noise_record.h"
#include "optimizer/photographs/reader/photograph.h"

#include <jansson.h>

struct job_photograph;
struct job_rows;
struct job_setup;

/* The mean of the dark frames of one exposure time (NaN: not stated). */
struct dark_mean {
    double exposure_s;
    size_t n;
    struct image image;
};

struct photograph_process {
    bool has_noise;
    struct noise_record noise;
    size_t n_dark;
    struct dark_mean *dark;
    struct lens lens; /* of the rig, as the markers */
    struct marker_board board;
    double lamp_distance_cm; /* that chart, white reference and scale belong to; NaN: does not matter */
    bool has_color;          /* matrix: from the camera's rgb, over its exposure, to radiances */
    double matrix[9];
    double matrix_cov[3][9];           /* covariance of each row of the matrix; rows are taken to be independent */
    struct photograph_info color_info; /* of the photograph of the chart or of the white reference */
    struct color_chart chart;          /* with has_color and the document's has_chart */
    struct image chart_picture;        /* color_chart_picture; no pixels without a chart */
    /* The list that the ledger of every file that is read is appended to (base/files/file_ledger_json.h), of the
     * caller; NULL: not wanted. */
    json_t *files;
};

void photograph_process_init(struct photograph_process *k);
void photograph_process_release(struct photograph_process *k);
/* Reads the files of camera and rig that the document names; they are in `folder`. Gives photographs the angles of the
 * views that they name (rig.h), and crops and cameras by markers (marker_views.h). Errors have the option in
 * err->field. */
status photograph_process_load(struct photograph_process *k, struct job_setup *setup, struct job_rows *rows,
                               const char *folder, struct error *err);
/* Develops a photograph of the job. record may be NULL. Errors as in photograph_read; STATUS_INVALID besides: exposures
 * of different sizes, ISO values or f-numbers, or of unknown time; no dark frame of the exposure time; a noise record
 * of another ISO value. */
status photograph_develop(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                          struct image *im, struct photograph_record *record, struct error *err);

#endif
