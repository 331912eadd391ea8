/* Accuracy of reconstructed fibers on phantoms of all weaves (definitions: geometry/phantom/compare.h). Prints one JSON
 * object on each line.
 *
 *   geometry.<weave>.d<diameter in voxels>.snr<signal-to-noise>.<figure>: fibers that are alike, white noise
 *       precision, recall, length_recovered      shares
 *       fragments_per_fiber, merges              counts per fiber
 *       centerline_rms_voxel, direction_mean_deg, direction_p95_deg
 *       radius_bias                              |found / true - 1|
 *       direction_volume_mean_deg, direction_volume_p95_deg, direction_volume_rim_mean_deg
 *           errors of direction.vol inside of the true fibers and around them (geometry/grade/compare_directions.h),
 *           here and below
 *       contrast, valley_depth, safe_share       the grade of the scan (geometry/grade/scan_grade.h), here and below
 *       rms_over_bound                           RMS of the axes over the least error of a center (bound_voxel), here
 *                                                and below
 *   geometry.<weave>.<condition>.<figure>: one of the conditions of the table below
 *       precision, recall, fragments, merges, axis_rms_voxel, direction_mean_deg, direction_p95_deg, radius_bias
 *       radius_rms                               root of the mean square of found / true - 1 of single fibers
 *       cpu_us_per_material_voxel                processor time of the reconstruction
 *       radius_along_rms                         as radius_rms, with the radius at each vertex
 *       axis_ratio_error, section_turn_deg       medians over the vertices of |found / true - 1| of the ratio of axes,
 *                                                and of the turn of the long axis where the true ratio is above 1.3
 *       lumen_rms, lumen_pull                    of found - true width of the lumen over that of the fiber; errors over
 *                                                the stated ones (geometry/grade/compare_sections.h)
 *   geometry.weave_ct.axis_class_accuracy        share of the labelled tow voxels of a real weave in the right class
 *
 * bench_geometry --bars 1 runs only the rows of the table `bar`, and fails where a figure is below its bar.
 *
 * bench_geometry [--pictures DIR] [--weaves NAMES] [--conditions NAMES] [--seed N] [--yarns N] [TEXT...]
 *   NAMES  comma-separated; run only these weaves, and only these conditions (d7.snr5 and the like are conditions too)
 *   seed   of cloth and scan, 1 by default
 *   yarns  in x and y of the tile, a multiple of the weave's repeat; fewer than by default are quicker
 *   TEXT   run only those of plain.d4.snr2 ... felt.thick and weave_ct whose name contains a TEXT
 *   DIR    slices with the fibers drawn on them are written there
 * Progress, times and counts go to standard error.
 */
#include "geometry/fibers/shape/section_summary.h"
#include "geometry/grade/compare_sections.h"
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

/* A cloth and a scan of it. A scan has a blur of 0.7 voxels. */
struct condition {
    const char *name;
    int plain; /* fibers that are alike and white noise, whose figures have their own names */
    double diameter_voxel, snr, radius_spread, noise_sd_voxel, beam_hardening, phase_fringes, slice_voxel;
    struct phantom_section_law section;
};

