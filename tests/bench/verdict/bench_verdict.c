/* Reconstructs scans with known fibers, and prints the errors of the lines beside their grade: one JSON object a line.
 *
 * bench_verdict [--lumens] VOXEL_UM SCAN...
 *   --lumens  only reads the scans, and prints whether they look hollow (geometry/diameter/lumen_evidence.h)
 *   VOXEL_UM  edge of the voxels of all scans
 *   SCAN  a scan; its true fibers are in the text of the same name (none: no fibers)
 * Each line has name, recall, precision, fragments, axis_rms and merges (geometry/phantom/compare.h), lumens, the
 * measured diameter in voxels, score, misfit and several (of the sections, geometry/grade/section_misfit.h), faults
 * (geometry/grade/scan_grade.h), is_good, errors over stated errors
 * (line_pulls.h), wall_s, and for each kind of fibers density, share of the length, and radius in voxels with its
 * standard error (geometry/grade/fiber_kinds.h); or the error that ended the reconstruction. */
#include "base/clock.h"
#include "geometry/phantom/compare.h"
#include "geometry/reconstruct/reconstruct.h"
#include "tests/bench/verdict/line_pulls.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct scan_run {
    struct volume v;
    struct fiber_set truth, found;
    struct reconstruct_report report;
    struct compare_report compare;
    struct line_pulls pulls;
};

static status reconstruct(const char *path, double voxel_m, struct thread_pool *pool, struct scan_run *r,
                          struct error *err)
{
    struct reconstruct_option o;
    struct direction_volume d = {0};
    reconstruct_option_default(&o);
    for (int a = 0; a < 3; a++) o.voxel_size_m[a] = voxel_m;
    status s = reconstruct_read(&path, 1, &o, NULL, pool, NULL, &r->v, &r->report, err);
    if (s == STATUS_OK) s = reconstruct_refill_lumens(&r->v, &o, pool, NULL, &r->report, err);
    if (s == STATUS_OK) s = reconstruct_orientation(&r->v, &o, pool, NULL, &d, &r->report, err);
    if (s == STATUS_OK) s = reconstruct_redirect(&r->v, &d, &o, pool, NULL, &r->report, err);
    if (s == STATUS_OK) s = reconstruct_fibers(&r->v, &d, &o, pool, NULL, &r->found, &r->report, err);
    if (s == STATUS_OK) s = reconstruct_grade(&r->v, &r->found, pool, &r->report, NULL, err);
    direction_volume_release(&d);
    return s;
}

/* Compares the fibers with the truth. Without one every line is wrong. */
static status compare(const char *path, struct scan_run *r, struct error *err)
{
    char truth[4096];
    const char *end = strrchr(path, '.');
    const struct compare_option o = {.voxel_size_m = r->v.voxel_size_m[0], .margin_m = 3.0 * r->v.voxel_size_m[0]};
    snprintf(truth, sizeof truth, "%.*s.txt", (int)(end != NULL ? end - path : 0), path);
    if (access(truth, R_OK) != 0) return STATUS_OK;
    status s = fiber_set_read_text(&r->truth, truth, err);
    memcpy(r->truth.tile_size_m, r->found.tile_size_m, sizeof r->truth.tile_size_m);
    if (s == STATUS_OK) s = compare_fibers(&r->truth, &r->found, &o, &r->compare, err);
    if (s == STATUS_OK) s = line_pulls_measure(&r->truth, &r->found, &r->report, o.margin_m, &r->pulls, err);
    return s;
}

static double number(double x) { return isfinite(x) ? x : 0.0; }

static void print_pull(const char *name, const struct pull *p)
{
    printf(",\"%s\":{\"robust\":%.3f,\"rms\":%.3f,\"covered\":%.3f}", name, number(p->robust), number(p->rms),
           number(p->covered));
}

static void print_kinds(const struct fiber_kinds *kinds, double voxel_m)
{
    printf(",\"kinds\":[");
    for (size_t k = 0; k < kinds->n; k++) {
        const struct fiber_kind *kind = &kinds->kind[k];
        printf("%s[%.3f,%.3f,%.2f,%.2f]", k > 0 ? "," : "", kind->density, kind->share, kind->radius_m / voxel_m,
               number(kind->radius_se_m / voxel_m));
    }
    printf("]");
}

