/* The fast renderer against the path tracer. Prints one JSON object on each line.
 *
 *   pictures.<fabric>.precompute_cpu_s, precompute_bytes
 *       Processor seconds to make the tables, and the length of their file.
 *   pictures.<fabric>.flat492_rel_rms
 *       Root mean square of the differences between the mean radiances of 492 flat configurations and 3 channels, over
 *       the mean of path tracing. What the noise of both adds is taken off.
 *   pictures.<fabric>.speedup_at_3pct, speedup_at_3pct_least
 *       A draped piece of 40 mm. The error is the root mean square over fields of 0.28 mm, 4 x 4 of 512 x 512 pixels,
 *       and 3 channels, over the mean radiance. Of path tracing it is noise alone, whose square falls with the time; of
 *       the fast renderer it is noise and a part that stays. 256 fields are sampled until that part is shown to be
 *       above 3 %, or to be below it with its square known to about 1 %^2, or until the drape has taken --most-seconds
 *       of the processor. Figure: processor seconds of path tracing to an error of 3 % over those of the fast
 *       renderer, both from one run; `least` takes the square with two standard errors more. Both are 0 where that
 *       part is above 3 %, and where its standard error leaves open whether it is. Standard error says which.
 *
 * bench_pictures [FABRIC...] [--fields N] [--most-seconds N] [--wide] [--flat-paths N] [--paths N] [--order N]
 *                [--cell-paths N] [--traced HITS] [--by-tables] [--yarns N]
 *                [--tables FOLDER] [--deep HITS] [--deep-edge N] [--deep-paths N] [--cells-too]
 *                [--png FOLDER] [--px N] [--path-samples N] [--fast-samples N]
 *                [--no-flat] [--no-drape] [--no-visibility] [--dual DENSITY (in place of the fast renderer)]
 *   --tables     keeps the tables there, and takes those that are there; refuses those of other cloths or options
 *   --fields     along each side of the picture, 16 by default
 *   --wide       also samples fields of 0.56, 1.1 and 2.3 mm; to standard error
 *   --png        writes pictures of the drape of px x px pixels, which serve for nothing else
 *   --deep       hits before the table of deep light, 3 by default; 0: light from cells in its place, as with --traced
 *                and --by-tables
 *   --cells-too  also compares the drape with cells in place of that table; to standard error
 *   FABRIC   gabardine, fleece, silk (tests/support/cloth/fit_fabrics.h); default: all three
 */
#include "base/angle.h"
#include "base/clock.h"
#include "renderer/estimate/estimate.h"
#include "renderer/estimate/render.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/fast/precompute/fast_precompute.h"
#include "renderer/mesh/mesh_drape.h"
#include "renderer/quick/dual_tables.h"
#include "tests/bench/pictures/field_pair.h"
#include "tests/support/cloth/fit_fabrics.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { N_FLAT = 492 };
#define FIELD_SHARE (4.0 / 512.0) /* edge of a field over that of the picture */

static struct {
    size_t px, n_path_sample, n_fast_sample, n_flat_path, n_yarn, n_field;
    uint32_t n_path, order, n_traced, deep, deep_edge; /* 0: the defaults of the precomputation and of the renderer */
    double cell_paths, dual, deep_paths, most_s;
    const char *png, *tables;
    bool no_flat, no_drape, no_visibility, by_tables, cells_too, wide;
} option = {
    .px = 512, .n_path_sample = 16, .n_fast_sample = 16, .n_flat_path = 3072, .n_field = 16, .deep = 3, .most_s = 600};

static struct thread_pool *pool;

static void check(status s, const struct error *err)
{
    if (s == STATUS_OK) return;
    fprintf(stderr, "%s\n", err->text);
    exit(1);
}

static void print(const char *fabric, const char *what, double value, const char *unit, const char *better)
{
    printf("{\"name\":\"pictures.%s.%s\",\"value\":%.6g,\"unit\":\"%s\",\"better\":\"%s\"}\n", fabric, what, value,
           unit, better);
    fflush(stdout);
}
struct bench {
    const struct fit_fabric *fabric;
    struct fiber_set fiber;
    struct scene *flat, *drape;
    struct appearance model;
    double param[SCATTERING_MAX_PARAM];
    struct fast_tables tables;
    struct fast_option fast;
    struct dual_tables averages;
    struct dual_option dual;
};

