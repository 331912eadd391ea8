/* Time and memory of reconstructions of different sizes, with the default memory limit of 2 GiB. Prints one JSON object
 * on each line.
 *
 *   geometry.{thin,cotton,fleece,1024,2048}.{wall_s,cpu_s,peak_bytes,material_voxels,material_share}
 *       From the scan's file to transferred directions, at a signal-to-noise ratio of 5. peak_bytes is the largest
 *       resident memory of the process, without the files that it reads and writes.
 *         thin     112 x 112 x 48 voxels, twill with fibers of 4 voxels, which are traced in a finer grid
 *         cotton   461 x 440 x 160 voxels, plain weave
 *         fleece   500 x 540 x 586 voxels, felt with fibers of 5 voxels that fill a fifth of the volume
 *         1024     1024 x 1024 x 1024 voxels, twill with void above and below
 *         2048     2048 x 2048 x 2048 voxels of a byte, the same of 40 x 40 yarns; the void beyond 256 slices repeats
 *                  that of these slices, so that the scan can be made without a file of 34 GB
 *   geometry.fleece.{quarter,half,full}.cpu_us_per_material_voxel
 *       Parts of the same scan. The figures are equal when time is linear in the material.
 *
 * bench_geometry_size [--folder DIR] [NAME...]
 *   NAME   run only these
 *   DIR    scans (up to 8.6 GB) are kept there and used again the next time; otherwise they are temporary
 * Progress goes to standard error.
 */
#include "base/clock.h"
#include "geometry/phantom/phantom.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/volume/tile_crop.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static const size_t MEMORY_BYTES = (size_t)2 << 30;
static const double VOXEL_M = 2e-6;

struct sample {
    const char *name;
    enum phantom_weave weave;
    size_t n_yarn, n_fiber, n_relax,
        n[3]; /* n_fiber: of a yarn; felt: in all. n: of the cropped scan; n[2]: with void */
    double diameter_voxel, cover, tile_voxel, thickness_voxel;
    size_t n_made; /* slices that are made; the others repeat the void of them. 0: all */
};

static const struct sample sample[] = {
    {"thin", PHANTOM_TWILL_2_2, 4, 19, 150, {112, 112, 48}, 4.0, 1.05, 0.0, 0.0},
    {"cotton", PHANTOM_PLAIN, 10, 19, 150, {461, 440, 160}, 7.0, 1.05, 0.0, 0.0},
    {"fleece", PHANTOM_FELT, 0, 1600, 6, {500, 540, 586}, 5.0, 0.0, 540.0, 540.0},
    {"1024", PHANTOM_TWILL_2_2, 20, 19, 100, {1024, 1024, 1024}, 7.0, 1.0182, 0.0, 0.0},
    {"2048", PHANTOM_TWILL_2_2, 40, 19, 100, {2048, 2048, 2048}, 7.0, 1.0182, 0.0, 0.0, .n_made = 256},
};

struct outcome {
    status s;
    double wall_s, cpu_s;
    size_t peak_bytes;
    struct reconstruct_report report;
    char text[640];
};

/* Writes n voxels of the scan as bytes without a header: the slices of v in the middle, cropped to n[0] x n[1], and
 * void from its ends, of which it has PAD slices at least. */
static status write_bytes(const struct volume *v, const size_t n[3], const char *path, struct error *err)
{
    enum { PAD = 32 };
    const size_t n_page = n[0] * n[1], below = (n[2] - v->n[2]) / 2;
    uint8_t *page = malloc(n_page);
    FILE *file = fopen(path, "wb");
    bool ok = page != NULL && file != NULL;
    for (size_t k = 0; k < n[2] && ok; k++) {
        const size_t slice = k < below ? k % PAD : k < below + v->n[2] ? k - below : v->n[2] - 1 - k % PAD;
        for (size_t j = 0; j < n[1]; j++) {
            const float *from = v->density + volume_index(v->n, 0, j, slice);
            for (size_t i = 0; i < n[0]; i++)
                page[j * n[0] + i] = (uint8_t)fminf(fmaxf(40.0f + 160.0f * from[i], 0.0f), 255.0f);
        }
        ok = fwrite(page, 1, n_page, file) == n_page;
        scratch_keep_within(v->space);
    }
    if (file != NULL) ok = fclose(file) == 0 && ok;
    free(page);
    return ok ? STATUS_OK : error_set_errno(err, "cannot write '%s'", path);
}

