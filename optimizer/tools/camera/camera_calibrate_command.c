#include "optimizer/photographs/camera/noise_calibrate.h"
#include "optimizer/tools/camera/camera_commands.h"

#include <math.h>
#include <stdio.h>

static void print_warning(void *context, const char *option, const char *text)
{
    (void)context, (void)option;
    fprintf(stderr, "warning: %s\n", text);
}

static void print_record(const struct noise_record *r)
{
    static const char *const color[] = {"red", "green", "blue"};
    printf("%s, ISO %g, from %zu dark and %zu flat frames\n", r->camera[0] != '\0' ? r->camera : "camera not stated",
           r->iso, r->n_dark, r->n_flat);
    printf("         read noise DN   dark current DN/s   photons per DN\n");
    for (size_t c = 0; c < 3; c++) {
        const struct noise_channel *k = &r->channel[c];
        printf("%-8s %13.4g   %17.4g   %14.4g\n", color[c], sqrt(k->read_var), k->dark_mean,
               k->shot_var > 0.0 ? 1.0 / k->shot_var : INFINITY);
    }
}

int camera_command_calibrate(int argc, char **argv)
{
    enum { DARK, FLAT, OUT, TRANSFER, EXPOSURE };
    struct camera_option o[] = {[DARK] = {"dark", 2, 256, NULL, 0},
                                [FLAT] = {"flat", 2, 256, NULL, 0},
                                [OUT] = {"out", 1, 1, NULL, 0},
                                [TRANSFER] = {"transfer", 0, 1, NULL, 0},
                                [EXPOSURE] = {"exposure-s", 0, 1, NULL, 0}};
    struct error err = {0};
    unsigned transfer = 0;
    double exposure_s = NAN;
    struct noise_record record;
    status s = camera_options_parse(argc, argv, o, sizeof o / sizeof *o, &err);
    if (s == STATUS_OK) s = camera_option_transfer(&o[TRANSFER], &transfer, &err);
    if (s == STATUS_OK) s = camera_option_number(&o[EXPOSURE], &exposure_s, &err);
    if (s != STATUS_OK) {
        fprintf(stderr, "error: %s; `selvedge calibrate-camera --help` lists the options\n", err.text);
        return 2;
    }
    const struct noise_frames frames = {.dark = o[DARK].word,
                                        .n_dark = o[DARK].n,
                                        .flat = o[FLAT].word,
                                        .n_flat = o[FLAT].n,
                                        .transfer = (enum job_transfer)transfer,
                                        .exposure_s = exposure_s};
    s = noise_calibrate(&frames, &(struct warning_sink){print_warning, NULL}, &record, &err);
    if (s == STATUS_OK) s = noise_record_write(&record, o[OUT].word[0], &err);
    if (s != STATUS_OK) {
        fprintf(stderr, "error: %s\n", err.text);
        return 1;
    }
    print_record(&record);
    return 0;
}
