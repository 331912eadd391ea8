/* Inside the option table: its parts, and macros that rows share. */
#ifndef SELVEDGE_OPTIMIZER_OPTION_ROWS_H
#define SELVEDGE_OPTIMIZER_OPTION_ROWS_H

#include "optimizer/job/checks/option_checks.h"
#include "optimizer/job/document/job_limits.h"
#include "optimizer/job/options/option_row.h"

/* Each ends with a row without a path. */
extern const struct job_option option_rows_cloth[], option_rows_described[], option_rows_setup[], option_rows_camera[],
    option_rows_fit[], option_rows_pictures[], option_rows_profile[];

/* Words of enum job_transfer. */
extern const char *const job_transfer_names[];

#define INTO_OF(type, member) .stored = true, .at = offsetof(type, member)
#define TEXT_INTO_OF(type, member) INTO_OF(type, member), .n = sizeof((type *)NULL)->member
#define NUMBERS_INTO_OF(type, member)                                                                                  \
    INTO_OF(type, member), .n = sizeof((type *)NULL)->member / sizeof((type *)NULL)->member[0]
/* Targets in a section of the job document, as INTO(scan, crop_keep). */
#define OF_SECTION(name) .section = JOB_SECTION_##name
#define INTO(name, member) OF_SECTION(name), INTO_OF(struct job_##name, member)
#define TEXT_INTO(name, member) OF_SECTION(name), TEXT_INTO_OF(struct job_##name, member)
#define NUMBERS_INTO(name, member) OF_SECTION(name), NUMBERS_INTO_OF(struct job_##name, member)
#define LIST_INTO(name, pointer, n_member)                                                                             \
    INTO(name, pointer), .count_at = offsetof(struct job_##name, n_member),                                            \
                         .element_bytes = sizeof *((struct job_##name *)NULL)->pointer

#define RANGE(from, to) .lower = (from), .upper = (to)

/* Rows for values that a picture file may not state itself: members of the struct job_photograph that offset_of
 * gives. */
#define PICTURE(list, offset_of, transfers)                                                                            \
    {.path = list ".transfer",                                                                                         \
     .kind = OPTION_CHOICE,                                                                                            \
     offset_of(transfer),                                                                                              \
     .choice = transfers,                                                                                              \
     .meaning = "How the values of a PNG, a JPEG or an integer TIFF stand for light: `srgb` as a camera or phone "     \
                "saves them, `linear` when they were developed without tone curve. Such a picture is refused "         \
                "without it. OpenEXR, float TIFF and camera raw are linear."},                                         \
        {.path = list ".exposure_s",                                                                                   \
         .kind = OPTION_NUMBER,                                                                                        \
         offset_of(exposure_s),                                                                                        \
         RANGE(1e-9, 1e6),                                                                                             \
         .unit = "s",                                                                                                  \
         .left_out = "from the file",                                                                                  \
         .meaning = "Exposure time. Pixel values are divided by it; then all photographs need one."},                  \
        {.path = list ".iso",                                                                                          \
         .kind = OPTION_NUMBER,                                                                                        \
         offset_of(iso),                                                                                               \
         RANGE(1, 1e8),                                                                                                \
         .left_out = "from the file",                                                                                  \
         .meaning = "Sensitivity. Pixel values are divided by ISO / 100; then all photographs need one."},             \
        {.path = list ".aperture",                                                                                     \
         .kind = OPTION_NUMBER,                                                                                        \
         offset_of(aperture),                                                                                          \
         RANGE(0.1, 1000),                                                                                             \
         .left_out = "from the file",                                                                                  \
         .meaning = "The f-number N. Pixel values are multiplied by its square; then all photographs need one."},      \
    {                                                                                                                  \
        .path = list ".black_level", .kind = OPTION_NUMBER, offset_of(black_level), RANGE(-1e9, 1e9),                  \
        .unit = "values of the file", .left_out = "that of the raw file, else 0",                                      \
        .meaning = "The value that stands for no light. Not for `srgb`."                                               \
    }

/* Rows of the further exposures of a picture: `pointer` and `count` are members of the struct `type`. */
#define EXPOSURES(list, type, pointer, count, text)                                                                    \
    {.path = list ".more_exposures",                                                                                   \
     .kind = OPTION_LIST,                                                                                              \
     .stored = true,                                                                                                   \
     .at = offsetof(type, pointer),                                                                                    \
     .count_at = offsetof(type, count),                                                                                \
     .element_bytes = sizeof(struct job_exposure),                                                                     \
     .upper = JOB_MAX_MORE_EXPOSURES,                                                                                  \
     .left_out = "none",                                                                                               \
     .items = "exposures",                                                                                             \
     .meaning = text},                                                                                                 \
        {.path = list ".more_exposures[].file",                                                                        \
         .kind = OPTION_FILE_NAME,                                                                                     \
         INTO_OF(struct job_exposure, file),                                                                           \
         .required = true,                                                                                             \
         .allowed = "as `photographs[].file`",                                                                         \
         .meaning = "The picture."},                                                                                   \
    {                                                                                                                  \
        .path = list ".more_exposures[].exposure_s", .kind = OPTION_NUMBER, INTO_OF(struct job_exposure, exposure_s),  \
        RANGE(1e-9, 1e6), .unit = "s", .left_out = "from the file", .meaning = "Its exposure time."                    \
    }

/* Rows of the angles of a photograph or of a candidate: members of the struct `type` in the list `list`. */
#define ANGLE(list, type, name, from, to, ...)                                                                         \
    {                                                                                                                  \
        .path = list "." #name, .kind = OPTION_NUMBER, RANGE(from, to), .unit = "degrees", INTO_OF(type, name),        \
        __VA_ARGS__                                                                                                    \
    }
#define ANGLES(list, type, missing)                                                                                    \
    ANGLE(list, type, light_theta_deg, 0, 180, missing, .check = job_check_light_theta,                                \
          .allowed = "0 to below 90; above 90 to 180 without the black sheet",                                         \
          .meaning = "Angle of the lamp from the normal of the cloth. Above 90 the lamp is behind the cloth."),        \
        OTHER_ANGLES(list, type, missing)
#define OTHER_ANGLES(list, type, missing)                                                                              \
    ANGLE(list, type, light_phi_deg, -360, 360, missing, .meaning = "Azimuth of the lamp, from +x towards +y."),       \
        ANGLE(list, type, camera_theta_deg, 0, 89.999, missing, .allowed = "0 to below 90",                            \
              .meaning = "Angle of the camera from the normal of the cloth."),                                         \
        ANGLE(list, type, camera_phi_deg, -360, 360, missing,                                                          \
              .meaning = "Azimuth of the camera, from +x towards +y."),                                                \
        ANGLE(list, type, cloth_rotation_deg, -360, 360, .standard = "0",                                              \
              .meaning = "Turn of the cloth about its normal, counter-clockwise seen from above, under fixed lamp "    \
                         "and camera.")

#endif
