/* selvedge render ID: a picture of a finished job's cloth on a surface, as a job of its own. */
#include "clients/cli/commands/cli_derive.h"
#include "clients/cli/text/turntable_file.h"

#include <libgen.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A turn: the number of pictures, and for how long each is shown. */
enum { TURN_FRAMES = 24, TURN_FRAME_MS = 250 };

/* *is: whether the text is "yes"; false when the option is left out. */
static status read_yes(const char *option, const char *text, bool *is, struct error *err)
{
    *is = text != NULL && strcmp(text, "yes") == 0;
    if (text == NULL || *is || strcmp(text, "no") == 0) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "option '--%s' takes yes or no: '%s'", option, text);
}

/* "30,180": two angles in degrees. */
static status read_angles(const char *option, const char *text, double fallback_theta, double fallback_phi,
                          json_t *picture, const char *prefix, struct error *err)
{
    double theta = fallback_theta, phi = fallback_phi;
    char key[64], rest;
    if (text != NULL && sscanf(text, "%lf,%lf%c", &theta, &phi, &rest) != 2)
        return error_set(err, STATUS_INVALID, "option '--%s' takes two angles in degrees, such as 45,180: '%s'", option,
                         text);
    snprintf(key, sizeof key, "%s_theta_deg", prefix);
    json_object_set_new(picture, key, json_real(theta));
    snprintf(key, sizeof key, "%s_phi_deg", prefix);
    json_object_set_new(picture, key, json_real(phi));
    return STATUS_OK;
}

static status read_value(const char *option, const char *text, bool whole, json_t *picture, const char *key,
                         struct error *err)
{
    char *end;
    if (text == NULL) return STATUS_OK;
    double value = strtod(text, &end);
    if (end == text || *end != '\0' || !isfinite(value) || (whole && value != floor(value)))
        return error_set(err, STATUS_INVALID, "option '--%s' takes a %snumber: '%s'", option, whole ? "whole " : "",
                         text);
    json_object_set_new(picture, key, whole ? json_integer((json_int_t)value) : json_real(value));
    return STATUS_OK;
}

/* The kinds of picture_options.def: each sets the key of the picture if the option is given. */
static status set_number(const char *option, const char *text, json_t *picture, const char *key, struct error *err)
{
    return read_value(option, text, false, picture, key, err);
}

static status set_whole(const char *option, const char *text, json_t *picture, const char *key, struct error *err)
{
    return read_value(option, text, true, picture, key, err);
}

static status set_text(const char *option, const char *text, json_t *picture, const char *key, struct error *err)
{
    (void)option, (void)err;
    if (text != NULL) json_object_set_new(picture, key, json_string(text));
    return STATUS_OK;
}

static status set_yes(const char *option, const char *text, json_t *picture, const char *key, struct error *err)
{
    bool yes;
    status s = read_yes(option, text, &yes, err);
    if (s == STATUS_OK && text != NULL) json_object_set_new(picture, key, json_boolean(yes));
    return s;
}

static status set_flag(const char *option, bool given, json_t *picture, const char *key, struct error *err)
{
    (void)option, (void)err;
    if (given) json_object_set_new(picture, key, json_true());
    return STATUS_OK;
}

/* Surface, lamp and camera of a measurement. */
static status read_view(const struct cli_args *a, json_t *picture, const char **mesh, struct error *err)
{
    const char *on = a->on != NULL ? a->on : "cylinder";
    bool shape = strcmp(on, "flat") == 0 || strcmp(on, "cylinder") == 0 || strcmp(on, "drape") == 0;
    size_t n = strlen(on);
    *mesh = shape ? NULL : on;
    if (!shape && (n < 5 || strcmp(on + n - 4, ".obj") != 0))
        return error_set(err, STATUS_INVALID, "option '--on' takes flat, cylinder, drape or a mesh NAME.obj: '%s'", on);
    json_object_set_new(picture, "on", json_string(shape ? on : "mesh"));
    status s = read_angles("lamp", a->lamp, 45.0, 0.0, picture, "light", err);
    return s == STATUS_OK ? read_angles("camera", a->camera, 30.0, 180.0, picture, "camera", err) : s;
}

