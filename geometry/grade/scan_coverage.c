#include "geometry/grade/scan_coverage.h"

#include "geometry/grade/coverage_means.h"
#include "geometry/volume/voxel_runs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Standard deviations of the means that noise may reach. */
static const double NOISE_SD = 5.0;

/* Particles, in contrast to pieces of fibers: share of their ball that they fill, which a cylinder of three
 * diameters does not, and largest radius of that ball in fiber diameters. */
static const double PARTICLE_FILL = 0.35, PARTICLE_RADIUS = 2.0;

/* Counts of one slice. */
struct slice_count {
    size_t inside[COVERAGE_KINDS], unexplained[COVERAGE_KINDS];
    double density;
};

struct coverage_job {
    struct coverage_means means;
    struct coverage_background background;
    double least;
    size_t margin[3];     /* voxels at the faces that do not count */
    uint8_t *unexplained; /* a mark for each voxel */
    struct slice_count *slice;
    uint32_t *by_row, *by_column; /* unexplained voxels of each slice and row, and of each slice and column */
};

/* ---- the kinds of the fibers ---- */

/* Mean density on the axis of a fiber. */
static double axis_density(const struct volume *v, const struct fiber_set *f, size_t i_fiber)
{
    double sum = 0.0, n = 0.0;
    for (size_t k = f->first_vertex[i_fiber]; k < f->first_vertex[i_fiber + 1]; k++) {
        size_t at[3];
        for (size_t a = 0; a < 3; a++) {
            const double x = (double)f->position_m[3 * k + a] / v->voxel_size_m[a];
            at[a] = (size_t)fmin(fmax(x, 0.0), (double)v->n[a] - 1.0);
        }
        sum += (double)v->density[volume_index(v->n, at[0], at[1], at[2])];
        n += 1.0;
    }
    return sum / n;
}

static uint8_t *kinds_of(const struct volume *v, const struct fiber_set *f)
{
    uint8_t *kind = malloc(f->n_fiber + 1);
    for (size_t i = 0; i < f->n_fiber && kind != NULL; i++)
        kind[i] = axis_density(v, f, i) < COVERAGE_DENSE ? COVERAGE_LIGHT_KIND : COVERAGE_DENSE_KIND;
    return kind;
}

/* ---- counting ---- */

/* Fibers whose axes lie beyond a face reach half a diameter into the scan, and means one reach farther. At most a
 * quarter of a thin scan. */
static void set_margin(struct coverage_job *j, double diameter_voxel)
{
    for (int a = 0; a < 3; a++) {
        const size_t quarter = j->means.v->n[a] / 4, wide = (size_t)(0.5 * diameter_voxel + 0.5) + j->means.reach;
        j->margin[a] = wide < quarter ? wide : quarter;
    }
}

static bool is_near_face(const struct coverage_job *j, size_t i, size_t row, size_t k)
{
    const size_t at[3] = {i, row, k};
    for (int a = 0; a < 3; a++)
        if (at[a] < j->margin[a] || at[a] + j->margin[a] >= j->means.v->n[a]) return true;
    return false;
}

static void count_voxel(struct coverage_job *j, size_t i, size_t row, size_t k, float mean)
{
    const size_t *n = j->means.v->n, at = (k * n[1] + row) * n[0] + i;
    const uint8_t code = j->means.code[at];
    struct slice_count *s = &j->slice[k];
    j->unexplained[at] = 0;
    if (is_near_face(j, i, row, k)) return;
    if (code < LINE_KINDS) s->inside[code]++;
    const double above = (double)mean - coverage_background_at(&j->background, i, row);
    const bool is_unexplained = !isnan(mean) && above > j->least;
    j->unexplained[at] = is_unexplained;
    if (!is_unexplained) return;
    s->unexplained[above < COVERAGE_DENSE ? COVERAGE_LIGHT_KIND : COVERAGE_DENSE_KIND]++;
    s->density += above;
    j->by_row[k * n[1] + row]++;
    j->by_column[k * n[0] + i]++;
}

static void count_slice(void *context, size_t k, size_t i_thread)
{
    struct coverage_job *j = context;
    const size_t *n = j->means.v->n;
    const float *mean = coverage_means_of_slice(&j->means, k, i_thread);
    for (size_t row = 0; row < n[1]; row++)
        for (size_t i = 0; i < n[0]; i++) count_voxel(j, i, row, k, mean[row * n[0] + i]);
    scratch_keep_within(j->means.v->space);
}

static size_t sum_of(const uint32_t *count, size_t n, size_t step)
{
    size_t sum = 0;
    for (size_t i = 0; i < n; i++) sum += count[i * step];
    return sum;
}

/* The slice across each axis with the most unexplained voxels. */
static void find_slices(const struct coverage_job *j, struct scan_coverage *c)
{
    const size_t *n = j->means.v->n;
    size_t most[3] = {0, 0, 0};
    for (size_t a = 0; a < 3; a++)
        for (size_t i = 0; i < n[a]; i++) {
            const size_t found = a == 0   ? sum_of(j->by_column + i, n[2], n[0])
                                 : a == 1 ? sum_of(j->by_row + i, n[2], n[1])
                                          : sum_of(j->by_row + i * n[1], n[1], 1);
            if (found <= most[a]) continue;
            most[a] = found;
            c->slice[a] = i;
        }
}

