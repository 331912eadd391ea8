#include "geometry/fibers/axes/shape_measure.h"
#include "base/small_matrix.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BAND = 3, LEAST_PIECES = 5 };
/* v M^-1 N M^-1 over v M^-1 of a smooth course far from its ends. */
static const double SMOOTH = 0.75;
/* Lengths in diameters: pieces whose differences show the noise of the radius and of the section, pieces of the test,
 * and smoothing of a radius that varies. */
static const double RADIUS_PIECE = 1.0, SECTION_PIECE = 0.5, TEST_PIECE = 2.0, RADIUS_LENGTH = 1.0, AXIS_PIECE = 2.0;
/* Number of pieces of a line from which on its own noise weighs more than the noise of all lines together. */
static const double PRIOR_PIECES = 10.0;
/* The radius varies where chi^2 is less probable than so many standard deviations of a normal variable, and the
 * variation, without noise, is at least this share of the radius. */
static const double LEAST_DEVIATION = 4.0, LEAST_VARIATION = 0.03;
/* The same of the area of a lumen, and the standard deviation of widths between 0 and 0.8. */
static const double LEAST_AREA_VARIATION = 0.03, AREA_CHANGE_MOST = 0.3, ANY_LUMEN_SE = 0.23;
/* Largest area of a lumen over its outline's, as in the fit (axis_profile.c). */
static const double AREA_MOST = 0.81;
/* Standard deviation of an angle that may be any between 0 and pi: pi / sqrt 12. */
static const double ANY_ANGLE_SE = 0.9069;

/* Squares of differences of neighbouring pieces, and their expected values for a noise of 1. */
struct scatter {
    double square, expected, n;
};

static double noise_of(const struct scatter *s) { return s->expected > 0.0 ? s->square / s->expected : 0.0; }

/* Sums over the vertices of a piece of a line. */
struct piece_sum {
    double gradient, information;
};

/* Adds the weighted differences of neighbouring pieces. */
static void add_differences(const struct piece_sum *piece, size_t n_piece, const double *weight, size_t n_weight,
                            struct scatter *to)
{
    for (size_t j = 0; j + n_weight <= n_piece; j++) {
        double difference = 0.0, expected = 0.0;
        for (size_t k = 0; k < n_weight; k++) {
            difference += weight[k] * piece[j + k].gradient;
            expected += weight[k] * weight[k] * piece[j + k].information;
        }
        to->square += difference * difference;
        to->expected += expected;
        to->n += 1.0;
    }
}

/* One line, and work for the longest. */
struct line_work {
    size_t n, first;
    double radius_by_area, area_by_radius; /* part of one gradient in the other, of the whole line */
    double *gradient, *information;        /* at each vertex */
    double *x, *m;                         /* solution and banded matrix */
    struct piece_sum *piece;
    double (*variance)[3]; /* of c and s: cc, cs, ss, per noise */
};

/* Terms of a segment of a line for the radius, without the part that the lumen explains. */
static struct piece_sum radius_terms(const struct line_work *w, const struct shape_sums *sums, size_t i)
{
    const struct axis_equation *p = &sums->equation[w->first + i];
    struct piece_sum t = {(double)p->radius_gradient, (double)p->radius_normal};
    if (sums->lumen != NULL) {
        const struct lumen_equation *q = &sums->lumen[w->first + i];
        const double part = w->radius_by_area;
        t.gradient -= part * (double)q->gradient;
        t.information += part * (part * (double)q->normal - 2.0 * (double)q->by_radius);
    }
    t.information *= sums->slope;
    return t;
}

/* Terms for the area of the lumen, without the part that the radius explains. */
static struct piece_sum area_terms(const struct line_work *w, const struct shape_sums *sums, size_t i)
{
    const struct axis_equation *p = &sums->equation[w->first + i];
    const struct lumen_equation *q = &sums->lumen[w->first + i];
    const double part = w->area_by_radius;
    return (struct piece_sum){
        (double)q->gradient - part * (double)p->radius_gradient,
        sums->slope * ((double)q->normal - 2.0 * part * (double)q->by_radius + part * part * (double)p->radius_normal)};
}

typedef struct piece_sum terms_of(const struct line_work *w, const struct shape_sums *sums, size_t i);

/* Shares the terms of each segment between the vertices at its ends. */
static void take_terms(struct line_work *w, const struct shape_sums *sums, terms_of *terms)
{
    memset(w->gradient, 0, w->n * sizeof *w->gradient);
    memset(w->information, 0, w->n * sizeof *w->information);
    for (size_t i = 0; i + 1 < w->n; i++) {
        const struct piece_sum t = terms(w, sums, i);
        for (size_t end = 0; end < 2; end++) {
            w->gradient[i + end] += 0.5 * t.gradient;
            w->information[i + end] += 0.5 * t.information;
        }
    }
}