static void make_cloth(struct bench *b)
{
    struct phantom_option o;
    struct phantom_report report;
    struct error err = {0};
    phantom_option_default(&o, b->fabric->weave);
    bool felt = b->fabric->weave == PHANTOM_FELT, satin = b->fabric->weave == PHANTOM_SATIN_5;
    o.n_fiber_per_yarn = felt ? 3600 : 37;
    o.felt_tile_m = 18e-4;
    o.felt_thickness_m = 2.5e-4;
    o.vertex_spacing_m = 8e-6;
    if (!felt) o.n_yarn[0] = o.n_yarn[1] = option.n_yarn > 0 ? option.n_yarn : satin ? 10 : 12;
    if (felt && option.n_yarn > 0) {
        o.felt_tile_m = 1.5e-4 * (double)option.n_yarn;
        o.n_fiber_per_yarn = 25 * option.n_yarn * option.n_yarn;
    }
    fiber_set_init(&b->fiber);
    check(phantom_generate(&o, pool, NULL, &b->fiber, &report, &err), &err);
    check(scene_new(&b->fiber, &(struct scene_option){.black_sheet = true}, &b->flat, &err), &err);
    fprintf(stderr, "%s: %zu fibers, %zu segments, tile %.2f x %.2f mm, covers %.3f, volume %.2f\n", b->fabric->name,
            b->fiber.n_fiber, scene_n_segment(b->flat), 1e3 * b->fiber.tile_size_m[0], 1e3 * b->fiber.tile_size_m[1],
            report.cover, report.volume_fraction);
}

static void make_tables(struct bench *b)
{
    struct error err = {0};
    char path[512] = "/tmp/selvedge-tables-XXXXXX";
    struct stat info;
    const uint32_t n_path = option.n_path == 0 && b->fast.deep && !option.cells_too ? 1 : option.n_path;
    const struct fast_precompute_request q = {.scene = b->flat,
                                              .model = b->model.surface,
                                              .param = b->param,
                                              .n_path = n_path,
                                              .order = option.order,
                                              .cell_paths = option.cell_paths,
                                              .no_visibility = option.no_visibility,
                                              .deep_traced = b->fast.deep ? option.deep : 0,
                                              .deep_edge = option.deep_edge,
                                              .deep_paths = option.deep_paths};
    if (option.tables != NULL) {
        snprintf(path, sizeof path, "%s/%s.tables", option.tables, b->fabric->name);
        if (stat(path, &info) == 0) {
            check(fast_precompute_kept(&q, path, &b->tables, &err), &err);
            return;
        }
    } else
        close(mkstemp(path));
    double start = clock_process_s();
    check(fast_precompute(&q, pool, NULL, &b->tables, &err), &err);
    double seconds = clock_process_s() - start;
    const struct fast_tables *t = &b->tables;
    check(fast_tables_write(t, path, &err), &err);
    fprintf(stderr,
            "%s: free path %.4f mm, spread %.4f mm, cells %u x %u x %u, %u seen, transfer error %.4f, %u of %u see\n",
            b->fabric->name, t->mean_free_path_mm, t->spread_mm, t->n_cell[0], t->n_cell[1], t->n_cell[2],
            t->n_transfer, (double)t->transfer_error, t->n_row, t->n_segment);
    if (t->deep.n_traced > 0)
        fprintf(stderr, "%s: noise of deep light %.2f %%\n", b->fabric->name, 100.0 * (double)t->deep.error);
    if (stat(path, &info) != 0) abort();
    print(b->fabric->name, "precompute_cpu_s", seconds, "s", "lower");
    print(b->fabric->name, "precompute_bytes", (double)info.st_size, "bytes", "lower");
    if (option.tables == NULL) unlink(path);
}

static void make_averages(struct bench *b)
{
    struct error err = {0};
    double start = clock_process_s();
    check(dual_tables_init(&b->averages, b->flat, b->model.surface, b->param, 1, pool, NULL, &err), &err);
    b->dual = (struct dual_option){&b->averages, (float)option.dual, (float)option.dual};
    print(b->fabric->name, "precompute_cpu_s", clock_process_s() - start, "s", "lower");
}

static struct radiance_input input_of(struct bench *b, const struct scene *scene, bool fast)
{
    return (struct radiance_input){.scene = {.fibers = scene},
                                   .model = &b->model,
                                   .param = b->param,
                                   .fast = fast && option.dual == 0 ? &b->fast : NULL,
                                   .dual = fast && option.dual > 0 ? &b->dual : NULL};
}

/* Quasi-random points of the unit cube of four dimensions (Roberts' sequence). */
static void flat_configuration(size_t i, struct configuration *c)
{
    double g = 1.1673039782614187, u[4], a = 1.0;
    for (int k = 0; k < 4; k++) {
        a /= g;
        u[k] = fmod(0.5 + a * (double)(i + 1), 1.0);
    }
    *c = (struct configuration){.light_theta_rad = acos(1.0 - 0.85 * u[0]),
                                .light_phi_rad = 2.0 * M_PI * u[1],
                                .camera_theta_rad = acos(1.0 - 0.85 * u[2]),
                                .camera_phi_rad = 0.0,
                                .cloth_rotation_rad = 2.0 * M_PI * u[3],
                                .light_distance_m = 0.61,
                                .lamp_side_m = 0.1,
                                .camera_distance_m = 1.0,
                                .crop_m = 0.01};
}

