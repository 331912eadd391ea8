/* The command "camera". */
#include "optimizer/tools/phantom/phantom_commands.h"
#include "optimizer/tools/simulated_camera/simulated_camera.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char usage[] =
    "selvedge-phantom camera --photographs DIR --out DIR [options]\n"
    "\n"
    "Takes rendered photographs (selvedge-phantom photograph, with a crop larger than the job's) with a simulated\n"
    "camera: raw files of three exposures of each view, with noise, wrong white balance, vignetting and distortion,\n"
    "and markers around the sample; a color chart, dark and flat frames, the rig file, and what a job says of them.\n"
    "\n"
    "  --photographs DIR       with photographs.json, truth.json and the renderings\n"
    "  --out DIR               created when it does not exist\n"
    "  --size-px W,H           of the pictures as they are read; the mosaic has twice as many         [480,416]\n"
    "  --px-per-mm P           resolution at the orbit center                                         [4.8]\n"
    "  --crop-cm C             crop of the job                                                        [1]\n"
    "  --exposures T,T,T       exposure times in seconds, rising                                      "
    "[0.02,0.16,1.28]\n"
    "  --exposure-error E      true times are longer by the share E for the first and third time, shorter for the "
    "second [0]\n"
    "  --chart-fall F          the lamp gives the share F less light at one end of the chart                [0]\n"
    "  --chart-fall-phi D      direction from the dark end to the bright one, in degrees                    [30]\n"
    "  --aim-mm A              the camera looks past the orbit center by up to this                   [1.5]\n"
    "  --noise-times F         read noise times F, shot noise times F squared; 0: none                [1]\n"
    "  --cameras-from-markers  the rig file does not say where the camera was\n"
    "  --seed N                of noise and aims                                                      [1]\n"
    "  --threads N             0: one for each processor                                              [0]\n"
    "\n"
    "Exit codes: 0 done, 1 failed, 2 wrong arguments.\n";

static status parse(int argc, char **argv, struct simulated_camera_option *o, size_t *n_thread, struct error *err)
{
    double noise = 1.0;
    simulated_camera_option_default(o);
    const struct command_option option[] = {
        {.name = "photographs", .kind = OPTION_TEXT, .to = &o->source},
        {.name = "out", .kind = OPTION_TEXT, .to = &o->folder},
        {.name = "size-px", .kind = OPTION_COUNT, .to = o->size_px, .n = 2},
        {.name = "px-per-mm", .kind = OPTION_NUMBER, .to = &o->px_per_mm},
        {.name = "crop-cm", .kind = OPTION_NUMBER, .to = &o->crop_cm},
        {.name = "exposures", .kind = OPTION_NUMBER_LIST, .to = o->exposure_s, .n = SIMULATED_EXPOSURES},
        {.name = "exposure-error", .kind = OPTION_NUMBER, .to = &o->exposure_error},
        {.name = "chart-fall", .kind = OPTION_NUMBER, .to = &o->chart_fall},
        {.name = "chart-fall-phi", .kind = OPTION_NUMBER, .to = &o->chart_fall_phi_deg},
        {.name = "aim-mm", .kind = OPTION_NUMBER, .to = &o->aim_mm},
        {.name = "noise-times", .kind = OPTION_NUMBER, .to = &noise},
        {.name = "cameras-from-markers", .kind = OPTION_FLAG, .to = &o->cameras_from_markers},
        {.name = "seed", .kind = OPTION_U64, .to = &o->seed},
        {.name = "threads", .kind = OPTION_COUNT, .to = n_thread},
    };
    status s = command_options_parse(argc, argv, option, sizeof option / sizeof *option, err);
    if (s != STATUS_OK) return s;
    if (o->source == NULL || o->folder == NULL)
        return error_set(err, STATUS_INVALID, "--photographs and --out are needed");
    if (!(o->px_per_mm > 0.0 && o->crop_cm > 0.0 && o->exposure_s[0] > 0.0 && o->aim_mm >= 0.0 && noise >= 0.0))
        return error_set(err, STATUS_INVALID, "lengths, times and the resolution must be positive");
    if (!(fabs(o->exposure_error) < 0.5 && fabs(o->chart_fall) < 0.9))
        return error_set(err, STATUS_INVALID, "--exposure-error is below 0.5, --chart-fall below 0.9");
    o->sensor.read_sd *= noise;
    o->sensor.dark_var_dn *= noise * noise;
    o->sensor.shot_var *= noise * noise;
    return STATUS_OK;
}

int phantom_command_camera(int argc, char **argv)
{
    struct simulated_camera_option o;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    size_t n_thread = 0;
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "--help") == 0) {
            fputs(usage, stdout);
            return 0;
        }
    if (parse(argc, argv, &o, &n_thread, &err) != STATUS_OK) {
        fprintf(stderr, "selvedge-phantom camera: %s\n", err.text);
        return 2;
    }
    status s = thread_pool_new(n_thread, &pool, &err);
    if (s == STATUS_OK) s = simulated_camera_make(&o, pool, &err);
    if (s != STATUS_OK) fprintf(stderr, "selvedge-phantom camera: %s\n", err.text);
    thread_pool_free(pool);
    return s == STATUS_OK ? 0 : 1;
}