static size_t take_pieces(struct line_work *w, size_t length)
{
    const size_t n_piece = w->n / length;
    for (size_t p = 0; p < n_piece; p++) {
        w->piece[p] = (struct piece_sum){0.0, 0.0};
        for (size_t i = p * length; i < (p + 1) * length; i++) {
            w->piece[p].gradient += w->gradient[i];
            w->piece[p].information += w->information[i];
        }
    }
    return n_piece;
}

static size_t piece_length(double diameters, double diameter) { return (size_t)fmax(2.0, diameters * diameter + 0.5); }

/* Segments, not vertices: the halves of neighbouring vertices would be correlated. */
static void segment_scatter(struct line_work *w, const struct shape_sums *sums, terms_of *terms, struct scatter *to,
                            struct scatter *axis)
{
    static const double fourth[5] = {1.0, -4.0, 6.0, -4.0, 1.0}, second[3] = {1.0, -2.0, 1.0};
    for (size_t i = 0; i < w->n; i++) {
        const struct piece_sum t = terms(w, sums, i);
        w->gradient[i] = t.gradient;
        w->information[i] = t.information;
    }
    add_differences(w->piece, take_pieces(w, piece_length(RADIUS_PIECE, sums->diameter)), fourth, 5, to);
    if (axis != NULL)
        add_differences(w->piece, take_pieces(w, piece_length(AXIS_PIECE, sums->diameter)), second, 3, axis);
}

static void section_scatter(struct line_work *w, const struct shape_sums *sums, struct scatter *to)
{
    const struct section_equation *equation = sums->section;
    static const double second[3] = {1.0, -2.0, 1.0};
    for (int a = 0; a < 2; a++) {
        for (size_t i = 0; i < w->n; i++) {
            w->gradient[i] = (double)equation[w->first + i].gradient[a];
            w->information[i] = sums->slope * (double)equation[w->first + i].normal[2 * a];
        }
        add_differences(w->piece, take_pieces(w, piece_length(SECTION_PIECE, sums->diameter)), second, 3, to);
    }
}

/* Returns the noise of a line: its own, weighed against the noise of all lines, and not less than the latter. */
static double line_noise(const struct scatter *own, const struct scatter *all)
{
    const double common = noise_of(all), weight = own->n / (own->n + PRIOR_PIECES);
    return fmax(common, own->n > 0.0 ? weight * noise_of(own) + (1.0 - weight) * common : common);
}

/* Takes the gradient of the radius, or of the lumen, of the whole line from the gradients of its vertices. Returns the
 * line's information. */
static double centre_gradient(struct line_work *w)
{
    double gradient = 0.0, information = 0.0;
    for (size_t i = 0; i < w->n; i++) {
        gradient += w->gradient[i];
        information += w->information[i];
    }
    for (size_t i = 0; i < w->n && information > 0.0; i++) w->gradient[i] -= gradient / information * w->information[i];
    return information;
}

/* Whether a number varies along a line, by at least `least`. The gradients are about the mean of the line. */
static bool course_varies(struct line_work *w, double noise, double least, double diameter)
{
    const size_t n_piece = take_pieces(w, piece_length(TEST_PIECE, diameter));
    double chi2 = 0.0, information = 0.0, square = 0.0;
    const double freedom = (double)n_piece - 1.0;
    if (n_piece < LEAST_PIECES || !(noise > 0.0)) return false;
    for (size_t p = 0; p < n_piece; p++) {
        const struct piece_sum *q = &w->piece[p];
        if (!(q->information > 0.0)) continue;
        chi2 += q->gradient * q->gradient / (noise * q->information);
        square += q->gradient * q->gradient / q->information;
        information += q->information;
    }
    if (!(information > 0.0)) return false;
    /* Wilson and Hilferty 1931: the cube root of chi^2 over its degrees of freedom is nearly normal */
    const double spread = 2.0 / (9.0 * freedom), deviation = (cbrt(chi2 / freedom) - (1.0 - spread)) / sqrt(spread);
    const double variation = sqrt(fmax(0.0, square - freedom * noise) / information);
    return deviation > LEAST_DEVIATION && variation > least;
}

/* Fills the banded matrix m = N + stiffness D'D. */
static void fill_course(struct line_work *w, double stiffness, double hold)
{
    static const double second[3] = {1.0, -2.0, 1.0};
    memset(w->m, 0, BAND * w->n * sizeof *w->m);
    for (size_t i = 0; i < w->n; i++) w->m[BAND * i] = w->information[i] + hold;
    for (size_t i = 0; i + 2 < w->n; i++)
        for (size_t r = 0; r < 3; r++)
            for (size_t c = 0; c <= r; c++) w->m[BAND * (i + r) + r - c] += stiffness * second[r] * second[c];
}