/* The picture that the command line describes; *mesh is the path of its mesh, or NULL. */
static status read_picture(const struct cli_args *a, json_t *picture, const char **mesh, struct error *err)
{
    const char *view = a->on != NULL ? "on" : a->lamp != NULL ? "lamp" : a->camera != NULL ? "camera" : NULL;
    const bool studio = a->turntable || (a->picture.kind != NULL && strcmp(a->picture.kind, "measurement") != 0);
    *mesh = NULL;
    if (a->turntable && a->picture.kind != NULL && strcmp(a->picture.kind, "measurement") == 0)
        return error_set(err, STATUS_INVALID, "option '--turntable' is not for '--kind measurement'");
    if (a->turntable && view != NULL)
        return error_set(err, STATUS_INVALID, "option '--%s' is not for '--turntable', which has a view of its own",
                         view);
    if (studio && view != NULL)
        return error_set(err, STATUS_INVALID, "option '--%s' is not for '--kind %s', which has a view of its own", view,
                         a->picture.kind);
    status s = studio ? STATUS_OK : read_view(a, picture, mesh, err);
#define PICTURE_OPTION(key, name, value, kind, help)                                                                   \
    if (s == STATUS_OK) s = set_##kind(name, a->picture.key, picture, #key, err);
#include "clients/cli/arguments/picture_options.def"
#undef PICTURE_OPTION
    if (a->picture.reference && a->picture.method == NULL) json_object_set_new(picture, "method", json_string("fast"));
    return s;
}

/* The pictures of a turn, from the one that the command line describes. */
static void make_turn(json_t *picture, json_t *wanted)
{
    static const struct {
        const char *key;
        int value;
    } standard[] = {{"px", 360}, {"samples", 6}, {"deep_light_paths", 1000000}};
    json_t *list = json_array();
    if (json_object_get(picture, "kind") == NULL) json_object_set_new(picture, "kind", json_string("drape"));
    for (size_t k = 0; k < sizeof standard / sizeof *standard; k++)
        if (json_object_get(picture, standard[k].key) == NULL)
            json_object_set_new(picture, standard[k].key, json_integer(standard[k].value));
    for (int i = 0; i < TURN_FRAMES; i++) {
        json_t *frame = json_deep_copy(picture);
        json_object_set_new(frame, "cloth_rotation_deg", json_real(360.0 * i / TURN_FRAMES));
        json_array_append_new(list, frame);
    }
    json_object_set_new(wanted, "pictures", list);
}

/* Writes turntable.webp beside the downloaded pictures. */
static status write_turn(struct cli *cli, const char *id, struct error *err)
{
    char folder[4096], frames[4120], path[4120];
    size_t n_byte = 0;
    if (cli->args->out_dir != NULL)
        snprintf(folder, sizeof folder, "%s", cli->args->out_dir);
    else
        snprintf(folder, sizeof folder, "selvedge-%s", id);
    snprintf(frames, sizeof frames, "%s/pictures", folder);
    snprintf(path, sizeof path, "%s/turntable.webp", folder);
    status s = turntable_file_write(frames, TURN_FRAMES, TURN_FRAME_MS, path, &n_byte, err);
    if (s == STATUS_OK)
        fprintf(cli->out, "turntable.webp: %d pictures of a turn in %g s, %zu bytes\n", TURN_FRAMES,
                1e-3 * TURN_FRAMES * TURN_FRAME_MS, n_byte);
    return s;
}

static double number_at(const json_t *list, size_t i)
{
    const json_t *x = json_array_get(list, i);
    return json_is_number(x) ? json_number_value(x) : NAN;
}