static void sum_slices(const struct coverage_job *j, struct scan_coverage *c)
{
    double inside[COVERAGE_KINDS] = {0.0}, missing[COVERAGE_KINDS] = {0.0}, density = 0.0;
    for (size_t k = 0; k < j->means.v->n[2]; k++) {
        for (int kind = 0; kind < COVERAGE_KINDS; kind++) {
            inside[kind] += (double)j->slice[k].inside[kind];
            missing[kind] += (double)j->slice[k].unexplained[kind];
        }
        density += j->slice[k].density;
    }
    const double explained = inside[0] + inside[1], unexplained = missing[0] + missing[1];
    const double all = explained + unexplained;
    c->explained_share = all > 0.0 ? explained / all : NAN;
    c->unexplained_density = unexplained > 0.0 ? density / unexplained : NAN;
    for (int kind = 0; kind < COVERAGE_KINDS; kind++) {
        const double of_kind = inside[kind] + missing[kind];
        c->kind[kind].share = all > 0.0 ? of_kind / all : NAN;
        c->kind[kind].explained_share = of_kind > 0.0 ? inside[kind] / of_kind : NAN;
    }
    find_slices(j, c);
}

static status count_particles(struct coverage_job *j, double diameter_voxel, struct scan_coverage *c, struct error *err)
{
    double explained = 0.0, unexplained = 0.0;
    size_t particles = 0;
    for (size_t k = 0; k < j->means.v->n[2]; k++)
        for (int kind = 0; kind < COVERAGE_KINDS; kind++) {
            explained += (double)j->slice[k].inside[kind];
            unexplained += (double)j->slice[k].unexplained[kind];
        }
    if (!(explained + unexplained > 0.0)) return STATUS_OK;
    status s = unexplained > 0.0 ? voxel_marks_count_compact(j->means.v->n, j->unexplained, PARTICLE_FILL,
                                                             PARTICLE_RADIUS * diameter_voxel, &particles, err)
                                 : STATUS_OK;
    c->particle_share = (double)particles / (explained + unexplained);
    c->fiber_share = explained / (explained + unexplained - (double)particles);
    return s;
}

/* ---- the order of the steps ---- */

static status count(struct coverage_job *j, double diameter_voxel, struct thread_pool *pool, struct scan_coverage *c,
                    struct error *err)
{
    const size_t *n = j->means.v->n;
    status s = coverage_background_measure(&j->means, pool, &j->background, err);
    if (s != STATUS_OK) return s;
    j->least = fmax(COVERAGE_LEAST_DENSITY, NOISE_SD * j->background.noise_sd);
    c->least_density = j->least;
    j->slice = calloc(n[2], sizeof *j->slice);
    j->by_row = calloc(n[2] * n[1], sizeof *j->by_row);
    j->by_column = calloc(n[2] * n[0], sizeof *j->by_column);
    if (j->slice == NULL || j->by_row == NULL || j->by_column == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    s = thread_pool_run(pool, n[2], count_slice, j, NULL);
    if (s != STATUS_OK) return error_set(err, s, "grading the scan was cancelled");
    sum_slices(j, c);
    return count_particles(j, diameter_voxel, c, err);
}

status scan_coverage_measure(const struct coverage_input *in, struct thread_pool *pool, uint8_t *unexplained,
                             struct scan_coverage *c, struct error *err)
{
    struct coverage_job j = {.unexplained = unexplained};
    const size_t n_voxel = volume_n_voxel(in->v->n);
    void *code = NULL, *mark = NULL;
    *c = (struct scan_coverage){.explained_share = NAN,
                                .fiber_share = NAN,
                                .particle_share = NAN,
                                .unexplained_density = NAN,
                                .least_density = NAN};
    uint8_t *kind = kinds_of(in->v, in->f);
    status s = kind != NULL ? scratch_new(in->v->space, n_voxel, "distances from fibers", &code, err)
                            : error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    if (s == STATUS_OK && unexplained == NULL) {
        s = scratch_new(in->v->space, n_voxel, "unexplained voxels", &mark, err);
        j.unexplained = mark;
    }
    if (s == STATUS_OK) s = line_distance_map(in->v, in->f, kind, pool, code, err);
    if (s == STATUS_OK) s = coverage_means_init(&j.means, in, code, pool, err);
    if (s == STATUS_OK) set_margin(&j, in->diameter_voxel);
    if (s == STATUS_OK) s = count(&j, in->diameter_voxel, pool, c, err);
    coverage_means_release(&j.means);
    coverage_background_release(&j.background);
    free(j.slice);
    free(j.by_row);
    free(j.by_column);
    scratch_release(in->v->space, code);
    scratch_release(in->v->space, mark);
    free(kind);
    return s;
}