/* Solves for the course of a number about its mean on the line, at most `most` from it: x. The variances for a noise of
 * 1 are on the diagonal of m. The gradients are about the mean. Returns whether that was possible. */
static bool find_course(struct line_work *w, double length, double most)
{
    double information = 0.0, mean = 0.0;
    for (size_t i = 0; i < w->n; i++) information += w->information[i] / (double)w->n;
    const double stiffness = pow(length, 4.0) * information, hold = 1e-3 * information;
    memcpy(w->x, w->gradient, w->n * sizeof *w->x);
    fill_course(w, stiffness, hold);
    if (!small_solve_banded(w->m, w->n, BAND, w->x)) return false;
    for (size_t i = 0; i < w->n; i++) mean += w->x[i] / (double)w->n;
    for (size_t i = 0; i < w->n; i++) w->x[i] = fmin(most, fmax(-most, w->x[i] - mean));
    fill_course(w, stiffness, hold);
    return small_invert_banded(w->m, w->n, BAND);
}

static bool measure_radius(struct line_work *w, const struct shape_sums *sums, double noise, double radius,
                           struct fiber_shape *shape)
{
    take_terms(w, sums, radius_terms);
    for (size_t i = 0; i < w->n; i++) w->gradient[i] += w->information[i] * ((double)shape[i].radius - radius);
    const double information = centre_gradient(w);
    const bool varies = course_varies(w, noise, LEAST_VARIATION * radius, sums->diameter) &&
                        find_course(w, RADIUS_LENGTH * sums->diameter, 0.5 * radius);
    for (size_t i = 0; i < w->n; i++) {
        shape[i].radius = (float)(varies ? radius + w->x[i] : radius);
        shape[i].radius_se = varies              ? (float)sqrt(SMOOTH * noise * w->m[BAND * i])
                             : information > 0.0 ? (float)sqrt(noise / information)
                                                 : 0.0f;
    }
    return varies;
}

/* Error of the width of a lumen whose area has the variance `variance`. */
static double width_se(double width, double variance) { return sqrt(width * width + sqrt(variance)) - width; }

/* Writes the width of a lumen, where the scan tells it. variance: of its area, by noise; model: by errors of the
 * model. */
static void set_lumen(double area, double variance, double model, struct fiber_shape *shape)
{
    const double width = sqrt(fmin(fmax(0.0, area), AREA_MOST)),
                 se = fmin(ANY_LUMEN_SE, width_se(width, variance + model));
    const bool told = width_se(width, variance) <= ANY_LUMEN_SE;
    shape->lumen = told ? (float)width : 0.0f;
    shape->lumen_se = told ? (float)se : 0.0f;
}

static bool measure_lumen(struct line_work *w, const struct shape_sums *sums, double noise, double area,
                          struct fiber_shape *shape)
{
    take_terms(w, sums, area_terms);
    const double information = centre_gradient(w);
    const bool varies = course_varies(w, noise, LEAST_AREA_VARIATION, sums->diameter) &&
                        find_course(w, RADIUS_LENGTH * sums->diameter, AREA_CHANGE_MOST);
    const double shared = noise * sums->shared_area / sums->slope, model = sums->model_square * sums->shared_area;
    for (size_t i = 0; i < w->n; i++)
        set_lumen(varies ? area + w->x[i] : area,
                  shared + (varies              ? SMOOTH * noise * w->m[BAND * i]
                            : information > 0.0 ? noise / information
                                                : INFINITY),
                  model, &shape[i]);
    return varies;
}

/* Writes the section of a vertex. t: direction of the line. variance: of c and s. */
static void set_section(const struct fiber_section *q, const float t[3], const double variance[3], double noise,
                        struct fiber_shape *shape)
{
    const double c = (double)q->c, s = (double)q->s, square = c * c + s * s, scale = SMOOTH * noise;
    const double length = square > 0.0 ? sqrt(square) : 1.0, x = square > 0.0 ? c / length : 1.0, y = s / length;
    const double along = scale * (x * x * variance[0] + 2.0 * x * y * variance[1] + y * y * variance[2]),
                 across = scale * (y * y * variance[0] - 2.0 * x * y * variance[1] + x * x * variance[2]);
    const double flatness = sqrt(fmax(0.0, square - across)), angle = 0.5 * atan2(s, c);
    shape->ratio = (float)exp(2.0 * flatness);
    shape->ratio_se = (float)(2.0 * exp(2.0 * flatness) * sqrt(along));
    /* the fit takes changes of c and s to commute with the section, and its derivative by the turn is too large */
    const double turn = 2.0 * flatness / tanh(fmax(2.0 * flatness, 1e-9));
    shape->angle_se_rad = (float)fmin(ANY_ANGLE_SE, 0.5 * sqrt(across) * turn / fmax(flatness, 1e-9));
    const float cosine = (float)cos(angle), sine = (float)sin(angle);
    for (int a = 0; a < 3; a++)
        shape->long_axis[a] =
            cosine * q->u[a] + sine * (t[(a + 1) % 3] * q->u[(a + 2) % 3] - t[(a + 2) % 3] * q->u[(a + 1) % 3]);
}

