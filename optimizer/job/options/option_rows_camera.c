/* Rows of the option table: from the colors of a camera to radiances. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/document/picture_words.h"
#include "optimizer/job/options/option_rows.h"

const char *const job_transfer_names[] = {
    [JOB_TRANSFER_UNDECLARED] = "undeclared", [JOB_TRANSFER_LINEAR] = "linear", [JOB_TRANSFER_SRGB] = "srgb", NULL};

static const char *const chart_edition[] = {"before_2014", "from_2014", NULL};
#define INTO_CHART(member) INTO(setup, chart.member)
#define INTO_WHITE(member) INTO(setup, white.member)

const struct job_option option_rows_camera[] = {
    {.path = "color",
     .kind = OPTION_SECTION,
     INTO(setup, has_color),
     .check = job_check_color,
     .left_out = "pixel values times `scale` are radiances",
     .meaning = "From the colors of the camera to radiances: a photograph of a ColorChecker, or of a white reference, "
                "taken with the camera and the lamp of the job. `scale` of a photograph then stays 1."},
    {.path = "color.chart",
     .kind = OPTION_SECTION,
     INTO(setup, has_chart),
     .left_out = "this or `white`",
     .meaning =
         "A ColorChecker Classic of 24 patches that lies flat in the place of the cloth. A 3 x 3 matrix is fitted "
         "to it, together with the fall of the lamp's light over it."},
    {.path = "color.chart.file",
     .kind = OPTION_FILE_NAME,
     .id = OPTION_COLOR_CHART,
     INTO(setup, chart.file),
     .required = true,
     .allowed = "as `photographs[].file`",
     .meaning = "The picture. Upload it with the role `chart`."},
    PICTURE("color.chart", INTO_CHART, job_transfer_names),
    {.path = "color.chart.edition",
     .kind = OPTION_SWITCH,
     INTO(setup, chart_from_2014),
     .choice = chart_edition,
     .meaning =
         "When the chart was made: before November 2014, or then and later (X-Rite changed its colors; the year is "
         "on its back). The white patches differ by 4 %, and so does the scale."},
    {.path = "color.chart.reference",
     .kind = OPTION_FILE_NAME,
     .id = OPTION_CHART_REFERENCE,
     INTO(setup, chart_reference_file),
     .left_out = "the colors of `edition`",
     .allowed = "`.csv`: columns L, a, b or X, Y, Z (D50), 24 rows",
     .meaning = "Colors of another chart's patches, row by row. Role: `measurements`."},
    {.path = "color.chart.light_theta_deg",
     .kind = OPTION_NUMBER,
     INTO(setup, chart.light_theta_deg),
     RANGE(0, 89),
     .unit = "degrees",
     .standard = "0",
     .meaning = "Angle of the lamp from the normal of the chart. 0 also for a chart that faces the lamp."},
    {.path = "color.chart.corners_px",
     .kind = OPTION_NUMBERS,
     NUMBERS_INTO(setup, chart_corner_px),
     RANGE(-1e6, 1e6),
     .unit = "pixels",
     .left_out = "found in the picture",
     .allowed = "x, y of four points",
     .meaning = "Outer corners of the corner patches, in this order: dark skin, bluish green, black, white (the first "
                "patch, then around the chart along its rows)."},
    {.path = "color.chart.cloth_px",
     .kind = OPTION_NUMBERS,
     NUMBERS_INTO(setup, chart_cloth_px),
     RANGE(-1e6, 1e6),
     .unit = "pixels",
     .left_out = "the middle of the chart",
     .allowed = "x, y",
     .meaning = "Where the cloth lies in this picture; the scale holds there."},
    {.path = "color.white",
     .kind = OPTION_SECTION,
     INTO(setup, has_white),
     .left_out = "this or `chart`",
     .meaning = "A white reference that lies in the place of the cloth. Each channel gets the factor that makes it as "
                "bright as it is."},
    {.path = "color.white.file",
     .kind = OPTION_FILE_NAME,
     .id = OPTION_COLOR_WHITE,
     INTO(setup, white.file),
     .required = true,
     .allowed = "as `photographs[].file`",
     .meaning = "The picture. Upload it with the role `white_reference`."},
    PICTURE("color.white", INTO_WHITE, job_transfer_names),
    {.path = "color.white.crop_px",
     .kind = OPTION_COUNTS,
     NUMBERS_INTO(setup, white.crop_px),
     RANGE(0, 1 << 20),
     .check = job_check_crop_px,
     .unit = "pixels",
     .left_out = "whole picture",
     .allowed = "x0, y0, x1, y1",
     .meaning = "The part of the picture that shows the reference."},
    {.path = "color.white.light_theta_deg",
     .kind = OPTION_NUMBER,
     INTO(setup, white.light_theta_deg),
     RANGE(0, 89),
     .unit = "degrees",
     .standard = "0",
     .meaning = "Angle of the lamp from the normal of the reference. 0 also for a reference that faces the lamp."},
    {.path = "color.white.reflectance",
     .kind = OPTION_NUMBER_OR_LIST,
     NUMBERS_INTO(setup, white_reflectance),
     RANGE(0.01, 2),
     .standard = "0.99",
     .allowed = "one number, or red, green, blue; 0.01..2",
     .meaning = "Reflectance of the reference for the angles of the photograph: 0.99 for sintered PTFE."},
    {.path = NULL},
};