static const struct condition condition[] = {
    {"d4.snr2", 1, 4.0, 2.0, .radius_spread = 0.0},
    {"d4.snr5", 1, 4.0, 5.0, .radius_spread = 0.0},
    {"d7.snr2", 1, 7.0, 2.0, .radius_spread = 0.0},
    {"d7.snr5", 1, 7.0, 5.0, .radius_spread = 0.0},
    {"d12.snr2", 1, 12.0, 2.0, .radius_spread = 0.0},
    {"d12.snr5", 1, 12.0, 5.0, .radius_spread = 0.0},
    {"spread", 0, 7.0, 5.0, .radius_spread = 0.2, .noise_sd_voxel = 0.5},
    {"spread_snr2", 0, 7.0, 2.0, .radius_spread = 0.2, .noise_sd_voxel = 0.5},
    {"spread_d4", 0, 4.0, 5.0, .radius_spread = 0.2, .noise_sd_voxel = 0.5},
    {"spread_d12", 0, 12.0, 5.0, .radius_spread = 0.2, .noise_sd_voxel = 0.5},
    {"correlated_snr2", 0, 7.0, 2.0, .noise_sd_voxel = 0.5},
    {"hollow", 0, 7.0, 5.0, .section = {.seed = 1, .lumen = 0.4}},
    {"hollow_spread", 0, 7.0, 5.0, 0.2, 0.5, .section = {.seed = 1, .lumen = 0.4}},
    {"hollow_narrow", 0, 7.0, 5.0, 0.2, 0.5, .section = {.seed = 1, .lumen = 0.3}},
    {"hollow_snr3", 0, 7.0, 3.0, 0.2, 0.5, .section = {.seed = 1, .lumen = 0.4}},
    {"lumens", 0, 7.0, 5.0, 0.2, 0.5, .section = {.seed = 1, .lumen = 0.6, .lumen_spread = 1.0}},
    {"flat", 0, 7.0, 5.0, .section = {.seed = 1, .aspect = 2.5, .turns_per_m = 1e3}},
    {"flat_d4", 0, 4.0, 5.0, .section = {.seed = 1, .aspect = 2.5, .turns_per_m = 1e3}},
    {"cotton", 0, 7.0, 5.0, 0.15, 0.5, .section = {1, .lumen = 0.3, .aspect = 2.0, .bean = 0.3, .turns_per_m = 2e3}},
    {"taper", 0, 7.0, 5.0, .radius_spread = 0.15, .noise_sd_voxel = 0.5, .section = {.seed = 1, .taper = 0.4}},
    {"hardening", 0, 7.0, 5.0, .beam_hardening = 0.4},
    {"fringes", 0, 7.0, 5.0, .phase_fringes = 1.0},
    {"thick", 0, 7.0, 5.0, .slice_voxel = 1.5},
};

/* Rows that changes of the tracing have lost before: flat fibers when what no line explains was traced, thin ones when
 * parts of flat fibers were removed. The bars are the goals where there is one, and for the precision of flat fibers
 * half of the way from their loss (0.947, 0.919) to what they have. */
static const struct bar {
    const char *name;
    double precision, recall;
} bar[] = {{"plain.d4.snr5", 0.95, 0.85},
           {"velvet.d4.snr5", 0.95, 0.92},
           {"twill.flat", 0.97, 0.95},
           {"satin.flat", 0.945, 0.95}};

struct selection {
    char **text;
    int n;
    const char *pictures, *weaves, *conditions, *seed, *yarns, *bars; /* NULL: none, all, by default */
};

static const struct bar *bar_of(const char *name)
{
    for (size_t i = 0; i < sizeof bar / sizeof *bar; i++)
        if (strcmp(bar[i].name, name) == 0) return &bar[i];
    return NULL;
}

/* With --bars: fails where figures are below their bar. */
static status check_bar(const char *name, const struct compare_report *c, struct error *err)
{
    const struct bar *b = bar_of(name);
    if (b == NULL || (c->center_precision >= b->precision && c->center_recall >= b->recall)) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "precision %.3f and recall %.3f, but the bars are %.3f and %.3f",
                     c->center_precision, c->center_recall, b->precision, b->recall);
}

/* Returns the RMS distance in voxels between a fiber's center and the best unbiased estimate of it from ten voxels of
 * its length (the bound of Cramer and Rao): the fiber is a straight, solid disc of radius R, alone, of density 1,
 * whose edge has the blur b, in white noise of standard deviation s a voxel. Moved by x along an axis, the densities
 * change by -g(r - R) cos(angle) dx, where g is the Gaussian of standard deviation b and r the distance from the
 * center. The square of that, integrated over the plane, is the integral of cos^2 over the angle, pi, times R times
 * that of g^2, 1 / (2 b sqrt(pi)). So ten slices have the information 10 sqrt(pi) R / (2 b s^2) about each of two
 * coordinates. For d4.snr2, d7.snr5 and d7.snr2 the bound is 0.14, 0.04 and 0.11.
 *
 * Noise that is correlated by a Gaussian of standard deviation c is white noise and a disc of blur sqrt(b^2 - c^2),
 * seen through that Gaussian. As its strength stays, the white noise is stronger than s by the root of the Gaussian's
 * sum of squares over all three axes. */
