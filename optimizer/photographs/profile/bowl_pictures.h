/* The files of a bowl: its photographs one by one with their backgrounds, the mask, and the properties of the
 * camera. */
#ifndef SELVEDGE_OPTIMIZER_BOWL_PICTURES_H
#define SELVEDGE_OPTIMIZER_BOWL_PICTURES_H

#include "base/option_id.h"
#include "optimizer/photographs/camera/photograph_develop.h"
#include "optimizer/photographs/profile/bowl_camera.h"
#include "optimizer/photographs/profile/bowl_place.h"

struct job_bowl;
struct job_rows;
struct job_setup;

struct bowl_pictures {
    const struct job_bowl *bowl;
    const char *folder;
    struct photograph_process process;
    struct bowl_camera camera;
    size_t width, height;                /* 0 before the first photograph */
    struct image mask;                   /* no pixels without one */
    struct image photograph, background; /* of the last call of open; no pixels without a background */
    double saturated;                    /* value from which on a sample of the photograph is */
};

/* Reads the properties of the camera: noise, dark frames, and the lens of the rig. Release after an error, too. */
status bowl_pictures_init(struct bowl_pictures *p, const struct job_bowl *bowl, struct job_setup *setup,
                          struct job_rows *rows, const char *folder, struct error *err);
void bowl_pictures_release(struct bowl_pictures *p);
/* Develops photograph i and its background; with the first one also the mask and the camera's place. */
status bowl_pictures_open(struct bowl_pictures *p, size_t i, struct error *err);
/* Writes the place that pixel k sees; false where it does not see the bowl or the mask hides it. */
bool bowl_pictures_place(const struct bowl_pictures *p, size_t k, struct bowl_place *place);
/* Writes the value of pixel k in the photograph and in the background (0 without one). False where one of them is
 * saturated. */
bool bowl_pictures_value(const struct bowl_pictures *p, size_t k, double value[3], double background[3]);

/* Sets and returns STATUS_INVALID with the field of photograph i. */
#define bowl_pictures_error(i, err, ...)                                                                               \
    bowl_pictures_name_field((i), error_set((err), STATUS_INVALID, __VA_ARGS__), (err))
status bowl_pictures_name_field(size_t i, status s, struct error *err);

#endif
