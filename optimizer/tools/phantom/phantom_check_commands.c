/* The commands "photograph" and "compare". */
#include "geometry/phantom/compare.h"
#include "optimizer/tools/phantom/phantom_commands.h"
#include "optimizer/tools/phantom/phantom_photographs.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char photograph_usage[] =
    "selvedge-phantom photograph --fibers FILE --out DIR [options]\n"
    "\n"
    "Renders one OpenEXR picture per configuration: DIR/fit-00.exr ... DIR/held-out-23.exr, DIR/photographs.json (the "
    "array \"photographs\" of a\n"
    "job document) and DIR/truth.json (the parameters, and each picture's mean without noise).\n"
    "\n"
    "  --fibers FILE           .hair, or text \"x y z radius\" together with --tile-mm X,Y\n"
    "  --model ID              scattering model                                            [two_lobe.v1]\n"
    "  --groups A,B,...        names of the groups of fibers: each has parameters of its own [one set for all]\n"
    "  --param NAME=v          or NAME=r,g,b; repeat it. Angles in degrees                 [the model's start values]\n"
    "                          A.NAME=v: of group A only\n"
    "  --table CSV             configurations (columns as in a table of measurements)      [16 to fit + 24 held out]\n"
    "  --paths N               light paths for each photograph                             [131072]\n"
    "  --px N                  edge of a photograph in pixels                              [64]\n"
    "  --noise S               relative sd of an error per photograph and channel          [0]\n"
    "  --lamp-side-cm 10  --lamp-distance-cm 61  --camera-distance-cm 100  --crop-cm 1\n"
    "  --lamp-directional      parallel light in place of a square lamp\n"
    "  --environment R,G,B     light of this radiance from all around, besides the lamp            [0,0,0]\n"
    "  --far-field             the camera sees the cloth in parallel projection\n"
    "  --blur-mm B             blur of the camera: standard deviation of a Gaussian                [0]\n"
    "  --no-black-sheet        no black sheet: light passes through the cloth\n"
    "  --seed N                seed of all random numbers                                  [1]\n"
    "  --threads N             number of threads; 0: one per processor                     [0]\n"
    "  --quiet                 no progress on the terminal\n";

static const char compare_usage[] =
    "selvedge-phantom compare --truth FILE --fibers FILE --voxel-um V [options]\n"
    "\n"
    "Prints the agreement of two fiber sets as JSON (definitions: geometry/phantom/compare.h).\n"
    "\n"
    "  --truth FILE, --fibers FILE   .hair, or text \"x y z radius\" (the truth then needs --tile-mm X,Y)\n"
    "  --voxel-um V                  the unit of the figures                                  [2]\n"
    "  --margin-voxel M              ignore fibers nearer than this to a face of the tile     [0]\n";

enum { PARAM_MAX = 64 };

struct param_text {
    const char *text[PARAM_MAX];
    size_t n;
};

static status keep_param(void *to, const char *value, struct error *err)
{
    struct param_text *p = to;
    if (p->n == PARAM_MAX) return error_set(err, STATUS_INVALID, "too many --param");
    p->text[p->n++] = value;
    return STATUS_OK;
}

static bool wants_help(int argc, char **argv, const char *usage)
{
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "--help") == 0) {
            fputs(usage, stdout);
            return true;
        }
    return false;
}

/* Sets the model with a set of parameters for each of the comma-separated groups; NULL: one set for all fibers. */
static status set_model(struct phantom_photograph_option *o, const char *model, const char *groups, struct error *err)
{
    static char name[MODEL_MAX_SET][MODEL_SET_NAME_BYTES]; /* the parameters' descriptions point to it */
    size_t n_group = 0;
    for (const char *at = groups; at != NULL; n_group++) {
        size_t n = strcspn(at, ",");
        if (n_group == MODEL_MAX_SET || n == 0 || n >= MODEL_SET_NAME_BYTES)
            return error_set(err, STATUS_INVALID, "--groups '%s' must be 1 to %d names of at most %d bytes", groups,
                             MODEL_MAX_SET, MODEL_SET_NAME_BYTES - 1);
        memcpy(name[n_group], at, n);
        name[n_group][n] = '\0';
        at = at[n] == ',' ? at + n + 1 : NULL;
    }
    return phantom_photograph_model(o, model, (const char(*)[MODEL_SET_NAME_BYTES])name, n_group, err);
}