static double bound_voxel(const struct condition *k, double blur)
{
    const double c = k->noise_sd_voxel, slices = 10.0 / fmax(1.0, k->slice_voxel);
    double sum = 1.0, squares = 1.0;
    for (int m = 1; m <= 4 && c > 0.0; m++) {
        const double w = exp(-0.5 * m * m / (c * c));
        sum += 2.0 * w;
        squares += 2.0 * w * w;
    }
    const double information = slices * sqrt(M_PI) * 0.5 * k->diameter_voxel * pow(squares / (sum * sum), 3.0) *
                               k->snr * k->snr / (2.0 * sqrt(blur * blur - c * c));
    return sqrt(2.0 / information);
}

/* Whether a comma-separated list has the name; NULL has all. */
static bool listed(const char *list, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = list; at != NULL && (at = strstr(at, name)) != NULL; at += length)
        if ((at == list || at[-1] == ',') && (at[length] == '\0' || at[length] == ',')) return true;
    return list == NULL;
}

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

static void print_figures(const char *name, const struct condition *k, double blur,
                          const struct phantom_reconstruction *r)
{
    const struct compare_report *c = &r->compare;
    print(name, "precision", c->center_precision, "1", "higher");
    print(name, "recall", c->center_recall, "1", "higher");
    print(name, k->plain ? "centerline_rms_voxel" : "axis_rms_voxel", c->centerline_rms_voxel, "voxel", "lower");
    if (k->plain) print(name, "length_recovered", c->length_recovered, "1", "higher");
    print(name, k->plain ? "fragments_per_fiber" : "fragments", c->fragments_per_fiber, "1", "lower");
    print(name, "merges", c->merges_per_fiber, "1", "lower");
    print(name, "direction_mean_deg", c->direction_mean_deg, "deg", "lower");
    print(name, "direction_p95_deg", c->direction_p95_deg, "deg", "lower");
    print(name, "direction_volume_mean_deg", r->transferred.inside.mean_deg, "deg", "lower");
    print(name, "direction_volume_p95_deg", r->transferred.inside.p95_deg, "deg", "lower");
    print(name, "direction_volume_rim_mean_deg", r->transferred.rim.mean_deg, "deg", "lower");
    print(name, "radius_bias", 0.01 * fabs(c->radius_bias_percent), "1", "lower");
    print(name, "volume_ratio_error", fabs(r->volume_ratio - 1.0), "1", "lower");
    print(name, "contrast", r->grade.contrast, "1", "higher");
    print(name, "valley_depth", r->grade.valley_depth, "1", "higher");
    print(name, "safe_share", r->grade.safe_share, "1", "higher");
    print(name, "rms_over_bound", c->centerline_rms_voxel / bound_voxel(k, blur), "1", "lower");
    if (k->plain) return;
    print(name, "radius_rms", 0.01 * c->radius_rms_percent, "1", "lower");
    print(name, "cpu_us_per_material_voxel", 1e6 * r->cpu_s / (double)r->report.n_material_voxel, "us", "lower");
}

/* What the transfer of directions changes. */
static void print_directions(const char *name, const struct phantom_reconstruction *r)
{
    const struct direction_compare *a = &r->filtered, *b = &r->transferred;
    fprintf(stderr,
            "%s: directions of voxels by the filter and after the transfer: mean %.2f, %.2f, 95 %% %.1f, %.1f inside, "
            "mean %.2f, %.2f, 95 %% %.1f, %.1f degrees in the rim; %.2f %% of the voxels inside are kept\n",
            name, a->inside.mean_deg, b->inside.mean_deg, a->inside.p95_deg, b->inside.p95_deg, a->rim.mean_deg,
            b->rim.mean_deg, a->rim.p95_deg, b->rim.p95_deg, 100.0 * b->kept_share);
}