/* Mean radiances of all flat configurations, and the processor seconds. */
static double flat_means(struct bench *b, bool fast, size_t n_path, struct estimate *e)
{
    struct error err = {0};
    double start = clock_process_s();
    for (size_t i = 0; i < N_FLAT; i++) {
        struct configuration c;
        flat_configuration(i, &c);
        const struct estimate_request q = {.input = input_of(b, b->flat, fast),
                                           .configuration = &c,
                                           .n_configuration = 1,
                                           .n_path = &n_path,
                                           .seed = 77 + i,
                                           .replica = fast};
        check(estimate_run(&q, pool, NULL, e + i, &err), &err);
    }
    return clock_process_s() - start;
}

static void bench_flat(struct bench *b)
{
    static struct estimate path[N_FLAT], fast[N_FLAT];
    double path_s = flat_means(b, false, option.n_flat_path, path),
           fast_s = flat_means(b, true, option.n_flat_path, fast);
    double error2 = 0.0, noise2 = 0.0, mean = 0.0, difference = 0.0, n = 3.0 * N_FLAT;
    for (size_t i = 0; i < N_FLAT; i++)
        for (int c = 0; c < 3; c++) {
            double d = fast[i].mean[c] - path[i].mean[c];
            error2 += d * d / n;
            noise2 += (path[i].var[c] + fast[i].var[c]) / n;
            mean += path[i].mean[c] / n;
            difference += d / n;
        }
    fprintf(stderr, "%s flat: path %.1f s, fast %.1f s; mean %.4f, fast above it by %.2f %%; noise of both %.2f %%\n",
            b->fabric->name, path_s, fast_s, mean, 100.0 * difference / mean, 100.0 * sqrt(noise2) / mean);
    print(b->fabric->name, "flat492_rel_rms", sqrt(fmax(0.0, error2 - noise2)) / mean, "", "lower");
}

/* ---- draped ---- */

static const struct configuration drape_view = {.light_theta_rad = 50 * RAD_PER_DEG,
                                                .light_phi_rad = 0,
                                                .camera_theta_rad = 35 * RAD_PER_DEG,
                                                .camera_phi_rad = 200 * RAD_PER_DEG,
                                                .light_distance_m = 0.61,
                                                .lamp_side_m = 0.1,
                                                .camera_distance_m = 1.0,
                                                .crop_m = 0.036};

static void write_png(struct bench *b, bool fast, const char *how)
{
    char file[512];
    struct error err = {0};
    struct image im = {0};
    const struct render_request q = {.input = input_of(b, b->drape, fast),
                                     .configuration = &drape_view,
                                     .width = option.px,
                                     .height = option.px,
                                     .n_sample = fast ? option.n_fast_sample : option.n_path_sample,
                                     .seed = 5,
                                     .stream = fast};
    if (option.png == NULL) return;
    check(render_run(&q, pool, NULL, &im, &err), &err);
    snprintf(file, sizeof file, "%s/%s-%s.png", option.png, b->fabric->name, how);
    check(image_write_png(&im, 2.0, file, &err), &err);
    image_release(&im);
}

static struct field_speedup compare_drape(struct bench *b, const char *how, double share)
{
    char name[64];
    struct error err = {0};
    struct field_speedup s;
    const struct field_pair_request q = {.name = name,
                                         .input = {input_of(b, b->drape, false), input_of(b, b->drape, true)},
                                         .configuration = &drape_view,
                                         .share = share,
                                         .n_side = option.n_field,
                                         .error = 0.03,
                                         .most_s = option.most_s};
    snprintf(name, sizeof name, "%s %s", b->fabric->name, how);
    check(field_pair_compare(&q, pool, &s, &err), &err);
    return s;
}

static void bench_drape(struct bench *b)
{
    struct mesh m = {0};
    struct error err = {0};
    check(mesh_drape(40, 10, NULL, &m, &err), &err);
    check(scene_bend(b->flat, &m, true, &b->drape, &err), &err);
    mesh_release(&m);
    const struct field_speedup s = compare_drape(b, "drape", FIELD_SHARE);
    print(b->fabric->name, "speedup_at_3pct", s.value, "", "higher");
    print(b->fabric->name, "speedup_at_3pct_least", s.least, "", "higher");
    for (double wide = 2.0; option.wide && wide <= 8.0; wide *= 2.0) compare_drape(b, "drape", wide * FIELD_SHARE);
    write_png(b, false, "path");
    write_png(b, true, "fast");
    if (option.cells_too) {
        b->fast.deep = false;
        compare_drape(b, "drape by cells", FIELD_SHARE);
        write_png(b, true, "cells");
    }
    scene_free(b->drape);
}