static status parse_photograph(struct phantom_photograph_option *o, size_t *n_thread, bool *quiet, int argc,
                               char **argv, struct error *err)
{
    const char *model = "two_lobe.v1", *groups = NULL;
    struct param_text param = {.n = 0};
    phantom_photograph_option_default(o);
    const struct command_option option[] = {
        {.name = "fibers", .kind = OPTION_TEXT, .to = &o->fiber_file},
        {.name = "tile-mm", .kind = OPTION_NUMBER_LIST, .to = o->tile_mm, .n = 2},
        {.name = "out", .kind = OPTION_TEXT, .to = &o->folder},
        {.name = "model", .kind = OPTION_TEXT, .to = &model},
        {.name = "groups", .kind = OPTION_TEXT, .to = &groups},
        {.name = "param", .kind = OPTION_CALL, .to = &param, .call = keep_param},
        {.name = "table", .kind = OPTION_TEXT, .to = &o->table_file},
        {.name = "paths", .kind = OPTION_U64, .to = &o->n_path},
        {.name = "px", .kind = OPTION_COUNT, .to = &o->px},
        {.name = "noise", .kind = OPTION_NUMBER, .to = &o->noise},
        {.name = "lamp-side-cm", .kind = OPTION_NUMBER, .to = &o->lamp_side_cm},
        {.name = "lamp-distance-cm", .kind = OPTION_NUMBER, .to = &o->lamp_distance_cm},
        {.name = "camera-distance-cm", .kind = OPTION_NUMBER, .to = &o->camera_distance_cm},
        {.name = "crop-cm", .kind = OPTION_NUMBER, .to = &o->crop_cm},
        {.name = "lamp-directional", .kind = OPTION_FLAG, .to = &o->lamp_directional},
        {.name = "environment", .kind = OPTION_NUMBER_LIST, .to = o->environment_rgb, .n = 3},
        {.name = "far-field", .kind = OPTION_FLAG, .to = &o->camera_far_field},
        {.name = "blur-mm", .kind = OPTION_NUMBER, .to = &o->camera_blur_mm},
        {.name = "no-black-sheet", .kind = OPTION_FALSE, .to = &o->black_sheet},
        {.name = "seed", .kind = OPTION_U64, .to = &o->seed},
        {.name = "threads", .kind = OPTION_COUNT, .to = n_thread},
        {.name = "quiet", .kind = OPTION_FLAG, .to = quiet},
    };
    status st = command_options_parse(argc, argv, option, sizeof option / sizeof *option, err);
    if (st != STATUS_OK) return st;
    if (o->fiber_file == NULL || o->folder == NULL)
        return error_set(err, STATUS_INVALID, "--fibers and --out are needed");
    st = set_model(o, model, groups, err);
    for (size_t i = 0; i < param.n && st == STATUS_OK; i++)
        st = phantom_param_parse(&o->sets.info, param.text[i], o->param, err);
    return st;
}

static void show_progress(void *context, double fraction)
{
    (void)context;
    fprintf(stderr, "\rphotographs %3.0f %%%s", 100.0 * fraction, fraction >= 1.0 ? "\n" : "");
}

int phantom_command_photograph(int argc, char **argv)
{
    struct phantom_photograph_option o;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    size_t n_thread = 0;
    bool quiet = false;
    if (wants_help(argc, argv, photograph_usage)) return 0;
    if (parse_photograph(&o, &n_thread, &quiet, argc, argv, &err) != STATUS_OK) {
        fprintf(stderr, "selvedge-phantom photograph: %s\n", err.text);
        return 2;
    }
    const struct progress progress = {.report = quiet || !isatty(STDERR_FILENO) ? NULL : show_progress};
    status st = thread_pool_new(n_thread, &pool, &err);
    if (st == STATUS_OK) st = phantom_photographs_make(&o, pool, &progress, &err);
    if (st != STATUS_OK) fprintf(stderr, "selvedge-phantom photograph: %s\n", err.text);
    thread_pool_free(pool);
    return st == STATUS_OK ? 0 : 1;
}

