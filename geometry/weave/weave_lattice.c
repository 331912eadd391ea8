#include "geometry/weave/weave_lattice.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* BASIS_PEAKS: number of peaks from which the candidate bases are made. FURTHEST: largest frequency of a mirrored peak,
 * cycles per pixel. LARGEST_CHANCE: share of the plane that the places of a lattice may cover with their tolerances. */
enum { BASIS_PEAKS = 14 };
static const double FURTHEST = 0.75, LARGEST_CHANCE = 0.2, TOLERANCE_BIN = 2.0;

static double determinant(double f[2][2]) { return f[0][0] * f[1][1] - f[0][1] * f[1][0]; }

static double dot(const double a[2], const double b[2]) { return a[0] * b[0] + a[1] * b[1]; }

void weave_reduce_basis(double f[2][2])
{
    for (int step = 0; step < 64; step++) {
        if (dot(f[1], f[1]) < dot(f[0], f[0])) {
            double keep[2] = {f[0][0], f[0][1]};
            memcpy(f[0], f[1], sizeof keep);
            memcpy(f[1], keep, sizeof keep);
        }
        double n = round(dot(f[0], f[1]) / dot(f[0], f[0]));
        if (n == 0.0) return;
        for (int a = 0; a < 2; a++) f[1][a] -= n * f[0][a];
    }
}

void weave_dual_basis(double f[2][2], double shift[2][2])
{
    double det = determinant(f);
    shift[0][0] = f[1][1] / det;
    shift[0][1] = -f[1][0] / det;
    shift[1][0] = -f[0][1] / det;
    shift[1][1] = f[0][0] / det;
}

/* The frequency that a peak stands for, and its place on the lattice. */
struct lattice_place {
    double f[2];
    double index[2];
    double distance; /* from the lattice, cycles per pixel */
    bool mirrored;
};

/* Finds the nearest lattice point of a peak or of its mirror images beyond half a cycle per pixel. The zero point does
 * not count. */
static struct lattice_place nearest_place(const struct weave_peak *p, double f[2][2], double shift[2][2])
{
    struct lattice_place best = {.distance = INFINITY};
    for (int mx = -1; mx <= 1; mx++)
        for (int my = -1; my <= 1; my++) {
            struct lattice_place at = {.f = {p->f[0] + mx, p->f[1] + my}, .mirrored = mx != 0 || my != 0};
            if (fabs(at.f[0]) > FURTHEST || fabs(at.f[1]) > FURTHEST) continue;
            for (int i = 0; i < 2; i++) at.index[i] = round(dot(at.f, shift[i]));
            if (at.index[0] == 0.0 && at.index[1] == 0.0) continue;
            double off[2];
            for (int a = 0; a < 2; a++) off[a] = at.f[a] - at.index[0] * f[0][a] - at.index[1] * f[1][a];
            at.distance = hypot(off[0], off[1]);
            if (at.distance < best.distance) best = at;
        }
    return best;
}

/* Peaks of a cloth that is not flat are broad; further out they may be further off the lattice. */
static double tolerance(const double f[2], double resolution)
{
    return TOLERANCE_BIN * resolution + 0.01 * hypot(f[0], f[1]);
}

/* Moves the basis to the least squares of the peaks on it, weighted by amplitude; reach: largest index used. */
static void refine_basis(const struct weave_peak *peak, size_t n_peak, double resolution, double reach, double f[2][2])
{
    double shift[2][2], a[2][2] = {{0}}, b[2][2] = {{0}}; /* normal equations a f = b */
    weave_dual_basis(f, shift);
    for (size_t k = 0; k < n_peak; k++) {
        struct lattice_place at = nearest_place(&peak[k], f, shift);
        if (at.distance > tolerance(at.f, resolution)) continue;
        if (fabs(at.index[0]) > reach || fabs(at.index[1]) > reach) continue;
        double w = sqrt(peak[k].power);
        for (int i = 0; i < 2; i++)
            for (int c = 0; c < 2; c++) {
                a[i][c] += w * at.index[i] * at.index[c];
                b[i][c] += w * at.index[i] * at.f[c];
            }
    }
    double det = determinant(a);
    if (!(det > 1e-12 * a[0][0] * a[1][1])) return;
    for (int c = 0; c < 2; c++) {
        f[0][c] = (a[1][1] * b[0][c] - a[0][1] * b[1][c]) / det;
        f[1][c] = (a[0][0] * b[1][c] - a[1][0] * b[0][c]) / det;
    }
}

