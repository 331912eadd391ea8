#include "geometry/fibers/axes/model/fiber_section.h"
#include "base/small_matrix.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { BAND = SECTION_BAND }; /* the diagonal and four below it: second differences of two components */
/* Bounds of the half logarithm of the ratio of axes (a ratio of 4), and of one step of a component. */
static const double FLATNESS_MOST = 0.69, STEP_MOST = 0.2;

/* Makes u a unit vector perpendicular to the unit vector t. */
static void make_perpendicular(const float t[3], float u[3])
{
    float along = u[0] * t[0] + u[1] * t[1] + u[2] * t[2], norm = 0.0f;
    for (int a = 0; a < 3; a++) {
        u[a] -= along * t[a];
        norm += u[a] * u[a];
    }
    if (!(norm > 1e-6f)) { /* u was along t: any other axis of the grid will do */
        int least = fabsf(t[0]) <= fabsf(t[1]) && fabsf(t[0]) <= fabsf(t[2]) ? 0 : fabsf(t[1]) <= fabsf(t[2]) ? 1 : 2;
        for (int a = 0; a < 3; a++) u[a] = (a == least ? 1.0f : 0.0f) - t[least] * t[a];
        norm = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
    }
    norm = 1.0f / sqrtf(norm);
    for (int a = 0; a < 3; a++) u[a] *= norm;
}

void fiber_sections_start(const struct polyline_set *lines, struct fiber_section *section)
{
    for (size_t l = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l]; i < lines->first[l + 1]; i++) {
            float t[3];
            section[i] = (struct fiber_section){{0.0f, 0.0f, 0.0f}, 0.0f, 0.0f};
            if (i > lines->first[l]) memcpy(section[i].u, section[i - 1].u, sizeof section[i].u);
            polyline_tangent(lines, l, i, 1, t);
            make_perpendicular(t, section[i].u);
        }
}

void fiber_sections_turn(const struct polyline_set *lines, struct fiber_section *section)
{
    for (size_t l = 0; l < lines->n_line; l++)
        for (size_t i = lines->first[l]; i < lines->first[l + 1]; i++) {
            float t[3];
            polyline_tangent(lines, l, i, 1, t);
            make_perpendicular(t, section[i].u);
        }
}

struct section_view fiber_section_view(const struct fiber_section *first, const struct fiber_section *second,
                                       const float a[3], const float b[3])
{
    struct section_view w;
    float t[3], norm = 0.0f, c = 0.5f * (first->c + second->c), s = 0.5f * (first->s + second->s);
    for (int i = 0; i < 3; i++) {
        t[i] = b[i] - a[i];
        norm += t[i] * t[i];
        w.u[i] = first->u[i] + second->u[i];
    }
    norm = norm > 0.0f ? 1.0f / sqrtf(norm) : 0.0f;
    for (int i = 0; i < 3; i++) t[i] *= norm;
    make_perpendicular(t, w.u);
    for (int i = 0; i < 3; i++) w.v[i] = t[(i + 1) % 3] * w.u[(i + 2) % 3] - t[(i + 2) % 3] * w.u[(i + 1) % 3];
    /* exp(-2 L) = cosh(2 f) - sinh(2 f) L / f */
    float f = sqrtf(c * c + s * s), even = coshf(2.0f * f), odd = f > 1e-6f ? sinhf(2.0f * f) / f : 2.0f;
    w.uu = even - odd * c;
    w.vv = even + odd * c;
    w.uv = -odd * s;
    w.stretch = expf(f);
    return w;
}

struct section_place fiber_section_place(const struct section_view *w, float radius, const float offset[3])
{
    float x = 0.0f, y = 0.0f;
    for (int a = 0; a < 3; a++) {
        x += offset[a] * w->u[a];
        y += offset[a] * w->v[a];
    }
    float p = w->uu * x + w->uv * y, q = w->uv * x + w->vv * y, form = x * p + y * q, norm = sqrtf(p * p + q * q);
    struct section_place place = {.share = sqrtf(form) / radius};
    float inverse = norm > 0.0f ? 1.0f / norm : 0.0f, outline = place.share > 0.0f ? inverse / place.share : 0.0f;
    place.depth = (form - radius * radius * place.share) * inverse;
    place.by_radius = -radius * place.share * inverse;
    place.by_c = -(x * p - y * q) * outline;
    place.by_s = -(y * p + x * q) * outline;
    for (int a = 0; a < 3; a++) place.normal[a] = (p * w->u[a] + q * w->v[a]) * inverse;
    return place;
}

void fiber_section_to_shape(const struct fiber_section *section, const float t[3], struct fiber_shape *shape)
{
    const float angle = 0.5f * atan2f(section->s, section->c), cosine = cosf(angle), sine = sinf(angle);
    const float *u = section->u;
    shape->ratio = fiber_section_ratio(section);
    for (int a = 0; a < 3; a++)
        shape->long_axis[a] =
            cosine * u[a] + sine * (t[(a + 1) % 3] * u[(a + 2) % 3] - t[(a + 2) % 3] * u[(a + 1) % 3]);
}

void fiber_section_take_shape(const struct fiber_shape *shape, const float t[3], struct fiber_section *section)
{
    const float flatness = fiber_shape_has_section(shape) ? 0.5f * logf(shape->ratio) : 0.0f;
    float cosine = 0.0f, sine = 0.0f, *u = section->u;
    make_perpendicular(t, u);
    for (int a = 0; a < 3; a++) {
        cosine += shape->long_axis[a] * u[a];
        sine += shape->long_axis[a] * (t[(a + 1) % 3] * u[(a + 2) % 3] - t[(a + 2) % 3] * u[(a + 1) % 3]);
    }
    const float square = fmaxf(cosine * cosine + sine * sine, 1e-6f);
    section->c = flatness * (cosine * cosine - sine * sine) / square;
    section->s = flatness * 2.0f * cosine * sine / square;
}