/* Prints the comparison of the picture with the same picture by path tracing. */
static void print_comparison(FILE *out, const json_t *picture)
{
    const json_t *r = json_object_get(picture, "reference"), *mean = json_object_get(r, "mean_difference"),
                 *se = json_object_get(r, "mean_difference_se"), *rms = json_object_get(r, "field_difference_rms"),
                 *noise = json_object_get(r, "field_noise");
    if (r == NULL) {
        fputs("no comparison: the picture was rendered path by path, as this model has no tables\n", out);
        return;
    }
    static const char *const channel[] = {"red", "green", "blue"};
    for (size_t k = 0; k < 3; k++)
        fprintf(out, "mean radiance in %s: %+.2f %% of path tracing's brightness, standard error %.2f %%\n", channel[k],
                100.0 * number_at(mean, k), 100.0 * number_at(se, k));
    fprintf(out, "fields of 4 x 4 pixels: %.2f %% root mean square apart beyond a noise of %.2f %%\n",
            100.0 * (json_is_number(rms) ? json_number_value(rms) : NAN),
            100.0 * (json_is_number(noise) ? json_number_value(noise) : NAN));
}

/* One line of the picture, and the comparison. */
static status describe(struct cli *cli, const char *id, struct error *err)
{
    char path[256];
    json_t *job = NULL;
    status s = cli_job_path(id, "", path, sizeof path, err);
    if (s == STATUS_OK) s = http_json(cli->http, "GET", path, NULL, NULL, &job, err);
    if (s == STATUS_OK) s = cli_add_result(cli, job, err);
    const json_t *picture = json_array_get(json_object_get(json_object_get(job, "result"), "pictures"), 0);
    const json_t *mean = json_object_get(picture, "mean"), *noise = json_object_get(picture, "noise");
    if (s == STATUS_OK && picture != NULL) {
        fprintf(cli->out, "pictures/on-1.png: mean radiance %.4g %.4g %.4g, noise of a pixel %.0f %% of their mean\n",
                number_at(mean, 0), number_at(mean, 1), number_at(mean, 2),
                100.0 * (json_is_number(noise) ? json_number_value(noise) : NAN));
        if (cli->args->picture.reference) print_comparison(cli->out, picture);
    }
    json_decref(job);
    return s;
}

CLI_COMMAND(
    RENDER, cli_render, .place = 40, .name = "render", .operand = "ID", .options = "picture out id-file",
    .summary = "show the cloth of a finished job on a surface, and download the picture",
    .text =
        "A job of its own renders the job's fibers with the fitted parameters, fiber by fiber. The results go to the\n"
        "folder of --out (default: selvedge-ID): pictures/on-1.png, and on-1.exr with the radiance.\n"
        "--reference alone means --method fast. --kind drape, roll, fold, swatch, close_up, far or lit_through is a\n"
        "picture for the eye in a studio; otherwise surface, lamp and camera are given. --turntable turns such a "
        "cloth\n"
        "once and joins its pictures to turntable.webp.\n")

status cli_render(struct cli *cli, int *exit_code, struct error *err)
{
    const char *mesh = NULL;
    char made[CLI_ID_BYTES] = "", copy[4096];
    json_t *picture = json_object(), *wanted = json_pack("{s:[O]}", "pictures", picture);
    bool twin = false;
    status s = read_picture(cli->args, picture, &mesh, err);
    if (s == STATUS_OK) s = read_yes("twin", cli->args->twin, &twin, err);
    if (s == STATUS_OK && mesh != NULL) {
        snprintf(copy, sizeof copy, "%s", mesh);
        if (access(mesh, R_OK) != 0) s = error_set_errno(err, "cannot read the mesh '%s'", mesh);
        json_object_set_new(picture, "mesh_file", json_string(basename(copy)));
    }
    if (cli->args->turntable) make_turn(picture, wanted);
    if (twin) json_object_set_new(wanted, "twin", json_pack("{s:b}", "make", 1));
    if (s == STATUS_OK) s = cli_derive(cli, cli->args->operand, wanted, mesh, made, exit_code, err);
    if (s == STATUS_OK && *exit_code == CLI_EXIT_OK) s = cli_results_to_out(cli, made, err);
    if (s == STATUS_OK && *exit_code == CLI_EXIT_OK)
        s = cli->args->turntable ? write_turn(cli, made, err) : describe(cli, made, err);
    json_decref(picture);
    json_decref(wanted);
    return s;
}
