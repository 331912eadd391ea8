#include "geometry/fibers/shape/radius.h"

#include <math.h>
#include <stdlib.h>

/* Radius of some classes and its standard error, by leaving out one part at a time (jackknife, Efron 1979). */
static double with_error(const struct distance_histogram part[RADIUS_PARTS], unsigned classes,
                         struct distance_histogram *scratch, double *se)
{
    double sum = 0.0, square = 0.0;
    size_t n = 0;
    distance_histogram_sum(part, RADIUS_PARTS, scratch);
    double all = radius_from_mass(scratch, classes, radius_best_score(scratch, classes));
    for (size_t p = 0; p < RADIUS_PARTS; p++) {
        double length = 0.0;
        for (int a = 0; a < 3; a++) length += (classes >> a & 1) != 0 ? part[p].length_voxel[a] : 0.0;
        if (!(length > 0.0)) continue;
        distance_histogram_sum(part, p, scratch);
        double r = radius_from_mass(scratch, classes, radius_best_score(scratch, classes));
        sum += r - all;
        square += (r - all) * (r - all);
        n++;
    }
    *se = n > 1 ? sqrt(fmax(0.0, square - sum * sum / (double)n) * (double)(n - 1) / (double)n) : NAN;
    return all;
}

static bool differ(const struct radius_measure *m)
{
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < a; b++) {
            double gap = fabs(m->radius_voxel[a] - m->radius_voxel[b]),
                   mean = 0.5 * (m->radius_voxel[a] + m->radius_voxel[b]);
            if (!(m->radius_voxel[a] > 0.0) || !(m->radius_voxel[b] > 0.0)) continue;
            if (gap > RADIUS_SIGMAS * hypot(m->se_voxel[a], m->se_voxel[b]) && gap > RADIUS_SYSTEMATIC * mean)
                return true;
        }
    return false;
}

status radius_choose(const struct distance_histogram part[RADIUS_PARTS], enum radius_rule rule,
                     struct radius_measure *m, struct error *err)
{
    struct distance_histogram *scratch = malloc(sizeof *scratch);
    double se;
    if (scratch == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the fiber radius: out of memory");
    double all = with_error(part, 7u, scratch, &se);
    for (int a = 0; a < 3; a++) m->radius_voxel[a] = with_error(part, 1u << a, scratch, &m->se_voxel[a]);
    m->per_axis = rule == RADIUS_PER_AXIS || (rule == RADIUS_AUTO && differ(m));
    for (int a = 0; a < 3; a++) {
        if (m->per_axis && m->radius_voxel[a] > 0.0) continue;
        m->radius_voxel[a] = all;
        m->se_voxel[a] = se;
    }
    free(scratch);
    return STATUS_OK;
}

/* Root of the mean square of the radii, by length, of the lines of a class; class 3: of all. The mass that the radius
 * of a class follows from is proportional to this square. */
static double rms_radius(const struct polyline_set *lines, int class)
{
    double square = 0.0, length = 0.0;
    for (size_t l = 0; l < lines->n_line; l++) {
        if (class < 3 && lines->axis[l] != class) continue;
        double n = (double)polyline_length(lines, l);
        square += n * (double)lines->radius[l] * (double)lines->radius[l];
        length += n;
    }
    return length > 0.0 ? sqrt(square / length) : 1.0;
}

void radius_measure_lines(const struct polyline_set *lines, double se_voxel, struct radius_measure *m)
{
    bool any[3] = {false, false, false};
    for (size_t l = 0; l < lines->n_line; l++) any[lines->axis[l]] = true;
    for (int a = 0; a < 3; a++) {
        m->radius_voxel[a] = rms_radius(lines, m->per_axis && any[a] ? a : 3);
        m->se_voxel[a] = se_voxel;
    }
}

void polylines_set_radii(struct polyline_set *lines, const struct radius_measure *m, bool single)
{
    double scale[3];
    for (int a = 0; a < 3; a++) scale[a] = m->radius_voxel[a] / rms_radius(lines, m->per_axis ? a : 3);
    for (size_t l = 0; l < lines->n_line; l++) {
        uint8_t a = lines->axis[l];
        lines->radius[l] = (float)(single ? scale[a] * (double)lines->radius[l] : m->radius_voxel[a]);
        for (size_t i = lines->first[l]; !single && lines->shape != NULL && i < lines->first[l + 1]; i++) {
            lines->shape[i].radius = lines->radius[l];
            lines->shape[i].radius_se = 0.0f;
        }
    }
    if (single) polyline_shapes_follow(lines, true);
}