/* Share of the plane that lies within the tolerance of a lattice point, at a third of a cycle per pixel. */
static double chance(struct weave_lattice *l, double resolution)
{
    double radius = TOLERANCE_BIN * resolution + 0.003;
    return M_PI * radius * radius / fabs(determinant(l->f));
}

/* Fills in the members that follow from the basis. A peak falls on a lattice by chance with the probability that
 * chance() states; a mirrored one is worth half, because it could have come from more places. */
static void explain(const struct weave_peak *peak, size_t n_peak, double resolution, struct weave_lattice *l)
{
    double sum = 0.0, on = 0.0, all = 0.0, hits = 0.0;
    weave_dual_basis(l->f, l->shift_px);
    l->n_peak = 0;
    for (size_t k = 0; k < n_peak; k++) {
        struct lattice_place at = nearest_place(&peak[k], l->f, l->shift_px);
        bool hit = at.distance <= tolerance(at.f, resolution);
        sum += peak[k].power;
        on += hit ? peak[k].power : 0.0;
        all += sqrt(peak[k].power);
        hits += !hit ? 0.0 : at.mirrored ? 0.5 * sqrt(peak[k].power) : sqrt(peak[k].power);
        l->n_peak += hit;
    }
    l->explained = on / sum;
    l->information = hits / all * -log(chance(l, resolution));
}

/* Returns false if the two peaks do not make a lattice that could be told from chance. */
static bool make_candidate(const struct weave_peak *peak, size_t n_peak, const size_t pair[2], double resolution,
                           struct weave_lattice *l)
{
    for (int i = 0; i < 2; i++) memcpy(l->f[i], peak[pair[i]].f, sizeof l->f[i]);
    double length = hypot(l->f[0][0], l->f[0][1]) * hypot(l->f[1][0], l->f[1][1]);
    if (fabs(determinant(l->f)) < 0.1 * length) return false;
    weave_reduce_basis(l->f);
    if (hypot(l->f[0][0], l->f[0][1]) < 4.0 * resolution || chance(l, resolution) > LARGEST_CHANCE) return false;
    for (double reach = 2.0; reach < 20.0; reach *= 2.0) refine_basis(peak, n_peak, resolution, reach, l->f);
    weave_reduce_basis(l->f);
    return chance(l, resolution) <= LARGEST_CHANCE;
}

/* Keeps the candidates of the most information, the best first, each lattice once. */
static void keep_best(struct weave_lattice kept[WEAVE_LATTICE_MAX], size_t *n_kept, struct weave_lattice *l)
{
    size_t at = 0;
    double area = fabs(determinant(l->f));
    for (size_t i = 0; i < *n_kept; i++)
        if (fabs(fabs(determinant(kept[i].f)) / area - 1.0) < 0.05) {
            if (l->information <= kept[i].information) return;
            memmove(kept + i, kept + i + 1, (*n_kept - i - 1) * sizeof *kept);
            --*n_kept;
            break;
        }
    while (at < *n_kept && kept[at].information >= l->information) at++;
    if (at == WEAVE_LATTICE_MAX) return;
    size_t n_after = *n_kept - at - (*n_kept == WEAVE_LATTICE_MAX);
    memmove(kept + at + 1, kept + at, n_after * sizeof *kept);
    kept[at] = *l;
    *n_kept = at + 1 + n_after;
}

status weave_find_lattices(const struct weave_peak *peak, size_t n_peak, double resolution,
                           struct weave_lattice lattice[WEAVE_LATTICE_MAX], size_t *n_lattice, struct error *err)
{
    size_t n_basis = n_peak < BASIS_PEAKS ? n_peak : BASIS_PEAKS;
    *n_lattice = 0;
    for (size_t i = 0; i < n_basis; i++)
        for (size_t k = i + 1; k < n_basis; k++) {
            struct weave_lattice l;
            if (!make_candidate(peak, n_peak, (const size_t[]){i, k}, resolution, &l)) continue;
            explain(peak, n_peak, resolution, &l);
            keep_best(lattice, n_lattice, &l);
        }
    if (*n_lattice > 0) return STATUS_OK;
    return error_set(err, STATUS_NOT_FOUND, "the photograph shows no texture that repeats in two directions");
}
