/* An environment given as an image in latitude and longitude, sampled in proportion to luminance.
 *
 * World frame of configuration.h: row 0 is at +z (the cloth normal), the last row at -z; the first column begins at
 * phi = 0 and phi grows to the right. The radiance is constant over the solid angle of a pixel, so the density of
 * samples is exactly proportional to the luminance. Immutable: shared by threads.
 */
#ifndef SELVEDGE_RENDERER_ENVIRONMENT_H
#define SELVEDGE_RENDERER_ENVIRONMENT_H

#include "base/ranks/byte_pack.h"
#include "renderer/image/image.h"

#include <stdbool.h>
#include <stdint.h>

struct environment;

/* Radiance = first three channels of the image * scale. STATUS_INVALID for a value that is negative or not finite, for
 * a scale that is not positive, for more than 2^26 pixels; STATUS_NO_MEMORY. im may be released afterwards. */
status environment_new(const struct image *im, double scale, struct environment **environment, struct error *err);
/* From an OpenEXR file; also STATUS_FORMAT and the errors of image_read_exr. */
status environment_read_exr(const char *path, double scale, struct environment **environment, struct error *err);
void environment_free(struct environment *environment);
/* A number that no other environment of this process has had. */
uint64_t environment_number(const struct environment *environment);
/* An environment as bytes, and the same environment made of them by another process. STATUS_FORMAT,
 * STATUS_NO_MEMORY. */
void environment_pack(const struct environment *environment, struct byte_pack *pack);
status environment_unpack(struct byte_view *view, struct environment **environment, struct error *err);

/* Radiance along a unit direction (from the scene outwards), and the density with which environment_sample would have
 * chosen it. */
float environment_at(const struct environment *environment, const float direction_world[3], float radiance[3]);
/* A direction drawn in proportion to luminance. False when the whole image is black. */
bool environment_sample(const struct environment *environment, const float u[2], float direction_world[3],
                        float radiance[3], float *pdf_per_sr);

#endif
