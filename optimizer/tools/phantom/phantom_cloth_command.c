#include "base/files/durable.h"
#include "geometry/fibers/fiber_view.h"
#include "geometry/phantom/phantom.h"
#include "optimizer/job/document/cloth_json.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/tools/phantom/phantom_commands.h"
#include "optimizer/tools/phantom/phantom_described.h"
#include "renderer/image/image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "selvedge-phantom cloth --out DIR [options]\n"
    "\n"
    "Writes DIR/scan.tif (the CT volume), DIR/truth.hair, DIR/truth.txt and DIR/truth-sections.csv (the fibers),\n"
    "DIR/phantom.json (all numbers), DIR/top.png (heights from above) and DIR/slice-x.png, -y, -z (the middle).\n"
    "\n"
    "DIR/cloth.json describes the cloth as the section \"cloth\" of a job document does (not for --yarn).\n"
    "\n"
    "  --description FILE      the cloth that this section \"cloth\" describes, in place of the next group of "
    "options;\n"
    "                          the tile is stretched to whole voxels (docs/described-cloth.md)\n"
    "cloth with twists that are rounded so that the tile closes\n"
    "  --weave NAME            plain, twill (2/2), twill31, satin, velvet, knit, felt                     [twill]\n"
    "  --voxel-um V            edge of a voxel                                                            [2]\n"
    "  --diameter-voxel D      fiber diameter in voxels; WEFT,WARP,PILE where they differ                 [7]\n"
    "  --yarns WEFT,WARP       yarns a tile (knit: courses,wales), multiples of the repeat                [one "
    "repeat]\n"
    "  --fibers-per-yarn N     rounded up to 1 + 6 k; felt: fibers in all                                 [19; velvet "
    "7, felt 60]\n"
    "  --packing P             share of a yarn's section that is fiber, 0.3 .. 0.9                        [0.7]\n"
    "  --flatness F            width over height of a yarn, 1 .. 4                                        [1.8; knit "
    "1]\n"
    "  --cover C               yarn width over spacing, 0.5 .. 1.3                                        [1.05; knit "
    "1]\n"
    "  --twist T               turns a tile, rounded to sixths                                            [0.333]\n"
    "  --migration M           relative radial wandering of fibers, 0 .. 0.5                              [0.05]\n"
    "  --yarn FILE             plied yarns with measured parameters from FILE; replaces --fibers-per-yarn,\n"
    "                          --twist, --migration and --flyaways; sets --packing 0.5 and --flatness 1\n"
    "  --yarn-true-size        keep the lengths of the yarn file; otherwise the yarn is scaled to --packing\n"
    "  --flyaways N            hairs that leave each yarn                                                 [0]\n"
    "  --pile-um H             velvet: height of the pile                                                 [200]\n"
    "  --felt-tile-um S, --felt-thickness-um H                                                           [320, 120]\n";

/* The rest of the text, because a string of C has 4095 characters at most. */
static const char usage_scan[] =
    "fibers that are not alike, and not discs (truth-sections.csv lists radius and section of each)\n"
    "  --diameter-spread S     standard deviation of the diameters over their mean, 0 .. 0.3              [0]\n"
    "  --lumen L               hollow: width of the lumen over that of the fiber, 0 .. 0.8                [0]\n"
    "  --lumen-spread S        lumens of single fibers, even between (1 - S) L and L, 0 .. 1             [0]\n"
    "  --aspect A              flat: each fiber has its own ratio of axes between 1 and A, 1 .. 4         [1]\n"
    "  --bean B                bend of the long axis of a section, 0 .. 0.5                               [0]\n"
    "  --taper T               share by which the radius falls along a fiber and rises again, 0 to 0.5     [0]\n"
    "  --section-turns T       turns of a section per millimetre of its fiber                             [1]\n"
    "scan\n"
    "  --snr S                 (fiber - void) / noise sd; 0: none                                         [5]\n"
    "  --blur B                point spread, sd in voxels                                                 [0.7]\n"
    "  --noise-sd B            sd in voxels of the blur that correlates the noise; 0: white               [0]\n"
    "  --hardening H           beam hardening: share of the signal that is lost amid material             [0]\n"
    "  --fringes F             phase fringes: strength of the bright and dark rims of fibers              [0]\n"
    "  --poisson N             photon counts at full signal; 0: no Poisson noise                          [0]\n"
    "  --rings A               sd of ring artefacts, in units of the signal                               [0]\n"
    "  --gradient G            relative change of the signal from face to face in x                       [0]\n"
    "  --bits 8|16             depth of scan.tif                                                          [16]\n"
    "  --no-deflate            write scan.tif uncompressed\n"
    "  --metaimage             write DIR/scan.mhd and scan.raw as well\n"
    "  --voxels-z N            slices in all, the cloth in the middle of them                             [as many as "
    "it needs]\n"
    "other\n"
    "  --seed N                seed of all random numbers                                                 [1]\n"
    "  --threads N             number of threads; 0: one per processor                                    [0]\n"
    "  --memory-mib N          limit of resident memory; a larger volume is kept in a file in DIR         [2048]\n";

