/* Accuracy of reconstructed fibers on phantoms of all weaves (definitions: geometry/phantom/compare.h). Prints one JSON
 * object on each line.
 *
 *   geometry.<weave>.d<diameter in voxels>.snr<signal-to-noise>.<figure>, where <figure> is
 *       precision, recall, length_recovered      shares
 *       fragments_per_fiber, merges              counts per fiber
 *       centerline_rms_voxel, direction_mean_deg, direction_p95_deg
 *       radius_bias                              |found / true - 1|
 *   geometry.weave_ct.axis_class_accuracy        share of the labelled tow voxels of a real weave in the right class
 *
 * bench_geometry [--pictures DIR] [TEXT...]
 *   TEXT   run only those of plain.d4.snr2 ... felt.d12.snr5 and weave_ct whose name contains a TEXT
 *   DIR    slices with the fibers drawn on them are written there
 * Progress, times and counts go to standard error.
 */
#include "tests/support/cloth/weave_labels.h"
#include "tests/support/scan/phantom_reconstruction.h"

#include <math.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const enum phantom_weave weave[] = {PHANTOM_PLAIN, PHANTOM_TWILL_2_2, PHANTOM_SATIN_5,
                                           PHANTOM_KNIT,  PHANTOM_VELVET,    PHANTOM_FELT};
static const int diameter[] = {4, 7, 12}, snr[] = {2, 5};

struct selection {
    char **text;
    int n;
    const char *pictures;
};

static bool selected(const struct selection *s, const char *name)
{
    for (int i = 0; i < s->n; i++)
        if (strstr(name, s->text[i]) != NULL) return true;
    return s->n == 0;
}

static void print(const char *name, const char *what, double value, const char *unit, const char *better)
{
    if (isfinite(value))
        printf("{\"name\":\"geometry.%s.%s\",\"value\":%.5g,\"unit\":\"%s\",\"better\":\"%s\"}\n", name, what, value,
               unit, better);
    else
        printf("{\"name\":\"geometry.%s.%s\",\"value\":null,\"unit\":\"%s\",\"better\":\"%s\"}\n", name, what, unit,
               better);
    fflush(stdout);
}

static status write_pictures(const char *folder, const char *name, const struct volume *v, const struct fiber_set *f,
                             struct error *err)
{
    status s = STATUS_OK;
    for (int axis = 0; axis < 3 && s == STATUS_OK; axis++) {
        char path[4096];
        uint8_t *rgb = NULL;
        size_t width, height;
        snprintf(path, sizeof path, "%s/%s_%c.png", folder, name, "xyz"[axis]);
        s = reconstruct_slice_picture(v, f, axis, v->n[axis] / 2, &rgb, &width, &height, err);
        if (s != STATUS_OK) return s;
        png_image image = {.version = PNG_IMAGE_VERSION,
                           .width = (png_uint_32)width,
                           .height = (png_uint_32)height,
                           .format = PNG_FORMAT_RGB};
        if (!png_image_write_to_file(&image, path, 0, rgb, 0, NULL))
            s = error_set(err, STATUS_IO, "cannot write '%s': %s", path, image.message);
        free(rgb);
    }
    return s;
}

static status bench_phantom(const struct selection *s, const char *name, enum phantom_weave w, int d, int noise,
                            struct error *err)
{
    struct phantom_option o;
    struct phantom_reconstruction r = {0};
    phantom_cloth_of_diameter(&o, w, d);
    reconstruct_option_default(&r.option);
    status st = phantom_reconstruct(&o, noise, &r, err);
    if (st == STATUS_OK && s->pictures != NULL) st = write_pictures(s->pictures, name, &r.v, &r.found, err);
    const struct compare_report *c = &r.compare;
    if (st == STATUS_OK) {
        fprintf(stderr,
                "%s: %zu x %zu x %zu voxels, %zu true fibers (%zu pieces), %zu found, %.1f s, diameter measured %.2f, "
                "radius %+.1f %%\n",
                name, r.v.n[0], r.v.n[1], r.v.n[2], c->n_true, c->n_true_piece, c->n_found, r.wall_s,
                r.report.fiber_diameter_voxel, c->radius_bias_percent);
        print(name, "precision", c->center_precision, "1", "higher");
        print(name, "recall", c->center_recall, "1", "higher");
        print(name, "centerline_rms_voxel", c->centerline_rms_voxel, "voxel", "lower");
        print(name, "length_recovered", c->length_recovered, "1", "higher");
        print(name, "fragments_per_fiber", c->fragments_per_fiber, "1", "lower");
        print(name, "merges", c->merges_per_fiber, "1", "lower");
        print(name, "direction_mean_deg", c->direction_mean_deg, "deg", "lower");
        print(name, "direction_p95_deg", c->direction_p95_deg, "deg", "lower");
        print(name, "radius_bias", 0.01 * fabs(c->radius_bias_percent), "1", "lower");
    }
    phantom_reconstruction_release(&r);
    return st;
}