static status make_scan(const struct sample *p, const char *folder, const char *path, struct error *err)
{
    struct phantom_option o;
    struct phantom_scan_option scan;
    struct phantom_file_option file;
    struct phantom_report r;
    struct fiber_set f;
    struct volume v = {0};
    struct thread_pool *pool = NULL;
    struct scratch_space *space = NULL;
    fiber_set_init(&f);
    phantom_option_default(&o, p->weave);
    phantom_scan_option_default(&scan);
    phantom_file_option_default(&file);
    file.deflate = false;
    o.voxel_size_m = scan.voxel_size_m = VOXEL_M;
    for (int a = 0; a < 3; a++) o.fiber_radius_m[a] = 0.5 * p->diameter_voxel * VOXEL_M;
    if (p->n_yarn > 0) o.n_yarn[0] = o.n_yarn[1] = p->n_yarn;
    o.n_fiber_per_yarn = p->n_fiber;
    o.n_relax = p->n_relax;
    if (p->cover > 0.0) o.cover = p->cover;
    o.felt_tile_m = p->tile_voxel > 0.0 ? p->tile_voxel * VOXEL_M : o.felt_tile_m;
    o.felt_thickness_m = p->thickness_voxel > 0.0 ? p->thickness_voxel * VOXEL_M : o.felt_thickness_m;
    status s = thread_pool_new(0, &pool, err);
    if (s == STATUS_OK) s = scratch_space_new(folder, MEMORY_BYTES, &space, err);
    if (s == STATUS_OK) s = phantom_generate(&o, pool, NULL, &f, &r, err);
    if (s == STATUS_OK) s = phantom_pad(&f, &r, VOXEL_M, p->n_made > 0 ? p->n_made : p->n[2], err);
    if (s == STATUS_OK && (r.n_voxel[0] < p->n[0] || r.n_voxel[1] < p->n[1]))
        s = error_set(err, STATUS_INTERNAL, "the phantom has only %zu x %zu voxels", r.n_voxel[0], r.n_voxel[1]);
    if (s == STATUS_OK) s = phantom_scan_in(&f, r.n_voxel, &scan, space, pool, NULL, &v, err);
    /* the tile of a phantom is at least as large as the scan */
    if (s == STATUS_OK && p->n_made == 0) volume_crop(&v, (const size_t[6]){0, 0, 0, p->n[0], p->n[1], p->n[2]});
    if (s == STATUS_OK && p->n_made > 0)
        s = write_bytes(&v, p->n, path, err);
    else if (s == STATUS_OK)
        s = phantom_write_tiff(&v, &file, path, err);
    volume_release(&v);
    scratch_space_free(space);
    fiber_set_release(&f);
    thread_pool_free(pool);
    return s;
}

static status reconstruct(const struct sample *p, const char *path, const size_t n[3], const char *folder,
                          struct reconstruct_report *report, struct error *err)
{
    struct reconstruct_option o;
    struct volume v = {0};
    struct direction_volume d = {0};
    struct fiber_set f;
    struct thread_pool *pool = NULL;
    struct scratch_space *space = NULL;
    double t[5] = {clock_monotonic_s()};
    fiber_set_init(&f);
    reconstruct_option_default(&o);
    for (int a = 0; a < 3; a++) {
        o.voxel_size_m[a] = VOXEL_M;
        if (n[a] < p->n[a]) memcpy(o.crop_voxel + 3, n, 3 * sizeof *n);
        if (p->n_made > 0) o.raw.n[a] = n[a];
    }
    snprintf(o.raw.type, sizeof o.raw.type, "uint8");
    status s = thread_pool_new(0, &pool, err);
    if (s == STATUS_OK) s = scratch_space_new(folder, MEMORY_BYTES, &space, err);
    if (s == STATUS_OK) s = reconstruct_read(&path, 1, &o, space, pool, NULL, &v, report, err);
    if (s == STATUS_OK) s = reconstruct_refill_lumens(&v, &o, pool, NULL, report, err);
    t[1] = clock_monotonic_s();
    if (s == STATUS_OK) s = reconstruct_orientation(&v, &o, pool, NULL, &d, report, err);
    if (s == STATUS_OK) s = reconstruct_redirect(&v, &d, &o, pool, NULL, report, err);
    t[2] = clock_monotonic_s();
    if (s == STATUS_OK) s = reconstruct_fibers(&v, &d, &o, pool, NULL, &f, report, err);
    t[3] = clock_monotonic_s();
    if (s == STATUS_OK) s = reconstruct_transfer(&f, &d, pool, NULL, report, err);
    t[4] = clock_monotonic_s();
    fprintf(stderr,
            "%zu x %zu x %zu: read %.1f s, orientation %.1f s, fibers %.1f s, transfer %.1f s; %zu fibers, %zu "
            "vertices, %.2f GB in files\n",
            n[0], n[1], n[2], t[1] - t[0], t[2] - t[1], t[3] - t[2], t[4] - t[3], f.n_fiber, f.n_vertex,
            1e-9 * (double)scratch_file_bytes(space));
    volume_release(&v);
    direction_volume_release(&d);
    fiber_set_release(&f);
    scratch_space_free(space);
    thread_pool_free(pool);
    return s;
}