static void measure_section(struct line_work *w, const struct shape_sums *sums, double stiffness, double noise,
                            const struct polyline_set *lines, size_t line)
{
    const struct fiber_section *section = sums->sections + w->first;
    /* slope N + L D'D + hold is slope times the matrix of the fit with other penalties */
    if (!fiber_section_variance(sums->section + w->first, w->n, stiffness / sums->slope,
                                sums->section_hold / sums->slope, w->m, w->variance))
        return;
    for (size_t i = 0; i < w->n; i++) {
        float t[3];
        polyline_tangent(lines, line, w->first + i, 1, t);
        set_section(&section[i], t, w->variance[i], noise / sums->slope, &lines->shape[w->first + i]);
    }
}

static bool line_work_init(struct line_work *w, const struct polyline_set *lines)
{
    size_t longest = 1;
    for (size_t l = 0; l < lines->n_line; l++)
        if (polyline_length(lines, l) > longest) longest = polyline_length(lines, l);
    *w = (struct line_work){.gradient = malloc(longest * sizeof *w->gradient),
                            .information = malloc(longest * sizeof *w->information),
                            .x = malloc(longest * sizeof *w->x),
                            .m = malloc(2 * SECTION_BAND * longest * sizeof *w->m),
                            .piece = malloc(longest * sizeof *w->piece),
                            .variance = malloc(longest * sizeof *w->variance)};
    return w->gradient && w->information && w->x && w->m && w->piece && w->variance;
}

static void line_work_release(struct line_work *w)
{
    free(w->gradient);
    free(w->information);
    free(w->x);
    free(w->m);
    free(w->piece);
    free(w->variance);
}

static void start_line(struct line_work *w, const struct polyline_set *lines, size_t line,
                       const struct shape_sums *sums)
{
    double radius = 0.0, area = 0.0, both = 0.0;
    w->first = lines->first[line];
    w->n = polyline_length(lines, line);
    for (size_t i = w->first; i < w->first + w->n && sums->lumen != NULL; i++) {
        radius += (double)sums->equation[i].radius_normal;
        area += (double)sums->lumen[i].normal;
        both += (double)sums->lumen[i].by_radius;
    }
    w->radius_by_area = area > 0.0 ? both / area : 0.0;
    w->area_by_radius = radius > 0.0 ? both / radius : 0.0;
}

/* Adds the scatter of a line's gradients: of radius, section, lumen, and of the radius for the axis. */
static void add_scatter(struct line_work *w, const struct shape_sums *sums, struct scatter to[4])
{
    segment_scatter(w, sums, radius_terms, &to[0], &to[3]);
    section_scatter(w, sums, &to[1]);
    if (sums->lumen != NULL) segment_scatter(w, sums, area_terms, &to[2], NULL);
}

status fiber_shapes_measure(struct polyline_set *lines, const struct shape_sums *sums, struct shape_measure *measure,
                            struct error *err)
{
    struct line_work w;
    struct scatter all[4] = {{0}};
    const double stiffness = fiber_sections_stiffness(sums->section, lines->n_vertex, sums->section_length);
    status s = lines->shape == NULL ? polyline_shapes_init(lines, err) : STATUS_OK;
    if (!line_work_init(&w, lines) && s == STATUS_OK)
        s = error_set(err, STATUS_NO_MEMORY, "cannot measure the sections of fibers: out of memory");
    for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++) {
        start_line(&w, lines, l, sums);
        add_scatter(&w, sums, all);
    }
    *measure = (struct shape_measure){
        .radius_noise = noise_of(&all[0]), .section_noise = noise_of(&all[1]), .lumen_noise = noise_of(&all[2])};
    /* too short lines show the shorter pieces at most */
    measure->axis_noise = fmax(measure->radius_noise, noise_of(&all[3]));
    measure->shared_radius_se = sqrt((measure->radius_noise / sums->slope + sums->model_square) * sums->shared_radius);
    for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++) {
        struct scatter own[4] = {{0}};
        start_line(&w, lines, l, sums);
        add_scatter(&w, sums, own);
        struct fiber_shape *shape = lines->shape + w.first;
        measure->n_varying += measure_radius(&w, sums, line_noise(&own[0], &all[0]), (double)lines->radius[l], shape);
        measure_section(&w, sums, stiffness, line_noise(&own[1], &all[1]), lines, l);
        if (sums->lumen != NULL)
            measure->n_varying_lumen +=
                measure_lumen(&w, sums, line_noise(&own[2], &all[2]), (double)sums->area[l], shape);
    }
    line_work_release(&w);
    return s;
}
