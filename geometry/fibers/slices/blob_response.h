/* Scale-normalised Laplacian of Gaussian of a picture (Lindeberg 1998), with the sign that makes bright blobs maxima,
 * at those pixels where it is asked for.
 *
 * Kernels are sampled and then corrected to sum 1 (Gaussian), and to sum 0 and second moment 2 (its second
 * derivative), so that scales below a pixel answer alike. The picture is mirrored at its borders. Units are pixels. */
#ifndef SELVEDGE_GEOMETRY_BLOB_RESPONSE_H
#define SELVEDGE_GEOMETRY_BLOB_RESPONSE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* BLOB_BLOCK: pixels in a block of a row, one for each bit of a byte. */
enum { BLOB_BLOCK = 8, BLOB_MAX_REACH = 64 };

static inline size_t blob_n_block(size_t width) { return (width + BLOB_BLOCK - 1) / BLOB_BLOCK; }

/* One half of both kernels, which are symmetric: weights of the pixels at 0 .. reach. */
struct blob_kernel {
    int reach;
    float smooth[BLOB_MAX_REACH + 1], second[BLOB_MAX_REACH + 1];
    float factor; /* of the sum of both derivatives */
};

/* Returns false if sigma is not positive, or too large for BLOB_MAX_REACH. */
bool blob_kernel_init(struct blob_kernel *k, double sigma);

/* A picture of width x height pixels, row-major without padding, and for each block of its rows whether the response is
 * asked for in it: n_block(width) bytes a row, 0 where it is not. */
struct blob_picture {
    const float *image;
    size_t width, height;
    const uint8_t *asked;
};

/* Numbers of scratch memory that a picture of this width needs with kernels of this reach. */
size_t blob_scratch(size_t width, int reach);
/* response: width x height; pixels of blocks that are not asked for are not written. work: scratch memory of a byte
 * for each block of the picture. */
void blob_response(const struct blob_kernel *k, const struct blob_picture *p, float *scratch, uint8_t *work,
                   float *response);

#endif
