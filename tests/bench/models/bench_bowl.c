/* The photographs of docs/fiber-bowl.md: a bowl below a fiber like a human hair (fur.v1), by rays (bowl_rays.h), with
 * the job document that describes it.
 *
 * bench_bowl FOLDER [PX]
 *   FOLDER  gets hair.exr, dark.exr and job.json
 *   PX      edge of the photographs (640)
 */
#include "base/angle.h"
#include "tests/support/fiber/bowl_rays.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double radius = 75, height = 73;

static int photograph(const struct bowl_device *d, bool with_fiber, const char *folder, const char *name)
{
    char path[4096];
    struct image im;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (bowl_rays_photograph(d, with_fiber, with_fiber, &im) != STATUS_OK) return 1;
    const status s = image_write_exr(&im, path, NULL);
    image_release(&im);
    return s == STATUS_OK ? 0 : 1;
}

static int write_job(const struct bowl_device *d, const char *folder)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/job.json", folder);
    FILE *out = fopen(path, "w");
    if (out == NULL) return 1;
    fputs("{\"sample\": \"hair\",\n \"profile\": {\"bowl\": {\"radius_mm\": 75, \"height_mm\": 73, \"reflectance\": "
          "0.2,\n"
          "  \"photographs\": [{\"file\": \"hair.exr\", \"background\": \"dark.exr\", \"theta_i_deg\": 20}],\n"
          "  \"marks\": [",
          out);
    for (int i = 0; i < 8; i++) {
        const double z = i % 2 == 0 ? height - radius : -50, r = sqrt(radius * radius - z * z),
                     at[3] = {r * cos(i * M_PI / 4), r * sin(i * M_PI / 4), z};
        double px[2];
        bowl_rays_project(d, at, px);
        fprintf(out, "%s{\"at_mm\": [%.3f, %.3f, %.3f], \"px\": [%.2f, %.2f]}", i > 0 ? ",\n            " : "", at[0],
                at[1], at[2], px[0], px[1]);
    }
    fputs("]}},\n \"fit\": {\"model\": \"fur.v1\"}}\n", out);
    return fclose(out) == 0 ? 0 : 1;
}

int main(int argc, char **argv)
{
    const size_t px = argc > 2 ? strtoul(argv[2], NULL, 10) : 640;
    const struct scattering_model *m = scattering_find("fur.v1");
    struct bowl_device d = {.radius = radius,
                            .height = height,
                            .reflectance = 0.2,
                            .lit_length = 4,
                            .lamp = {sin(20 * RAD_PER_DEG), cos(20 * RAD_PER_DEG), 0},
                            .camera = {20, -30, 600},
                            .look_at = {0, 0, -30},
                            .focal_px = 3.6 * (double)px,
                            .width = px,
                            .picture_height = px,
                            .model = m,
                            .strength = M_PI * radius * radius,
                            .background = 0.001,
                            .noise = 0.0001,
                            .samples = 2};
    double param[SCATTERING_MAX_PARAM];
    struct scattering_state *state = NULL;
    if (argc < 2 || px < 32 || px > 4096) {
        fputs("usage: bench_bowl FOLDER [PX], PX from 32 to 4096\n", stderr);
        return 2;
    }
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
    if (m->prepare(param, &state, NULL) != STATUS_OK) return 1;
    d.state = state;
    const int failed =
        photograph(&d, true, argv[1], "hair.exr") + photograph(&d, false, argv[1], "dark.exr") + write_job(&d, argv[1]);
    m->release(state);
    return failed == 0 ? 0 : 1;
}
