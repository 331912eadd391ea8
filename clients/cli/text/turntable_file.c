#include "clients/cli/text/turntable_file.h"
#include "base/files/durable.h"

#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <webp/encode.h>
#include <webp/mux.h>

static const float quality = 85.0f;

/* Reads a PNG file as rgb bytes; the caller frees *rgb. */
static status read_frame(const char *path, int *width, int *height, uint8_t **rgb, struct error *err)
{
    png_image im = {.version = PNG_IMAGE_VERSION};
    *rgb = NULL;
    if (!png_image_begin_read_from_file(&im, path))
        return error_set(err, STATUS_FORMAT, "cannot read the picture '%s': %s", path, im.message);
    im.format = PNG_FORMAT_RGB;
    *rgb = malloc(PNG_IMAGE_SIZE(im));
    if (*rgb == NULL) {
        png_image_free(&im);
        return error_set(err, STATUS_NO_MEMORY, "cannot read the picture '%s': out of memory", path);
    }
    if (!png_image_finish_read(&im, NULL, *rgb, 0, NULL))
        return error_set(err, STATUS_FORMAT, "cannot read the picture '%s': %s", path, im.message);
    *width = (int)im.width;
    *height = (int)im.height;
    return STATUS_OK;
}

/* Adds a frame; the first one makes the encoder. */
static status add_frame(WebPAnimEncoder **encoder, const char *path, int at_ms, struct error *err)
{
    WebPConfig config;
    WebPPicture picture;
    WebPAnimEncoderOptions option;
    uint8_t *rgb;
    int width = 0, height = 0;
    status s = read_frame(path, &width, &height, &rgb, err);
    if (s == STATUS_OK &&
        (!WebPConfigInit(&config) || !WebPPictureInit(&picture) || !WebPAnimEncoderOptionsInit(&option)))
        s = error_set(err, STATUS_UNSUPPORTED, "cannot write WebP: another libwebp is installed than was built with");
    if (s == STATUS_OK) {
        config.quality = quality;
        picture.width = width;
        picture.height = height;
        picture.use_argb = 1;
        option.anim_params.loop_count = 0;
        if (*encoder == NULL) *encoder = WebPAnimEncoderNew(width, height, &option);
        if (*encoder == NULL || !WebPPictureImportRGB(&picture, rgb, 3 * width))
            s = error_set(err, STATUS_NO_MEMORY, "cannot add '%s' to the turntable: out of memory", path);
        else if (!WebPAnimEncoderAdd(*encoder, &picture, at_ms, &config))
            s = error_set(err, STATUS_FORMAT, "cannot add '%s' to the turntable: %s", path,
                          WebPAnimEncoderGetError(*encoder));
        WebPPictureFree(&picture);
    }
    free(rgb);
    return s;
}

status turntable_file_write(const char *folder, size_t n, int frame_ms, const char *path, size_t *n_byte,
                            struct error *err)
{
    WebPAnimEncoder *encoder = NULL;
    WebPData data;
    status s = STATUS_OK;
    WebPDataInit(&data);
    for (size_t i = 0; s == STATUS_OK && i < n; i++) {
        char frame[4200];
        snprintf(frame, sizeof frame, "%s/on-%zu.png", folder, i + 1);
        s = add_frame(&encoder, frame, (int)i * frame_ms, err);
    }
    if (s == STATUS_OK &&
        (!WebPAnimEncoderAdd(encoder, NULL, (int)n * frame_ms, NULL) || !WebPAnimEncoderAssemble(encoder, &data)))
        s = error_set(err, STATUS_NO_MEMORY, "cannot write '%s': %s", path,
                      encoder != NULL ? WebPAnimEncoderGetError(encoder) : "it has no pictures");
    if (s == STATUS_OK) s = durable_replace(path, data.bytes, data.size, err);
    *n_byte = data.size;
    WebPDataClear(&data);
    WebPAnimEncoderDelete(encoder);
    return s;
}