static void bench_fabric(const char *name)
{
    struct bench b = {.fabric = fit_fabric_find(name)};
    const bool deep = option.deep > 0 && option.n_traced == 0 && !option.by_tables;
    if (b.fabric == NULL || !appearance_find(b.fabric->model_id, &b.model) || b.model.kind != MODEL_SURFACE) {
        fprintf(stderr, "no such fabric: %s\n", name);
        exit(2);
    }
    for (size_t p = 0; p < b.model.n_param; p++)
        b.param[p] = param_from_file_unit(&b.model.param[p], b.fabric->truth[p]);
    b.fast = (struct fast_option){.tables = &b.tables,
                                  .visibility = option.by_tables ? FAST_TABLES : FAST_TRACED,
                                  .n_traced = deep ? option.deep : option.n_traced,
                                  .deep = deep};
    make_cloth(&b);
    if (option.dual > 0)
        make_averages(&b);
    else
        make_tables(&b);
    if (!option.no_flat) bench_flat(&b);
    if (!option.no_drape) bench_drape(&b);
    fast_tables_release(&b.tables);
    dual_tables_release(&b.averages);
    scene_free(b.flat);
    fiber_set_release(&b.fiber);
}

/* An option with a number; false: there is none of that name. */
static bool take_number(const char *name, double number)
{
    const struct {
        const char *name;
        size_t *count;
        uint32_t *small;
        double *number;
    } known[] = {{"--px", &option.px, NULL, NULL},
                 {"--path-samples", &option.n_path_sample, NULL, NULL},
                 {"--fast-samples", &option.n_fast_sample, NULL, NULL},
                 {"--flat-paths", &option.n_flat_path, NULL, NULL},
                 {"--yarns", &option.n_yarn, NULL, NULL},
                 {"--fields", &option.n_field, NULL, NULL},
                 {"--most-seconds", NULL, NULL, &option.most_s},
                 {"--paths", NULL, &option.n_path, NULL},
                 {"--order", NULL, &option.order, NULL},
                 {"--deep", NULL, &option.deep, NULL},
                 {"--deep-edge", NULL, &option.deep_edge, NULL},
                 {"--deep-paths", NULL, NULL, &option.deep_paths},
                 {"--traced", NULL, &option.n_traced, NULL},
                 {"--cell-paths", NULL, NULL, &option.cell_paths},
                 {"--dual", NULL, NULL, &option.dual}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        if (strcmp(name, known[i].name) != 0) continue;
        if (known[i].count != NULL) *known[i].count = (size_t)number;
        if (known[i].small != NULL) *known[i].small = (uint32_t)number;
        if (known[i].number != NULL) *known[i].number = number;
        return true;
    }
    return false;
}

static bool take_flag(const char *name)
{
    const struct {
        const char *name;
        bool *flag;
    } known[] = {{"--no-flat", &option.no_flat},
                 {"--no-drape", &option.no_drape},
                 {"--no-visibility", &option.no_visibility},
                 {"--by-tables", &option.by_tables},
                 {"--cells-too", &option.cells_too},
                 {"--wide", &option.wide}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (strcmp(name, known[i].name) == 0) return *known[i].flag = true;
    return false;
}

int main(int argc, char **argv)
{
    static const char *const all[] = {"gabardine", "fleece", "silk"};
    const char *fabric[8];
    size_t n = 0;
    struct error err = {0};
    for (int i = 1; i < argc; i++) {
        if (strncmp(argv[i], "--", 2) != 0 && n < 8)
            fabric[n++] = argv[i];
        else if (take_flag(argv[i]))
            continue;
        else if (i + 1 < argc && strcmp(argv[i], "--png") == 0)
            option.png = argv[++i];
        else if (i + 1 < argc && strcmp(argv[i], "--tables") == 0)
            option.tables = argv[++i];
        else if (i + 1 < argc && take_number(argv[i], strtod(argv[i + 1], NULL)))
            i++;
        else {
            fprintf(stderr, "bench_pictures: unknown argument '%s'\n", argv[i]);
            return 2;
        }
    }
    check(thread_pool_new(0, &pool, &err), &err);
    for (size_t i = 0; i < (n > 0 ? n : 3); i++) bench_fabric(n > 0 ? fabric[i] : all[i]);
    thread_pool_free(pool);
    return 0;
}