/* Runs in a process of its own, whose memory is measured. n NULL: makes the scan, otherwise reconstructs n voxels of
 * it. */
static struct outcome in_child(const struct sample *p, const size_t *n, const char *folder, const char *path)
{
    struct outcome o = {.s = STATUS_INTERNAL, .text = "the process died"};
    int end[2], state;
    fflush(stdout);
    if (pipe(end) != 0) return o;
    double start = clock_monotonic_s();
    pid_t pid = fork();
    if (pid == 0) {
        struct error err = {0};
        o.s = n == NULL ? make_scan(p, folder, path, &err) : reconstruct(p, path, n, folder, &o.report, &err);
        snprintf(o.text, sizeof o.text, "%s", err.text);
        o.cpu_s = clock_process_s();
        ssize_t put = write(end[1], &o, sizeof o);
        _exit(put == (ssize_t)sizeof o ? 0 : 1);
    }
    close(end[1]);
    struct outcome told;
    if (pid > 0 && read(end[0], &told, sizeof told) == (ssize_t)sizeof told) o = told;
    close(end[0]);
    struct rusage usage = {0};
    if (pid > 0) wait4(pid, &state, 0, &usage);
    o.wall_s = clock_monotonic_s() - start;
    o.peak_bytes = (size_t)usage.ru_maxrss * 1024;
    return o;
}

static void print(const char *name, const char *what, double value, const char *unit, const char *better)
{
    printf("{\"name\":\"geometry.%s.%s\",\"value\":%.6g,\"unit\":\"%s\",\"better\":\"%s\"}\n", name, what, value, unit,
           better);
    fflush(stdout);
}

static bool failed(const struct sample *p, const struct outcome *o)
{
    if (o->s != STATUS_OK) fprintf(stderr, "bench_geometry_size: %s: %s\n", p->name, o->text);
    return o->s != STATUS_OK;
}

static bool bench(const struct sample *p, const char *folder)
{
    static const char *const part_name[] = {"full", "half", "quarter"};
    char path[4096];
    struct stat st;
    snprintf(path, sizeof path, "%s/%s.tif", folder, p->name);
    if (stat(path, &st) != 0) {
        struct outcome made = in_child(p, NULL, folder, path);
        if (failed(p, &made)) return false;
        fprintf(stderr, "%s: made in %.0f s, %.0f s of processor time, peak %.0f MB\n", p->name, made.wall_s,
                made.cpu_s, 1e-6 * (double)made.peak_bytes);
    }
    for (int part = 0; part < (strcmp(p->name, "fleece") == 0 ? 3 : 1); part++) {
        const size_t n[3] = {part == 2 ? p->n[0] / 2 : p->n[0], part >= 1 ? p->n[1] / 2 : p->n[1], p->n[2]};
        struct outcome o = in_child(p, n, folder, path);
        if (failed(p, &o)) return false;
        double material = (double)o.report.n_material_voxel, voxels = (double)n[0] * (double)n[1] * (double)n[2];
        if (part == 0) {
            print(p->name, "wall_s", o.wall_s, "s", "lower");
            print(p->name, "cpu_s", o.cpu_s, "s", "lower");
            print(p->name, "peak_bytes", (double)o.peak_bytes, "B", "lower");
            print(p->name, "material_voxels", material, "1", "higher");
            print(p->name, "material_share", material / voxels, "1", "higher");
        }
        if (strcmp(p->name, "fleece") == 0) {
            char what[64];
            snprintf(what, sizeof what, "%s.cpu_us_per_material_voxel", part_name[part]);
            print(p->name, what, 1e6 * o.cpu_s / material, "us", "lower");
        }
    }
    return true;
}

int main(int argc, char **argv)
{
    char temporary[] = "/var/tmp/selvedge-bench-XXXXXX";
    const char *folder = NULL;
    int first = 1, code = 0;
    if (argc > 2 && strcmp(argv[1], "--folder") == 0) {
        folder = argv[2];
        first = 3;
    }
    bool keep = folder != NULL;
    if (!keep) folder = mkdtemp(temporary);
    if (folder == NULL) {
        perror("bench_geometry_size: cannot make a folder");
        return 1;
    }
    for (size_t i = 0; i < sizeof sample / sizeof *sample; i++) {
        bool wanted = first >= argc;
        for (int a = first; a < argc; a++) wanted = wanted || strcmp(argv[a], sample[i].name) == 0;
        if (wanted && !bench(&sample[i], folder)) code = 1;
        char path[4096];
        snprintf(path, sizeof path, "%s/%s.tif", folder, sample[i].name);
        if (!keep) unlink(path);
    }
    if (!keep) rmdir(folder);
    return code;
}