/* Sections of the fibers that were found. */
static status print_sections(const char *name, bool plain, const struct phantom_reconstruction *r, struct error *err)
{
    const struct fiber_set *f = &r->found;
    struct section_summary s;
    struct section_compare c;
    status st = section_summary_make(f, r->report.radius_se_m[0], &s, err);
    if (st == STATUS_OK) st = compare_sections(&r->truth, f, &c, err);
    if (st == STATUS_OK)
        fprintf(
            stderr,
            "%s: ratios of axes %.2f, %.2f, %.2f (10, 50, 90 %%), median errors %.3f and %.1f degrees, %.0f %% flat; "
            "the radius of %zu of %zu fibers varies, by %.1f %% (error %.1f %%)\n",
            name, s.ratio_p10, s.ratio_median, s.ratio_p90, s.ratio_se_median, s.angle_se_median_rad * 180.0 / M_PI,
            100.0 * s.flat_share, s.n_varying, f->n_fiber, 100.0 * s.variation, 100.0 * s.variation_se_median);
    if (st == STATUS_OK)
        fprintf(stderr,
                "%s: sections: radius %.3f (bias %.3f, %.3f with one a fiber, error over stated %.1f), ratio of axes "
                "%.3f (bias %.3f, "
                "median %.3f, error over stated %.1f), turn %.1f degrees (median, error over stated %.1f)\n",
                name, c.radius_rms, c.radius_bias, c.mean_radius_rms, c.radius_pull, c.ratio_rms, c.ratio_bias,
                c.ratio_median, c.ratio_pull, c.turn_median_deg, c.turn_pull);
    if (st == STATUS_OK && r->report.lumens_measured)
        fprintf(stderr,
                "%s: lumens: RMS error %.3f, bias %.3f, error over stated %.1f, told of %.0f %% of the length\n", name,
                c.lumen_rms, c.lumen_bias, c.lumen_pull, 100.0 * c.lumen_share);
    if (st == STATUS_OK && !plain) {
        print(name, "radius_along_rms", c.radius_rms, "1", "lower");
        print(name, "axis_ratio_error", c.ratio_median, "1", "lower");
        print(name, "section_turn_deg", c.turn_median_deg, "deg", "lower");
    }
    if (st == STATUS_OK && r->report.lumens_measured) {
        print(name, "lumen_rms", c.lumen_rms, "1", "lower");
        print(name, "lumen_pull", c.lumen_pull, "1", "lower");
    }
    return st;
}