struct cloth {
    const char *out, *yarn;             /* yarn: NULL or a file of parameters */
    const char *description;            /* NULL or a file */
    struct cloth_description described; /* with a description */
    struct phantom_option phantom;
    struct phantom_scan_option scan;
    struct phantom_file_option file;
    bool metaimage;
    size_t n_thread, n_slice, memory_mib; /* n_slice 0: as many as needed */
    struct phantom_report report;
    struct fiber_set fibers;
    struct volume volume;
    double cover;
};

static status path_in(const char *folder, const char *name, char path[4096], struct error *err)
{
    int n = snprintf(path, 4096, "%s/%s", folder, name);
    return n < 0 || n >= 4096 ? error_set(err, STATUS_INVALID, "folder name '%.100s...' is too long", folder)
                              : STATUS_OK;
}

/* Options as the user gives them, whose values are stored in other units or types. */
struct cloth_input {
    const char *weave_name;
    double voxel_um, diameter[3], pile_um, felt_um[2]; /* diameter: in voxels */
    double turns_per_mm;
    size_t bits;
};

/* Checks these options and stores the converted values in c. */
static status take_input(struct cloth *c, const struct cloth_input *in, struct error *err)
{
    if (c->out == NULL) return error_set(err, STATUS_INVALID, "--out is missing");
    if (in->bits != 8 && in->bits != 16) return error_set(err, STATUS_INVALID, "option --bits takes 8 or 16");
    c->file.bits = (int)in->bits;
    if (in->bits == 8) {
        c->file.void_value = 50.0;
        c->file.fiber_value = 170.0;
    }
    c->phantom.voxel_size_m = c->scan.voxel_size_m = 1e-6 * in->voxel_um;
    for (int k = 0; k < 3; k++) c->phantom.fiber_radius_m[k] = 0.5e-6 * in->diameter[k] * in->voxel_um;
    c->phantom.pile_height_m = 1e-6 * in->pile_um;
    c->phantom.felt_tile_m = 1e-6 * in->felt_um[0];
    c->phantom.felt_thickness_m = 1e-6 * in->felt_um[1];
    c->scan.seed = c->phantom.section.seed = c->phantom.seed;
    c->phantom.section.turns_per_m = 1e3 * in->turns_per_mm;
    c->scan.section = c->phantom.section;
    if (c->description != NULL &&
        (!phantom_section_is_disc(&c->scan.section) || c->phantom.radius_spread > 0.0 || c->scan.section.taper > 0.0))
        return error_set(err, STATUS_INVALID, "sections, --taper and --diameter-spread do not go with --description");
    return STATUS_OK;
}

static status set_defaults(struct cloth *c, const char *weave_name, struct error *err)
{
    enum phantom_weave weave;
    status st = phantom_weave_find(weave_name, &weave, err);
    if (st != STATUS_OK) return st;
    phantom_option_default(&c->phantom, weave);
    if (c->yarn != NULL) {
        c->phantom.packing = 0.5;
        c->phantom.flatness = 1.0;
    }
    phantom_scan_option_default(&c->scan);
    phantom_file_option_default(&c->file);
    return STATUS_OK;
}