static status bench_weave_ct(const struct selection *select, struct error *err)
{
    const char *folder = getenv("SELVEDGE_DATA");
    char scan[4096], label[4096];
    snprintf(scan, sizeof scan, "%s/weave-ct/small_weave.tif", folder != NULL ? folder : "../shared/data");
    snprintf(label, sizeof label, "%s/weave-ct/labels.tif", folder != NULL ? folder : "../shared/data");
    if (access(scan, R_OK) != 0 || access(label, R_OK) != 0) {
        fprintf(stderr, "skipped geometry.weave_ct: no '%s' (set SELVEDGE_DATA)\n",
                access(scan, R_OK) != 0 ? scan : label);
        return STATUS_OK;
    }
    struct thread_pool *pool = NULL;
    struct reconstruct_option o;
    struct reconstruct_report r = {0};
    struct volume v = {0};
    struct direction_volume d = {0};
    struct fiber_set f;
    const char *path = scan;
    double accuracy = NAN, kept = NAN;
    fiber_set_init(&f);
    reconstruct_option_default(&o);
    snprintf(o.axes, sizeof o.axes, "zxy");
    for (int a = 0; a < 3; a++) o.voxel_size_m[a] = 2e-6;
    status s = thread_pool_new(0, &pool, err);
    if (s == STATUS_OK) s = reconstruct_read(&path, 1, &o, 0, pool, NULL, &v, &r, err);
    if (s == STATUS_OK) s = reconstruct_orientation(&v, &o, pool, NULL, &d, &r, err);
    if (s == STATUS_OK) s = reconstruct_fibers(&v, &d, &o, pool, NULL, &f, &r, err);
    if (s == STATUS_OK) s = reconstruct_transfer(&f, &d, pool, NULL, &r, err);
    if (s == STATUS_OK) s = weave_label_accuracy(&d, label, &accuracy, &kept, err);
    if (s == STATUS_OK && select->pictures != NULL) s = write_pictures(select->pictures, "weave_ct", &v, &f, err);
    if (s == STATUS_OK) {
        fprintf(stderr, "weave_ct: %zu fibers, %.1f %% of the labelled tow voxels kept\n", f.n_fiber, 100.0 * kept);
        print("weave_ct", "axis_class_accuracy", accuracy, "1", "higher");
    }
    volume_release(&v);
    direction_volume_release(&d);
    fiber_set_release(&f);
    thread_pool_free(pool);
    return s;
}

int main(int argc, char **argv)
{
    struct selection select = {argv + 1, argc - 1, NULL};
    struct error err = {0};
    status s = STATUS_OK;
    if (argc > 2 && strcmp(argv[1], "--pictures") == 0) select = (struct selection){argv + 3, argc - 3, argv[2]};
    for (size_t w = 0; w < sizeof weave / sizeof *weave; w++)
        for (size_t d = 0; d < sizeof diameter / sizeof *diameter; d++)
            for (size_t n = 0; n < sizeof snr / sizeof *snr && s == STATUS_OK; n++) {
                char name[64];
                snprintf(name, sizeof name, "%s.d%d.snr%d", phantom_weave_name(weave[w]), diameter[d], snr[n]);
                if (!selected(&select, name)) continue;
                s = bench_phantom(&select, name, weave[w], diameter[d], snr[n], &err);
                if (s != STATUS_OK) fprintf(stderr, "bench_geometry: %s: %s\n", name, err.text);
            }
    if (s == STATUS_OK && selected(&select, "weave_ct")) {
        s = bench_weave_ct(&select, &err);
        if (s != STATUS_OK) fprintf(stderr, "bench_geometry: weave_ct: %s\n", err.text);
    }
    return s == STATUS_OK ? 0 : 1;
}
