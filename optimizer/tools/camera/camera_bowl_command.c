/* `selvedge bowl`: the table of a fiber's profile from the photographs of a bowl that a job document describes. */
#include "base/files/durable.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/photographs/profile/bowl_profile.h"
#include "optimizer/tools/camera/camera_commands.h"

#include <stdio.h>
#include <stdlib.h>

static void print_record(const struct job_bowl *bowl, const struct bowl_record *r)
{
    printf("camera at (%.5g, %.5g, %.5g) mm, focal length %.5g pixels; marks are off by %.2g pixels\n",
           r->camera.position_mm[0], r->camera.position_mm[1], r->camera.position_mm[2], r->camera.focal_px,
           r->camera.rms_px);
    for (size_t i = 0; i < r->n_shot; i++) {
        const struct bowl_shot *s = &r->shot[i];
        printf("%s\n  %zu pixels of the bowl, %zu of them saturated; %zu cells\n"
               "  mean %.4g, of which background %.4g, light from the bowl to itself %.4g\n",
               bowl->photograph[i].picture.file, s->n_pixel, s->n_saturated, s->n_cell, s->mean, s->background,
               s->reflected);
    }
}

static status write_table(const struct fiber_profile *profile, const char *path, struct error *err)
{
    char *text = NULL;
    size_t n = 0;
    FILE *out = open_memstream(&text, &n);
    if (out == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the profile: out of memory");
    fiber_profile_print(profile, out);
    fclose(out);
    status s = durable_replace(path, text, n, err);
    free(text);
    return s;
}

static status make(const char *path, const char *table, const char *picture, struct error *err)
{
    struct camera_job job;
    struct fiber_profile profile = {0};
    struct bowl_record record;
    struct image im = {0};
    status s = camera_job_read(path, &job, err);
    if (s == STATUS_OK && !job.profile->bowl.given)
        s = error_set(err, STATUS_INVALID, "'%s' describes no photographs of a bowl", path);
    if (s == STATUS_OK && picture != NULL)
        s = bowl_profile_picture(&job.profile->bowl, job.setup, job.rows, job.folder, &im, err);
    if (s == STATUS_OK && picture != NULL) s = image_write_png(&im, 1.0, picture, err);
    image_release(&im);
    if (s == STATUS_OK)
        s = bowl_profile_load(&profile, &job.profile->bowl, job.setup, job.rows, job.folder, &record, err);
    if (s == STATUS_OK) s = write_table(&profile, table, err);
    if (s == STATUS_OK) print_record(&job.profile->bowl, &record);
    fiber_profile_release(&profile);
    camera_job_release(&job);
    return s;
}

int camera_command_bowl(int argc, char **argv)
{
    enum { JOB, OUT, PICTURE, N_OPTION };
    struct camera_option o[N_OPTION] = {
        [JOB] = {"", 1, 1, NULL, 0}, [OUT] = {"out", 1, 1, NULL, 0}, [PICTURE] = {"picture", 0, 1, NULL, 0}};
    struct error err = {0};
    if (camera_options_parse(argc, argv, o, N_OPTION, &err) != STATUS_OK) {
        fprintf(stderr, "error: %s; `selvedge bowl --help` lists the options\n", err.text);
        return 2;
    }
    if (make(o[JOB].word[0], o[OUT].word[0], o[PICTURE].n > 0 ? o[PICTURE].word[0] : NULL, &err) == STATUS_OK) return 0;
    fprintf(stderr, "error: %s\n", err.text);
    return 1;
}