static status parse_cloth(struct cloth *c, int argc, char **argv, struct error *err)
{
    struct cloth_input in = {.weave_name = "twill",
                             .voxel_um = 2.0,
                             .diameter = {7.0, 7.0, 7.0},
                             .pile_um = 200.0,
                             .felt_um = {320.0, 120.0},
                             .turns_per_mm = 1.0,
                             .bits = 16};
    c->memory_mib = 2048;
    const struct command_option option[] = {
        {.name = "out", .kind = OPTION_TEXT, .to = &c->out},
        {.name = "weave", .kind = OPTION_TEXT, .to = &in.weave_name},
        {.name = "voxel-um", .kind = OPTION_NUMBER, .to = &in.voxel_um},
        {.name = "diameter-voxel", .kind = OPTION_NUMBER_LIST, .to = in.diameter, .n = 3},
        {.name = "yarns", .kind = OPTION_COUNT, .to = c->phantom.n_yarn, .n = 2},
        {.name = "fibers-per-yarn", .kind = OPTION_COUNT, .to = &c->phantom.n_fiber_per_yarn},
        {.name = "packing", .kind = OPTION_NUMBER, .to = &c->phantom.packing},
        {.name = "flatness", .kind = OPTION_NUMBER, .to = &c->phantom.flatness},
        {.name = "cover", .kind = OPTION_NUMBER, .to = &c->phantom.cover},
        {.name = "twist", .kind = OPTION_NUMBER, .to = &c->phantom.twist_turns},
        {.name = "migration", .kind = OPTION_NUMBER, .to = &c->phantom.migration},
        {.name = "yarn", .kind = OPTION_TEXT, .to = &c->yarn},
        {.name = "description", .kind = OPTION_TEXT, .to = &c->description},
        {.name = "yarn-true-size", .kind = OPTION_FLAG, .to = &c->phantom.yarn_true_size},
        {.name = "flyaways", .kind = OPTION_COUNT, .to = &c->phantom.n_flyaway_per_yarn},
        {.name = "pile-um", .kind = OPTION_NUMBER, .to = &in.pile_um},
        {.name = "felt-tile-um", .kind = OPTION_NUMBER, .to = &in.felt_um[0]},
        {.name = "felt-thickness-um", .kind = OPTION_NUMBER, .to = &in.felt_um[1]},
        {.name = "diameter-spread", .kind = OPTION_NUMBER, .to = &c->phantom.radius_spread},
        {.name = "lumen", .kind = OPTION_NUMBER, .to = &c->phantom.section.lumen},
        {.name = "lumen-spread", .kind = OPTION_NUMBER, .to = &c->phantom.section.lumen_spread},
        {.name = "aspect", .kind = OPTION_NUMBER, .to = &c->phantom.section.aspect},
        {.name = "bean", .kind = OPTION_NUMBER, .to = &c->phantom.section.bean},
        {.name = "taper", .kind = OPTION_NUMBER, .to = &c->phantom.section.taper},
        {.name = "section-turns", .kind = OPTION_NUMBER, .to = &in.turns_per_mm},
        {.name = "noise-sd", .kind = OPTION_NUMBER, .to = &c->scan.noise_sd_voxel},
        {.name = "hardening", .kind = OPTION_NUMBER, .to = &c->scan.beam_hardening},
        {.name = "fringes", .kind = OPTION_NUMBER, .to = &c->scan.phase_fringes},
        {.name = "snr", .kind = OPTION_NUMBER, .to = &c->scan.snr},
        {.name = "blur", .kind = OPTION_NUMBER, .to = &c->scan.blur_sd_voxel},
        {.name = "poisson", .kind = OPTION_NUMBER, .to = &c->scan.poisson_count},
        {.name = "rings", .kind = OPTION_NUMBER, .to = &c->scan.ring_amplitude},
        {.name = "gradient", .kind = OPTION_NUMBER, .to = &c->scan.gradient},
        {.name = "bits", .kind = OPTION_COUNT, .to = &in.bits},
        {.name = "no-deflate", .kind = OPTION_FALSE, .to = &c->file.deflate},
        {.name = "metaimage", .kind = OPTION_FLAG, .to = &c->metaimage},
        {.name = "voxels-z", .kind = OPTION_COUNT, .to = &c->n_slice},
        {.name = "memory-mib", .kind = OPTION_COUNT, .to = &c->memory_mib},
        {.name = "seed", .kind = OPTION_U64, .to = &c->phantom.seed},
        {.name = "threads", .kind = OPTION_COUNT, .to = &c->n_thread},
    };
    /* The options are read twice, because weave and yarn set the defaults of the others. */
    status st = command_options_parse(argc, argv, option, sizeof option / sizeof *option, err);
    if (st == STATUS_OK) st = set_defaults(c, in.weave_name, err);
    if (st == STATUS_OK) st = command_options_parse(argc, argv, option, sizeof option / sizeof *option, err);
    if (st == STATUS_OK && c->yarn != NULL) st = phantom_yarn_read(c->yarn, &c->phantom.yarn, err);
    if (st == STATUS_OK && c->description != NULL) st = phantom_described_read(c->description, &c->described, err);
    return st == STATUS_OK ? take_input(c, &in, err) : st;
}