static status load(const char *path, const double tile_mm[2], struct fiber_set *f, struct error *err)
{
    size_t n = strlen(path);
    status st = n > 5 && strcmp(path + n - 5, ".hair") == 0 ? fiber_set_read_hair(f, path, err)
                                                            : fiber_set_read_text(f, path, err);
    for (int a = 0; a < 2 && st == STATUS_OK; a++)
        if (tile_mm[a] > 0.0) f->tile_size_m[a] = 1e-3 * tile_mm[a];
    return st;
}

/* JSON has no NaN, so a figure that could not be measured becomes null. */
static void set_number(json_t *j, const char *name, double value)
{
    json_object_set_new(j, name, isfinite(value) ? json_real(value) : json_null());
}

static json_t *report_json(const struct compare_report *r)
{
    json_t *j = json_object();
    const struct {
        const char *name;
        double value;
    } figure[] = {
        {"fiber_diameter_voxel", r->fiber_diameter_voxel},
        {"length_true_mm", 1e3 * r->length_true_m},
        {"length_found_mm", 1e3 * r->length_found_m},
        {"center_recall", r->center_recall},
        {"center_precision", r->center_precision},
        {"centerline_rms_voxel", r->centerline_rms_voxel},
        {"centerline_p95_voxel", r->centerline_p95_voxel},
        {"length_recovered", r->length_recovered},
        {"longest_run", r->longest_run},
        {"missed", r->missed},
        {"fragments_per_fiber", r->fragments_per_fiber},
        {"gaps_per_fiber", r->gaps_per_fiber},
        {"merges_per_fiber", r->merges_per_fiber},
        {"direction_mean_deg", r->direction_mean_deg},
        {"direction_p95_deg", r->direction_p95_deg},
        {"orientation_frobenius", r->orientation_frobenius},
        {"radius_bias_percent", r->radius_bias_percent},
        {"radius_rms_percent", r->radius_rms_percent},
    };
    json_object_set_new(j, "n_true", json_integer((json_int_t)r->n_true));
    json_object_set_new(j, "n_true_piece", json_integer((json_int_t)r->n_true_piece));
    json_object_set_new(j, "n_found", json_integer((json_int_t)r->n_found));
    for (size_t i = 0; i < sizeof figure / sizeof *figure; i++) set_number(j, figure[i].name, figure[i].value);
    return j;
}

int phantom_command_compare(int argc, char **argv)
{
    const char *truth_file = NULL, *found_file = NULL;
    double voxel_um = 2.0, margin_voxel = 0.0, tile_mm[2] = {0.0, 0.0};
    const struct command_option option[] = {
        {.name = "truth", .kind = OPTION_TEXT, .to = &truth_file},
        {.name = "fibers", .kind = OPTION_TEXT, .to = &found_file},
        {.name = "voxel-um", .kind = OPTION_NUMBER, .to = &voxel_um},
        {.name = "margin-voxel", .kind = OPTION_NUMBER, .to = &margin_voxel},
        {.name = "tile-mm", .kind = OPTION_NUMBER_LIST, .to = tile_mm, .n = 2},
    };
    struct fiber_set truth, found;
    struct compare_report report;
    struct error err = {0};
    fiber_set_init(&truth);
    fiber_set_init(&found);
    if (wants_help(argc, argv, compare_usage)) return 0;
    status st = command_options_parse(argc, argv, option, sizeof option / sizeof *option, &err);
    if (st == STATUS_OK && (truth_file == NULL || found_file == NULL))
        st = error_set(&err, STATUS_INVALID, "--truth and --fibers are needed");
    if (st != STATUS_OK) {
        fprintf(stderr, "selvedge-phantom compare: %s\n", err.text);
        return 2;
    }
    const struct compare_option o = {.voxel_size_m = 1e-6 * voxel_um, .margin_m = 1e-6 * voxel_um * margin_voxel};
    st = load(truth_file, tile_mm, &truth, &err);
    if (st == STATUS_OK) st = load(found_file, tile_mm, &found, &err);
    if (st == STATUS_OK) st = compare_fibers(&truth, &found, &o, &report, &err);
    if (st == STATUS_OK) {
        json_t *j = report_json(&report);
        json_dumpf(j, stdout, JSON_INDENT(2) | JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(6));
        putchar('\n');
        json_decref(j);
    } else {
        fprintf(stderr, "selvedge-phantom compare: %s\n", err.text);
    }
    fiber_set_release(&truth);
    fiber_set_release(&found);
    return st == STATUS_OK ? 0 : 1;
}