static status bench_phantom(const struct selection *s, const char *name, enum phantom_weave w,
                            const struct condition *k, struct error *err)
{
    struct phantom_option o;
    struct phantom_scan_option scan;
    struct phantom_reconstruction r = {.slice_voxel = k->slice_voxel};
    phantom_cloth_of_diameter(&o, w, k->diameter_voxel);
    o.radius_spread = k->radius_spread;
    o.section = k->section;
    phantom_scan_option_default(&scan);
    scan.snr = k->snr;
    scan.noise_sd_voxel = k->noise_sd_voxel;
    scan.beam_hardening = k->beam_hardening;
    scan.phase_fringes = k->phase_fringes;
    if (s->seed != NULL) o.seed = scan.seed = strtoull(s->seed, NULL, 10);
    if (s->seed != NULL && o.section.seed != 0) o.section.seed = o.seed;
    if (s->yarns != NULL) o.n_yarn[0] = o.n_yarn[1] = strtoul(s->yarns, NULL, 10);
    reconstruct_option_default(&r.option);
    status st = phantom_reconstruct_scan(&o, &scan, &r, err);
    if (st == STATUS_OK && s->pictures != NULL) st = write_pictures(s->pictures, name, &r.v, &r.found, err);
    const struct compare_report *c = &r.compare;
    if (st == STATUS_OK) {
        fprintf(stderr,
                "%s: %zu x %zu x %zu voxels, %zu true fibers (%zu pieces), %zu found, %.1f s, noise %.3f, smoothed by "
                "%.2f voxels to %.3f, diameter measured %.2f, radius %+.1f %%\n",
                name, r.v.n[0], r.v.n[1], r.v.n[2], c->n_true, c->n_true_piece, c->n_found, r.wall_s,
                r.report.noise.scan_sd, r.report.noise.smooth_voxel, r.report.noise.mapped_sd,
                r.report.fiber_diameter_voxel, c->radius_bias_percent);
        print_directions(name, &r);
        print_figures(name, k, scan.blur_sd_voxel, &r);
        st = print_sections(name, k->plain, &r, err);
        if (st == STATUS_OK && s->bars != NULL) st = check_bar(name, c, err);
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
    if (s == STATUS_OK) s = reconstruct_refill_lumens(&v, &o, pool, NULL, &r, err);
    if (s == STATUS_OK) s = reconstruct_orientation(&v, &o, pool, NULL, &d, &r, err);
    if (s == STATUS_OK) s = reconstruct_redirect(&v, &d, &o, pool, NULL, &r, err);
    if (s == STATUS_OK) s = reconstruct_fibers(&v, &d, &o, pool, NULL, &f, &r, err);
    float *safe = s == STATUS_OK ? malloc((f.n_fiber + 1) * sizeof *safe) : NULL;
    if (s == STATUS_OK) s = scan_grade_measure(&v, &f, pool, NULL, &r.grade, safe, err);
    if (s == STATUS_OK && r.grade.verdict == GRADE_UNRESOLVED) s = scan_grade_sort(&f, safe, &r.grade, err);
    free(safe);
    if (s == STATUS_OK) s = reconstruct_transfer(&f, &d, pool, NULL, &r, err);
    if (s == STATUS_OK) s = weave_label_accuracy(&d, label, &accuracy, &kept, err);
    if (s == STATUS_OK && select->pictures != NULL) s = write_pictures(select->pictures, "weave_ct", &v, &f, err);
    if (s == STATUS_OK) {
        print("weave_ct", "contrast", r.grade.contrast, "1", "lower");
        print("weave_ct", "valley_depth", r.grade.valley_depth, "1", "lower");
        print("weave_ct", "safe_share", r.grade.safe_share, "1", "lower");
        fprintf(stderr, "weave_ct: %zu fibers, %zu left out, %.1f %% of the labelled tow voxels kept\n", f.n_fiber,
                r.grade.n_dropped, 100.0 * kept);
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
    struct selection select = {0};
    struct error err = {0};
    status s = STATUS_OK;
    const struct {
        const char *name, **value;
    } setting[] = {{"--pictures", &select.pictures}, {"--weaves", &select.weaves}, {"--conditions", &select.conditions},
                   {"--seed", &select.seed},         {"--yarns", &select.yarns},   {"--bars", &select.bars}};
    int at = 1;
    for (; at + 1 < argc && strncmp(argv[at], "--", 2) == 0; at += 2)
        for (size_t i = 0; i < sizeof setting / sizeof *setting; i++)
            if (strcmp(argv[at], setting[i].name) == 0) *setting[i].value = argv[at + 1];
    select.text = argv + at;
    select.n = argc - at;
    size_t n_row = 0;
    for (size_t w = 0; w < sizeof weave / sizeof *weave; w++)
        for (size_t k = 0; k < sizeof condition / sizeof *condition && s == STATUS_OK; k++) {
            char name[64];
            snprintf(name, sizeof name, "%s.%s", phantom_weave_name(weave[w]), condition[k].name);
            if (!selected(&select, name) || !listed(select.weaves, phantom_weave_name(weave[w])) ||
                !listed(select.conditions, condition[k].name) || (select.bars != NULL && bar_of(name) == NULL))
                continue;
            n_row++;
            s = bench_phantom(&select, name, weave[w], &condition[k], &err);
            if (s != STATUS_OK) fprintf(stderr, "bench_geometry: %s: %s\n", name, err.text);
        }
    if (select.bars != NULL && n_row == 0) {
        fprintf(stderr, "bench_geometry: none of the rows that have a bar is among those asked for\n");
        return 1;
    }
    if (s == STATUS_OK && select.bars == NULL && selected(&select, "weave_ct") && listed(select.weaves, "weave_ct")) {
        s = bench_weave_ct(&select, &err);
        if (s != STATUS_OK) fprintf(stderr, "bench_geometry: weave_ct: %s\n", err.text);
    }
    return s == STATUS_OK ? 0 : 1;
}
