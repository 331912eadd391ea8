/* The job's knowledge of its camera, which turns files into radiances: dark frames, the record of its noise, rig and
 * lens, colors. Ownership: init/release; photograph_process_load.h fills it in. */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_PROCESS_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_PROCESS_H

#include "base/warning.h"
#include "optimizer/photographs/camera/color_chart.h"
#include "optimizer/photographs/camera/exposure_carry.h"
#include "optimizer/photographs/camera/exposure_series.h"
#include "optimizer/photographs/camera/lens.h"
#include "optimizer/photographs/camera/marker_board.h"
#include "optimizer/photographs/camera/noise_record.h"
#include "optimizer/photographs/reader/photograph.h"

#include <jansson.h>

struct column_views;
struct job_photograph;
struct job_rows;
struct job_setup;

/* The mean of the dark frames of one exposure time (NaN: not stated). */
struct dark_mean {
    double exposure_s;
    size_t n;
    unsigned orientation;
    struct image image;
};

struct photograph_process {
    bool has_noise;
    struct noise_record noise;
    size_t n_dark;
    struct dark_mean *dark;
    struct lens lens; /* of the rig, as the markers */
    struct marker_board board;
    double lamp_distance_cm;         /* that chart, white reference and scale belong to; NaN: does not matter */
    const struct warning_sink *warn; /* receives doubts about the chart, of the caller; NULL: not wanted */
    bool has_color;                  /* matrix: from the camera's rgb, over its exposure, to radiances */
    double matrix[9];
    double matrix_cov[81];                    /* covariance of its elements */
    struct photograph_info color_info;        /* of the photograph of the chart or of the white reference */
    struct exposure_reference color_exposure; /* of the same */
    struct color_chart chart;                 /* with has_color and the document's has_chart */
    struct image chart_picture;               /* color_chart_picture; no pixels without a chart */
    /* The views of the job, of the caller, whose exposures are compared when a view needs ratios of others; NULL: none.
     * carry: owned. */
    const struct job_rows *rows;
    struct exposure_carry *carry;
    struct column_views *columns; /* the photograph of a cylinder that was read last; owned; NULL: none is kept */
    /* The list that the ledger of every file that is read is appended to (base/files/file_ledger_json.h), of the
     * caller; NULL: not wanted. */
    json_t *files;
};

void photograph_process_init(struct photograph_process *k);
void photograph_process_release(struct photograph_process *k);
/* The exposure that the values of a job's photographs are relative to: of chart or white reference, else of `first`. */
struct exposure_reference photograph_process_reference(const struct photograph_process *k,
                                                       const struct photograph_record *first);
/* Reads the dark frames that the document names; they are in `folder`. Errors have the option in err->field. */
status photograph_process_load_dark(struct photograph_process *k, const struct job_setup *setup,
                                    const struct job_rows *rows, const char *folder, struct error *err);
/* Subtracts the dark frame of the same exposure time from a crop of p. STATUS_INVALID: none has it, or another size. */
status photograph_process_subtract_dark(const struct photograph_process *k, const struct job_photograph *p,
                                        const char *name, const struct photograph_record *r, struct image *im,
                                        struct error *err);
/* Returns whether two exposure times are equal within 1 %, or both unknown. */
bool exposure_times_equal(double a_s, double b_s);

#endif