static status write_png_grey(const uint8_t *grey, size_t width, size_t height, const char *path, struct error *err)
{
    uint8_t *rgb = malloc(3 * width * height);
    if (rgb == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    for (size_t j = 0; j < height; j++) /* y points up in the picture */
        for (size_t i = 0; i < width; i++) memset(rgb + 3 * (j * width + i), grey[(height - 1 - j) * width + i], 3);
    status st = image_write_png_rgb8(rgb, width, height, path, err);
    free(rgb);
    return st;
}

/* The middle slice perpendicular to an axis: black at signal -0.4, white at 1.4. */
static status write_slice(const struct volume *v, int axis, const char *path, struct error *err)
{
    int across = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
    size_t width = v->n[across], height = v->n[up], at[3];
    uint8_t *grey = malloc(width * height);
    if (grey == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    at[axis] = v->n[axis] / 2;
    for (at[up] = 0; at[up] < height; at[up]++) {
        scratch_keep_within(v->space);
        for (at[across] = 0; at[across] < width; at[across]++) {
            double value = 255.0 * ((double)v->density[volume_index(v->n, at[0], at[1], at[2])] + 0.4) / 1.8;
            grey[at[up] * width + at[across]] = (uint8_t)fmax(0.0, fmin(255.0, value));
        }
    }
    status st = write_png_grey(grey, width, height, path, err);
    free(grey);
    return st;
}

static status write_pictures(struct cloth *c, struct error *err)
{
    static const char *const slice_name[] = {"slice-x.png", "slice-y.png", "slice-z.png"};
    char path[4096];
    uint8_t *grey = NULL;
    size_t size[2];
    status st = fiber_top_view(&c->fibers, 0.5 * c->phantom.voxel_size_m, size, &grey, &c->cover, err);
    if (st == STATUS_OK) st = path_in(c->out, "top.png", path, err);
    if (st == STATUS_OK) st = write_png_grey(grey, size[0], size[1], path, err);
    free(grey);
    for (int axis = 0; axis < 3 && st == STATUS_OK; axis++) {
        st = path_in(c->out, slice_name[axis], path, err);
        if (st == STATUS_OK) st = write_slice(&c->volume, axis, path, err);
    }
    return st;
}

static const char *path_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

static json_t *describe(const struct cloth *c)
{
    const struct phantom_option *o = &c->phantom;
    const struct phantom_report *r = &c->report;
    double um = 1e6;
    json_t *cloth = json_pack("{s:s,s:f,s:[f,f,f],s:i,s:f,s:f,s:f,s:f,s:f,s:i,s:f,s:f}", "weave",
                              phantom_weave_name(o->weave), "voxel_size_um", um * o->voxel_size_m, "fiber_radius_um",
                              um * o->fiber_radius_m[0], um * o->fiber_radius_m[1], um * o->fiber_radius_m[2],
                              "fibers_per_yarn", (int)r->n_fiber_per_yarn, "packing", o->packing, "flatness",
                              o->flatness, "cover_designed", o->cover, "twist_turns", r->twist_turns, "migration",
                              o->migration, "flyaways_per_yarn", (int)o->n_flyaway_per_yarn, "fiber_diameter_voxel",
                              2.0 * o->fiber_radius_m[0] / o->voxel_size_m, "yarn_width_um", um * r->yarn_width_m);
    json_t *scan = json_pack(
        "{s:f,s:f,s:f,s:f,s:f,s:i,s:f,s:f,s:f,s:f,s:f}", "snr", c->scan.snr, "blur_sd_voxel", c->scan.blur_sd_voxel,
        "poisson_count", c->scan.poisson_count, "ring_amplitude", c->scan.ring_amplitude, "gradient", c->scan.gradient,
        "bits", c->file.bits, "void_value", c->file.void_value, "fiber_value", c->file.fiber_value, "noise_sd_voxel",
        c->scan.noise_sd_voxel, "beam_hardening", c->scan.beam_hardening, "phase_fringes", c->scan.phase_fringes);
    if (cloth != NULL)
        json_object_update_new(cloth,
                               json_pack("{s:f,s:f,s:f,s:f,s:f,s:f,s:f}", "diameter_spread", o->radius_spread, "lumen",
                                         o->section.lumen, "lumen_spread", o->section.lumen_spread, "aspect",
                                         fmax(1.0, o->section.aspect), "bean", o->section.bean, "section_turns_per_mm",
                                         1e-3 * o->section.turns_per_m, "taper", o->section.taper));
    json_t *size = json_pack("{s:[i,i,i],s:[f,f],s:[f,f],s:i,s:i,s:f,s:f,s:f,s:f,s:f,s:f}", "n_voxel",
                             (int)r->n_voxel[0], (int)r->n_voxel[1], (int)r->n_voxel[2], "tile_mm",
                             1e3 * c->fibers.tile_size_m[0], 1e3 * c->fibers.tile_size_m[1], "yarn_spacing_um",
                             um * r->yarn_spacing_m[0], um * r->yarn_spacing_m[1], "n_fiber", (int)c->fibers.n_fiber,
                             "n_vertex", (int)c->fibers.n_vertex, "length_mm", 1e3 * fiber_set_length_m(&c->fibers),
                             "cover", r->cover, "volume_fraction", r->volume_fraction, "overlap_mean", r->overlap_mean,
                             "overlap_max", r->overlap_max, "strain_p95", r->strain_p95);
    const struct phantom_plied *p = &r->plied;
    if (o->yarn.n_ply > 0 && cloth != NULL) {
        json_object_del(cloth, "migration"); /* it describes the yarn without plies */
        json_object_del(cloth, "flyaways_per_yarn");
        json_object_set_new(cloth, "yarn",
                            json_pack("{s:s,s:i,s:i,s:f,s:[f,f],s:[f,f],s:[f,f],s:i,s:i}", "file", path_name(c->yarn),
                                      "plies", (int)o->yarn.n_ply, "fibers_per_ply", (int)o->yarn.n_fiber, "scale",
                                      p->scale, "ply_turns", p->ply_turns[0], p->ply_turns[1], "ply_turns_unrounded",
                                      p->wanted_ply_turns[0], p->wanted_ply_turns[1], "fiber_turns", p->fiber_turns[0],
                                      p->fiber_turns[1], "hairs", (int)p->n_hair, "loops", (int)p->n_loop));
    }
    if (c->description != NULL) {
        json_decref(cloth);
        cloth = cloth_section_json(&c->described, NULL);
        json_object_set_new(cloth, "voxel_size_um", json_real(um * o->voxel_size_m));
    }
    return json_pack("{s:I,s:o,s:o,s:o}", "seed", (json_int_t)o->seed, "cloth", cloth, "scan", scan, "result", size);
}

/* cloth.json: the section "cloth" of a job for the same cloth (numbers with all digits), or for the nearest. */
static status write_description(const struct cloth *c, struct error *err)
{
    char path[4096];
    struct cloth_description nearest;
    const struct cloth_description *d = c->description != NULL ? &c->described : &nearest;
    if (c->description == NULL && c->yarn != NULL) return STATUS_OK;
    status st = path_in(c->out, "cloth.json", path, err);
    if (st == STATUS_OK && c->description == NULL)
        st = phantom_described_as(&c->phantom, &c->report, &c->fibers, &nearest, err);
    if (st != STATUS_OK) return st;
    json_t *json = cloth_section_json(d, NULL);
    char *text = json_dumps(json, JSON_INDENT(2) | JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(17));
    json_decref(json);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    st = durable_replace(path, text, strlen(text), err);
    free(text);
    return st;
}

static status write_files(struct cloth *c, struct error *err)
{
    char path[4096];
    status st = path_in(c->out, "scan.tif", path, err);
    if (st == STATUS_OK) st = phantom_write_tiff(&c->volume, &c->file, path, err);
    if (st == STATUS_OK) st = path_in(c->out, "scan.mhd", path, err);
    if (st == STATUS_OK && c->metaimage) st = phantom_write_metaimage(&c->volume, &c->file, path, err);
    if (st == STATUS_OK) st = path_in(c->out, "truth.hair", path, err);
    if (st == STATUS_OK) st = fiber_set_write_hair(&c->fibers, path, err);
    if (st == STATUS_OK) st = path_in(c->out, "truth.txt", path, err);
    if (st == STATUS_OK) st = fiber_set_write_text(&c->fibers, path, err);
    if (st == STATUS_OK) st = path_in(c->out, "truth-sections.csv", path, err);
    if (st == STATUS_OK) st = phantom_write_sections(&c->fibers, &c->scan.section, path, err);
    if (st == STATUS_OK) st = write_pictures(c, err);
    if (st == STATUS_OK) st = write_description(c, err);
    if (st == STATUS_OK) st = path_in(c->out, "phantom.json", path, err);
    if (st != STATUS_OK) return st;
    json_t *j = describe(c);
    char *text = j != NULL ? json_dumps(j, JSON_INDENT(2) | JSON_PRESERVE_ORDER | JSON_REAL_PRECISION(9)) : NULL;
    json_decref(j);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    st = durable_replace(path, text, strlen(text), err);
    if (st == STATUS_OK)
        printf("%zu fibers in a tile of %.4g x %.4g mm, scan of %zu x %zu x %zu voxels; all numbers are in %s\n",
               c->fibers.n_fiber, 1e3 * c->fibers.tile_size_m[0], 1e3 * c->fibers.tile_size_m[1], c->report.n_voxel[0],
               c->report.n_voxel[1], c->report.n_voxel[2], path);
    free(text);
    return st;
}

static status make_fibers(struct cloth *c, struct thread_pool *pool, struct error *err)
{
    if (c->description == NULL) return phantom_generate(&c->phantom, pool, NULL, &c->fibers, &c->report, err);
    return phantom_described_make(&c->described, c->phantom.voxel_size_m, c->phantom.margin_m, pool, &c->fibers,
                                  &c->report, err);
}

int phantom_command_cloth(int argc, char **argv)
{
    struct cloth c = {0};
    struct thread_pool *pool = NULL;
    struct scratch_space *space = NULL;
    struct error err = {0};
    fiber_set_init(&c.fibers);
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "--help") == 0) {
            fputs(usage, stdout);
            fputs(usage_scan, stdout);
            return 0;
        }
    if (parse_cloth(&c, argc, argv, &err) != STATUS_OK) {
        fprintf(stderr, "selvedge-phantom cloth: %s\n", err.text);
        return 2;
    }
    status st = thread_pool_new(c.n_thread, &pool, &err);
    if (st == STATUS_OK) st = durable_make_folder(c.out, &err);
    if (st == STATUS_OK) st = make_fibers(&c, pool, &err);
    if (st == STATUS_OK && c.n_slice > 0)
        st = phantom_pad(&c.fibers, &c.report, c.phantom.voxel_size_m, c.n_slice, &err);
    if (st == STATUS_OK) st = scratch_space_new(c.out, c.memory_mib << 20, &space, &err);
    if (st == STATUS_OK) st = phantom_scan_in(&c.fibers, c.report.n_voxel, &c.scan, space, pool, NULL, &c.volume, &err);
    if (st == STATUS_OK) st = write_files(&c, &err);
    if (st != STATUS_OK) fprintf(stderr, "selvedge-phantom cloth: %s\n", err.text);
    volume_release(&c.volume);
    scratch_space_free(space);
    fiber_set_release(&c.fibers);
    thread_pool_free(pool);
    return st == STATUS_OK ? 0 : 1;
}
