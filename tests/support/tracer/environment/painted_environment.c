#include "tests/support/tracer/environment/painted_environment.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

struct environment *painted_environment(size_t width, size_t height,
                                        void (*paint)(double theta, double phi, float rgb[3]))
{
    struct image im;
    struct environment *e = NULL;
    struct error err = {0};
    status s = image_init(&im, width, height, 3, &err);
    for (size_t i = 0; i < width * height && s == STATUS_OK; i++)
        paint(M_PI * ((double)(i / width) + 0.5) / (double)height,
              2 * M_PI * ((double)(i % width) + 0.5) / (double)width, im.pixel + 3 * i);
    if (s == STATUS_OK) s = environment_new(&im, 1, &e, &err);
    if (s != STATUS_OK) {
        fprintf(stderr, "%s\n", err.text);
        abort();
    }
    image_release(&im);
    return e;
}

void paint_constant(double theta, double phi, float rgb[3])
{
    (void)theta;
    (void)phi;
    rgb[0] = 0.7f;
    rgb[1] = 1;
    rgb[2] = 1.3f;
}

void paint_sky(double theta, double phi, float rgb[3])
{
    float up = theta < M_PI / 2 ? 0.3f : 0.05f;
    bool sun = fabs(theta - 0.7) < 0.11 && fabs(phi - 1.1) < 0.15,
         moon = fabs(theta - 1.2) < 0.2 && fabs(phi - 3.9) < 0.3;
    rgb[0] = up + (sun ? 40.0f : 0) + (moon ? 2.0f : 0);
    rgb[1] = up + (sun ? 35.0f : 0) + (moon ? 3.0f : 0);
    rgb[2] = 2 * up + (sun ? 20.0f : 0) + (moon ? 5.0f : 0);
}