float fiber_section_ratio(const struct fiber_section *section)
{
    return expf(2.0f * sqrtf(section->c * section->c + section->s * section->s));
}

static double within(double most, double value) { return fmin(most, fmax(-most, value)); }

/* Mean information of the data on c or s at a vertex. */
static double information(const struct section_equation *equation, size_t n_vertex)
{
    double sum = 0.0;
    for (size_t i = 0; i < n_vertex; i++) sum += 0.5 * (double)(equation[i].normal[0] + equation[i].normal[2]);
    return fmax(sum / fmax(1.0, (double)n_vertex), 1e-12);
}

static const double second[3] = {1.0, -2.0, 1.0};

/* Fills the banded matrix m of a line of n vertices. */
static void fill_matrix(const struct section_equation *q, size_t n, double stiffness, double hold, double (*m)[BAND])
{
    memset(m, 0, 2 * n * sizeof *m);
    for (size_t i = 0; i < n; i++) {
        m[2 * i][0] += (double)q[i].normal[0] + hold;
        m[2 * i + 1][0] += (double)q[i].normal[2] + hold;
        m[2 * i + 1][1] += (double)q[i].normal[1];
    }
    for (size_t i = 0; i + 2 < n; i++)
        for (size_t a = 0; a < 2; a++)
            for (size_t r = 0; r < 3; r++)
                for (size_t c = 0; c <= r; c++) m[2 * (i + r) + a][2 * (r - c)] += stiffness * second[r] * second[c];
}

/* Fills the right-hand side x of a line of n vertices. */
static void fill_line(const struct section_equation *q, const struct fiber_section *section, size_t n, double stiffness,
                      double hold, double *x)
{
    memset(x, 0, 2 * n * sizeof *x);
    for (size_t i = 0; i < n; i++) {
        const double at[2] = {(double)section[i].c, (double)section[i].s};
        for (size_t a = 0; a < 2; a++) x[2 * i + a] += (double)q[i].gradient[a] - hold * at[a];
    }
    for (size_t i = 0; i + 2 < n; i++) {
        const struct fiber_section *q3 = section + i;
        const double bend[2] = {(double)q3[0].c - 2.0 * (double)q3[1].c + (double)q3[2].c,
                                (double)q3[0].s - 2.0 * (double)q3[1].s + (double)q3[2].s};
        for (size_t a = 0; a < 2; a++)
            for (size_t r = 0; r < 3; r++) x[2 * (i + r) + a] -= stiffness * second[r] * bend[a];
    }
}

static void step_line(const double *x, size_t n, struct fiber_section *section)
{
    for (size_t i = 0; i < n; i++) {
        double c = (double)section[i].c + within(STEP_MOST, x[2 * i]);
        double s = (double)section[i].s + within(STEP_MOST, x[2 * i + 1]);
        double flatness = sqrt(c * c + s * s), scale = flatness > FLATNESS_MOST ? FLATNESS_MOST / flatness : 1.0;
        section[i].c = (float)(scale * c);
        section[i].s = (float)(scale * s);
    }
}

double fiber_sections_stiffness(const struct section_equation *equation, size_t n_vertex, double length)
{
    return pow(length, 4.0) * information(equation, n_vertex);
}

bool fiber_section_variance(const struct section_equation *equation, size_t n, double stiffness, double hold, double *m,
                            double (*variance)[3])
{
    double(*row)[BAND] = (double(*)[BAND])m;
    fill_matrix(equation, n, stiffness, hold, row);
    if (!small_invert_banded(m, 2 * n, BAND)) return false;
    for (size_t i = 0; i < n; i++) {
        variance[i][0] = row[2 * i][0];
        variance[i][1] = row[2 * i + 1][1];
        variance[i][2] = row[2 * i + 1][0];
    }
    return true;
}

struct section_job {
    const struct polyline_set *lines;
    const struct section_equation *equation;
    struct fiber_section *section;
    double stiffness, hold;
    atomic_bool failed; /* memory was out */
};

static void solve_line(void *context, size_t l, size_t i_thread)
{
    (void)i_thread;
    struct section_job *job = context;
    const size_t n = polyline_length(job->lines, l), first = job->lines->first[l];
    double(*m)[BAND] = malloc((2 * n + 1) * sizeof *m), *x = malloc((2 * n + 1) * sizeof *x);
    if (m != NULL && x != NULL) {
        fill_matrix(job->equation + first, n, job->stiffness, job->hold, m);
        fill_line(job->equation + first, job->section + first, n, job->stiffness, job->hold, x);
        if (small_solve_banded(m[0], 2 * n, BAND, x)) step_line(x, n, job->section + first);
    } else {
        job->failed = true;
    }
    free(m);
    free(x);
}

status fiber_sections_solve(const struct polyline_set *lines, const struct section_equation *equation, double length,
                            double hold, struct fiber_section *section, struct thread_pool *pool, struct error *err)
{
    struct section_job job = {.lines = lines,
                              .equation = equation,
                              .section = section,
                              .stiffness = fiber_sections_stiffness(equation, lines->n_vertex, length),
                              .hold = hold};
    status s = thread_pool_run(pool, lines->n_line, solve_line, &job, NULL);
    if (s == STATUS_OK && job.failed)
        s = error_set(err, STATUS_NO_MEMORY, "cannot fit the sections of fibers: out of memory");
    return s;
}
