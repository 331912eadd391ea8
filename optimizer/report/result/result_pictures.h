/* Pictures and geometry files under results/. Each file is written under a temporary name and then renamed, so that
 * it is never incomplete. A file that an earlier attempt has written is kept. */
#ifndef SELVEDGE_OPTIMIZER_RESULT_PICTURES_H
#define SELVEDGE_OPTIMIZER_RESULT_PICTURES_H

#include "optimizer/report/findings/report.h"
#include "renderer/transport/radiance_request.h"

/* fibers.hair, fibers.txt; with a volume also density.vol (uint8), direction.vol (2-byte directions) and
 * pictures/slice-{x,y,z}.png. */
status result_geometry_write(struct report *report, struct error *err);
/* pictures/slice-{x,y,z}.png and the job's thumbnail: the middle slices, with traced fibers in red. */
status result_slices_write(const struct report *report, const struct volume *volume, const struct fiber_set *traced,
                           struct error *err);
/* photographs/<name>.exr and .png, and pictures/color-chart.png. Photographs that are there stay as they are. */
status result_photographs_write(const struct report *report, struct error *err);
/* pictures/<name>.png: 3 bytes a pixel, row 0 at the top. */
status result_picture_write(const struct report *report, const char *name, const uint8_t *rgb, size_t width,
                            size_t height, struct error *err);
/* Writes RESULTS/<folder>/<name>.exr. Errors of image_write_exr. */
status result_exr_write(const struct report *report, const struct image *im, const char *folder, const char *name,
                        struct error *err);
/* <folder>/<name>.png, brighter by exposure, and with `exr` before it <name>.exr. The folder must be there. */
status result_image_write(const struct report *report, const struct image *im, const char *folder, const char *name,
                          double exposure, bool exr, struct error *err);
/* Largest edge of the renderings where the job document states none. */
enum { RESULT_PICTURE_PX = 192 };
/* Edge of the renderings in pixels: the job document's edge, or fewer than RESULT_PICTURE_PX where the best model's fit
 * has taken only n_fit_path. */
size_t result_picture_px(const struct job_results *results, size_t n_row, double n_fit_path);
/* Samples a pixel of the renderings: the job document's number, or as many as the cost of the best model's fit allows,
 * which has taken n_fit_path. */
size_t result_picture_samples(const struct job_results *results, size_t n_row, double n_fit_path);
/* Paths that take as long as all renderings together, after such a fit. */
double result_renderings_paths(const struct job_results *results, size_t n_row, double n_fit_path);
/* The best model of the job's cloth at its result, as a source of radiance. */
struct radiance_input result_radiance_input(const struct report *report);
/* renderings/<name>.exr and .png for every photograph, after the photographs. Of surface models with two samples or
 * more, the PNG and the layer `filtered` of the EXR are a filtered view (joint_filter.h). from, to: shares of the stage
 * before and after, between which progress is reported. */
status result_renderings_write(struct report *report, double from, double to, struct error *err);

#endif
