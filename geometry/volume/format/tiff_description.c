#include "geometry/volume/format/tiff_description.h"

#include <stdint.h>
#include <stdlib.h>

size_t tiff_description_images(const struct tiff_description *d)
{
    size_t n = 1;
    for (int i = 0; i < TIFF_DIMENSIONS; i++)
        if (__builtin_mul_overflow(n, d->n[i], &n)) return 0;
    return n;
}

size_t tiff_description_image(const struct tiff_description *d, const size_t index[TIFF_DIMENSIONS])
{
    size_t place = 0;
    for (int i = TIFF_DIMENSIONS - 1; i >= 0; i--) place = place * d->n[d->order[i]] + index[d->order[i]];
    return place;
}

size_t tiff_description_page(const struct tiff_description *d, const size_t index[TIFF_DIMENSIONS])
{
    const size_t image = tiff_description_image(d, index);
    if (d->n_block == 0) return image;
    size_t low = 0, high = d->n_block; /* of the blocks that begin at this image or before */
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        *(d->block[middle].image <= image ? &low : &high) = middle;
    }
    const struct tiff_block *b = &d->block[low];
    return image >= b->image && image - b->image < b->n_page ? b->page + (image - b->image) : SIZE_MAX;
}

void tiff_description_release(struct tiff_description *d)
{
    free(d->block);
    *d = (struct tiff_description){0};
}
