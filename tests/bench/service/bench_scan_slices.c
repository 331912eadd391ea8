/* Results of a scan for a viewer of its slices, of the size of Fleece unless another is given: what bench_dashboard.py
 * puts in the place of a job's results, because the reconstruction itself takes five minutes. Prints one JSON object a
 * line.
 *
 *   dashboard.slices.{make_cpu_s,make_s,bytes,bytes_per_voxel}   of scan/{x,y,z}.slices
 *   dashboard.slices.contrast_cpu_s                              of scan/contrast.u8
 *
 * bench_scan_slices DIR [EDGE]
 *   DIR    gets scan/
 *   EDGE   of the felt's tile in voxels, 540 by default
 * The directions are those of the phantom's fibers, and the densities have noise of a signal-to-noise ratio of 5.
 */
#include "base/clock.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/phantom/phantom.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/volume/slice_tiles.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

static const double VOXEL_M = 2e-6, DIAMETER_VOXEL = 5.0;
static const float MATERIAL = 0.3f;

static void figure(const char *name, double value, const char *unit)
{
    printf("{\"name\": \"dashboard.slices.%s\", \"value\": %.6g, \"unit\": \"%s\", \"better\": \"lower\"}\n", name,
           value, unit);
    fflush(stdout);
}

static status make_scan(size_t edge, struct thread_pool *pool, struct fiber_set *f, struct volume *v, struct error *err)
{
    struct phantom_option o;
    struct phantom_scan_option scan;
    struct phantom_report r;
    phantom_option_default(&o, PHANTOM_FELT);
    phantom_scan_option_default(&scan);
    o.voxel_size_m = scan.voxel_size_m = VOXEL_M;
    for (int a = 0; a < 3; a++) o.fiber_radius_m[a] = 0.5 * DIAMETER_VOXEL * VOXEL_M;
    o.n_fiber_per_yarn = (size_t)(1600.0 * pow((double)edge / 540.0, 2.0));
    o.n_relax = 6;
    o.felt_tile_m = o.felt_thickness_m = (double)edge * VOXEL_M;
    scan.snr = 5.0;
    status s = phantom_generate(&o, pool, NULL, f, &r, err);
    if (s == STATUS_OK) s = phantom_pad(f, &r, VOXEL_M, r.n_voxel[2] + edge / 14, err);
    return s == STATUS_OK ? phantom_scan(f, r.n_voxel, &scan, pool, NULL, v, err) : s;
}

/* Directions of the fibers in the voxels of material. */
static status make_directions(const struct fiber_set *f, const struct volume *v, struct thread_pool *pool,
                              struct direction_volume *d, struct error *err)
{
    static const float up[3] = {0.0f, 0.0f, 1.0f};
    struct reconstruct_report report;
    status s = direction_volume_init(d, v->n, v->voxel_size_m, err);
    for (size_t i = 0; s == STATUS_OK && i < volume_n_voxel(v->n); i++) {
        if (v->density[i] < MATERIAL) continue;
        d->density[i] = (uint8_t)(255.0f * fminf(1.0f, v->density[i]));
        direction_volume_set(d, i, up);
    }
    return s == STATUS_OK ? reconstruct_transfer(f, d, pool, NULL, &report, err) : s;
}

static status write_slices(const char *folder, const struct volume *v, const struct direction_volume *d,
                           struct thread_pool *pool, struct error *err)
{
    struct slice_codes codes;
    struct stat made;
    char path[512];
    double cpu_s = clock_process_s(), start_s = clock_monotonic_s(), n_byte = 0.0;
    status s = slice_codes_make(v, d, SLICE_MOST_VOXEL, pool, NULL, &codes, err);
    for (int axis = 0; axis < 3 && s == STATUS_OK; axis++) {
        snprintf(path, sizeof path, "%s/scan/%c.slices", folder, "xyz"[axis]);
        s = slice_tiles_write(&codes, axis, pool, NULL, path, err);
        n_byte += stat(path, &made) == 0 ? (double)made.st_size : 0.0;
    }
    slice_codes_release(&codes);
    if (s != STATUS_OK) return s;
    fprintf(stderr, "%zu x %zu x %zu voxels\n", v->n[0], v->n[1], v->n[2]);
    figure("make_cpu_s", clock_process_s() - cpu_s, "s");
    figure("make_s", clock_monotonic_s() - start_s, "s");
    figure("bytes", n_byte, "bytes");
    figure("bytes_per_voxel", n_byte / (double)volume_n_voxel(v->n), "bytes");
    return STATUS_OK;
}

static status write_contrast(const char *folder, const struct volume *v, const struct fiber_set *f,
                             struct thread_pool *pool, struct error *err)
{
    char path[512];
    float *contrast = malloc(f->n_vertex * sizeof *contrast);
    double cpu_s = clock_process_s();
    status s = contrast == NULL ? error_set(err, STATUS_NO_MEMORY, "out of memory")
                                : scan_grade_contrast(v, f, pool, NULL, contrast, err);
    if (s == STATUS_OK) figure("contrast_cpu_s", clock_process_s() - cpu_s, "s");
    snprintf(path, sizeof path, "%s/scan/contrast.u8", folder);
    FILE *file = s == STATUS_OK ? fopen(path, "wb") : NULL;
    for (size_t i = 0; file != NULL && i < f->n_vertex; i++)
        fputc((int)lrint(100.0 * fmin(2.55, fmax(0.0, (double)contrast[i]))), file);
    if (s == STATUS_OK && (file == NULL || fclose(file) != 0)) s = error_set_errno(err, "cannot write '%s'", path);
    free(contrast);
    return s;
}

int main(int argc, char **argv)
{
    struct fiber_set f;
    struct volume v = {0};
    struct direction_volume d = {0};
    struct thread_pool *pool = NULL;
    struct error err = {0};
    char path[512];
    if (argc < 2) return 2;
    fiber_set_init(&f);
    snprintf(path, sizeof path, "%s/scan", argv[1]);
    mkdir(path, 0777);
    status s = thread_pool_new(0, &pool, &err);
    if (s == STATUS_OK) s = make_scan(argc > 2 ? (size_t)strtoul(argv[2], NULL, 10) : 540, pool, &f, &v, &err);
    if (s == STATUS_OK) s = make_directions(&f, &v, pool, &d, &err);
    if (s == STATUS_OK) s = write_slices(argv[1], &v, &d, pool, &err);
    if (s == STATUS_OK) s = write_contrast(argv[1], &v, &f, pool, &err);
    snprintf(path, sizeof path, "%s/scan/fibers.hair", argv[1]);
    if (s == STATUS_OK) s = fiber_set_write_hair(&f, path, &err);
    if (s != STATUS_OK) fprintf(stderr, "bench_scan_slices: %s\n", err.text);
    direction_volume_release(&d);
    volume_release(&v);
    fiber_set_release(&f);
    thread_pool_free(pool);
    return s == STATUS_OK ? 0 : 1;
}
