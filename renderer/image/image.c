#include "renderer/image/image.h"

#include <stdlib.h>
#include <string.h>

static const char *const rgb_name[3] = {"R", "G", "B"};

status image_init(struct image *im, size_t width, size_t height, size_t n_channel, struct error *err)
{
    memset(im, 0, sizeof *im);
    size_t n_pixel, n;
    if (width == 0 || height == 0 || n_channel == 0)
        return error_set(err, STATUS_INVALID, "cannot make an image of %zu x %zu pixels with %zu channels", width,
                         height, n_channel);
    if (__builtin_mul_overflow(width, height, &n_pixel) || __builtin_mul_overflow(n_pixel, n_channel, &n) ||
        n > SIZE_MAX / sizeof(float))
        return error_set(err, STATUS_TOO_LARGE, "cannot make an image of %zu x %zu pixels with %zu channels", width,
                         height, n_channel);
    im->pixel = calloc(n, sizeof *im->pixel);
    if (im->pixel == NULL)
        return error_set(err, STATUS_NO_MEMORY, "no memory for an image of %zu x %zu pixels with %zu channels", width,
                         height, n_channel);
    im->width = width;
    im->height = height;
    im->n_channel = n_channel;
    if (n_channel == 3) im->channel_name = rgb_name;
    return STATUS_OK;
}

void image_release(struct image *im)
{
    free(im->pixel);
    free(im->name_storage);
    memset(im, 0, sizeof *im);
}
