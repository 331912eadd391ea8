/* The commands of the program selvedge-camera, which `selvedge photo`, `selvedge bowl` and
 * `selvedge calibrate-camera` run. A command
 * writes to stdout and stderr and returns the exit code: 0 done, 1 failed, 2 wrong arguments. */
#ifndef SELVEDGE_OPTIMIZER_CAMERA_COMMANDS_H
#define SELVEDGE_OPTIMIZER_CAMERA_COMMANDS_H

#include "base/status.h"
#include "optimizer/job/document/job_photograph.h"
#include "renderer/image/image.h"

struct job_document;
struct job_profile;
struct job_rows;
struct job_setup;

int camera_command_photo(int argc, char **argv);
int camera_command_calibrate(int argc, char **argv);
int camera_command_bowl(int argc, char **argv);

/* An option of a command: --name followed by words up to the next option. */
struct camera_option {
    const char *name; /* "" takes the words before the first option */
    size_t least, most;
    const char *const *word; /* filled in: points into argv */
    size_t n;
};

/* STATUS_INVALID with a text for the user. */
status camera_options_parse(int argc, char **argv, struct camera_option *option, size_t n_option, struct error *err);
/* A positive number; NaN for an option that is not given. */
status camera_option_number(const struct camera_option *o, double *out, struct error *err);
/* undeclared, linear or srgb. */
status camera_option_transfer(const struct camera_option *o, unsigned *transfer, struct error *err);

/* A job whose photographs a command looks at. */
struct camera_job {
    char folder[4096];        /* of the document and its files */
    struct job_document *doc; /* owns the sections; NULL: none was read */
    struct job_setup *setup;  /* the rig and the photographs complete the set-up and the rows */
    struct job_rows *rows;
    const struct job_profile *profile;
};

/* The caller releases the job, also after an error. */
status camera_job_read(const char *path, struct camera_job *job, struct error *err);
void camera_job_release(struct camera_job *job);

/* Draws the outline of the crop (all 0: the whole picture) into the picture, and writes it as PNG whose white is the
 * 99th percentile of the values. STATUS_IO as image_write_png. */
status camera_write_picture(struct image *im, const size_t crop_px[4], const char *out, struct error *err);
/* The same with the outlines of the n columns of a photograph of a cylinder. */
status camera_write_columns(struct image *im, const struct job_photograph *column, size_t n, const char *out,
                            struct error *err);

#endif