static void bench_scan(const char *path, double voxel_m, struct thread_pool *pool)
{
    struct scan_run r = {0};
    struct error err = {0};
    const char *name = strrchr(path, '/') != NULL ? strrchr(path, '/') + 1 : path;
    const struct scan_grade *g = &r.report.grade;
    const double start_s = clock_monotonic_s();
    fiber_set_init(&r.truth);
    fiber_set_init(&r.found);
    status s = reconstruct(path, voxel_m, pool, &r, &err);
    const double wall_s = clock_monotonic_s() - start_s;
    if (s == STATUS_OK) s = compare(path, &r, &err);
    if (s != STATUS_OK) {
        printf("{\"name\":\"%s\",\"wall_s\":%.1f,\"error\":\"%s\"}\n", name, wall_s, err.text);
    } else {
        printf(
            "{\"name\":\"%s\",\"wall_s\":%.1f,\"recall\":%.4f,\"precision\":%.4f,\"fragments\":%.3f,\"lumens\":\"%s\","
            "\"axis_rms\":%.4f,\"merges\":%.4f,\"diameter\":%.3f,\"score\":%.4f,\"misfit\":%.4f,\"several\":%.4f,"
            "\"faults\":%u,"
            "\"verdict\":\"%s\",\"is_good\":%s",
            name, wall_s, number(r.compare.center_recall), number(r.compare.center_precision),
            number(r.compare.fragments_per_fiber), lumen_answer_name(r.report.lumens),
            number(r.compare.centerline_rms_voxel), number(r.compare.merges_per_fiber), r.report.fiber_diameter_voxel,
            number(g->score), number(g->section.surface), number(g->section.several_share), g->faults,
            grade_verdict_name(g->verdict), g->verdict == GRADE_RESOLVED && g->faults == 0 ? "true" : "false");
        print_pull("position_pull", &r.pulls.position);
        print_pull("radius_pull", &r.pulls.radius);
        print_pull("point_radius_pull", &r.pulls.point_radius);
        print_kinds(&r.report.kinds, voxel_m);
        printf("}\n");
    }
    fflush(stdout);
    volume_release(&r.v);
    fiber_set_release(&r.truth);
    fiber_set_release(&r.found);
}

static void bench_lumens(const char *path, double voxel_m, struct thread_pool *pool)
{
    struct volume v = {0};
    struct reconstruct_report r = {0};
    struct reconstruct_option o;
    struct error err = {0};
    const char *name = strrchr(path, '/') != NULL ? strrchr(path, '/') + 1 : path;
    const double start_s = clock_process_s();
    reconstruct_option_default(&o);
    for (int a = 0; a < 3; a++) o.voxel_size_m[a] = voxel_m;
    if (reconstruct_read(&path, 1, &o, NULL, pool, NULL, &v, &r, &err) != STATUS_OK)
        printf("{\"name\":\"%s\",\"error\":\"%s\"}\n", name, err.text);
    else
        printf("{\"name\":\"%s\",\"cpu_s\":%.1f,\"lumens\":\"%s\",\"middle_share\":%.5f,\"enclosed_share\":%.5f,"
               "\"hollow_share\":%.3f}\n",
               name, clock_process_s() - start_s, lumen_answer_name(r.lumens), r.lumen.middle_share,
               r.lumen.enclosed_share, number(r.lumen.hollow_share));
    fflush(stdout);
    volume_release(&v);
}

int main(int argc, char **argv)
{
    const bool lumens = argc > 1 && strcmp(argv[1], "--lumens") == 0;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    if (thread_pool_new(0, &pool, &err) != STATUS_OK) {
        fprintf(stderr, "bench_verdict: %s\n", err.text);
        return 1;
    }
    const int first = lumens ? 2 : 1;
    const double voxel_m = argc > first ? 1e-6 * strtod(argv[first], NULL) : 0.0;
    for (int i = first + 1; i < argc; i++)
        if (lumens)
            bench_lumens(argv[i], voxel_m, pool);
        else
            bench_scan(argv[i], voxel_m, pool);
    thread_pool_free(pool);
    return 0;
}
