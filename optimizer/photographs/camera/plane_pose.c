#include "optimizer/photographs/camera/plane_pose.h"

#include "base/small_matrix.h"

#include <math.h>
#include <string.h>

/* Shift and scale after which points have mean 0 and mean square distance 2: x' = (x - shift) scale. */
struct normaliser {
    double shift[2], scale;
};

static struct normaliser normaliser_of(size_t n, const double (*p)[2])
{
    struct normaliser k = {{0, 0}, 0};
    double square = 0.0;
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < 2; c++) k.shift[c] += p[i][c] / (double)n;
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < 2; c++) square += (p[i][c] - k.shift[c]) * (p[i][c] - k.shift[c]) / (double)n;
    k.scale = square > 0.0 ? sqrt(2.0 / square) : 1.0;
    return k;
}

static void add_equation(double a[81], const double row[9])
{
    for (size_t i = 0; i < 9; i++)
        for (size_t j = 0; j < 9; j++) a[9 * i + j] += row[i] * row[j];
}

void plane_map_apply(const double m[9], const double p[2], double out[2])
{
    double w = m[6] * p[0] + m[7] * p[1] + m[8];
    out[0] = (m[0] * p[0] + m[1] * p[1] + m[2]) / w;
    out[1] = (m[3] * p[0] + m[4] * p[1] + m[5]) / w;
}

status plane_map_fit(size_t n, const double (*plane)[2], const double (*pixel)[2], double map[9], double *rms_px,
                     struct error *err)
{
    double a[81] = {0}, value[9], vector[81], h[9], back[9], inner[9];
    struct normaliser from = normaliser_of(n, plane), to = normaliser_of(n, pixel);
    for (size_t i = 0; i < n; i++) {
        double x = (plane[i][0] - from.shift[0]) * from.scale, y = (plane[i][1] - from.shift[1]) * from.scale;
        double u = (pixel[i][0] - to.shift[0]) * to.scale, v = (pixel[i][1] - to.shift[1]) * to.scale;
        add_equation(a, (double[9]){x, y, 1, 0, 0, 0, -u * x, -u * y, -u});
        add_equation(a, (double[9]){0, 0, 0, x, y, 1, -v * x, -v * y, -v});
    }
    small_eigen(a, 9, value, vector);
    size_t least = 0, second = 1;
    for (size_t i = 1; i < 9; i++)
        if (value[i] < value[least]) least = i;
    second = least == 0 ? 1 : 0;
    for (size_t i = 0; i < 9; i++)
        if (i != least && value[i] < value[second]) second = i;
    if (!(value[second] > 1e-9 * (double)n))
        return error_set(err, STATUS_NUMERIC, "the points of the plane do not determine a map: they lie on a line");
    for (size_t i = 0; i < 9; i++) h[i] = vector[9 * i + least];
    /* map = T_to^-1 h T_from */
    const double t_from[9] = {from.scale, 0, -from.shift[0] * from.scale, 0, from.scale, -from.shift[1] * from.scale, 0,
                              0,          1};
    const double t_back[9] = {1.0 / to.scale, 0, to.shift[0], 0, 1.0 / to.scale, to.shift[1], 0, 0, 1};
    small_multiply(h, t_from, 3, inner);
    small_multiply(t_back, inner, 3, back);
    memcpy(map, back, sizeof back);
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        double at[2];
        plane_map_apply(map, plane[i], at);
        sum += (at[0] - pixel[i][0]) * (at[0] - pixel[i][0]) + (at[1] - pixel[i][1]) * (at[1] - pixel[i][1]);
    }
    *rms_px = sqrt(sum / (double)n);
    return STATUS_OK;
}

double plane_map_scale(const double m[9], const double p[2])
{
    double w = m[6] * p[0] + m[7] * p[1] + m[8], at[2], j[4];
    plane_map_apply(m, p, at);
    for (size_t r = 0; r < 2; r++)
        for (size_t c = 0; c < 2; c++) j[2 * r + c] = (m[3 * r + c] - at[r] * m[6 + c]) / w;
    double s = j[0] * j[0] + j[1] * j[1] + j[2] * j[2] + j[3] * j[3], det = j[0] * j[3] - j[1] * j[2];
    return sqrt(0.5 * (s + sqrt(fmax(0.0, s * s - 4.0 * det * det)))); /* the larger singular value */
}

/* The plane's pose before the camera: axis[0] and axis[1] are its x and y, axis[2] its z, axis[3] its origin, in the
 * camera's frame. */
static void pose_of_map(const double m[9], const double focal_px[2], const double center_px[2], double axis[4][3])
{
    double column[3][3], length[2] = {0};
    for (size_t k = 0; k < 3; k++) { /* the map without the lens: r1, r2, t, all with one factor */
        column[k][0] = (m[k] - center_px[0] * m[6 + k]) / focal_px[0];
        column[k][1] = (m[3 + k] - center_px[1] * m[6 + k]) / focal_px[1];
        column[k][2] = m[6 + k];
        if (k < 2)
            length[k] = sqrt(column[k][0] * column[k][0] + column[k][1] * column[k][1] + column[k][2] * column[k][2]);
    }
    double factor = 2.0 / (length[0] + length[1]) * (column[2][2] < 0.0 ? -1.0 : 1.0);
    for (size_t k = 0; k < 3; k++)
        for (size_t c = 0; c < 3; c++) axis[k < 2 ? k : 3][c] = factor * column[k][c];
    const double *a = axis[0], *b = axis[1];
    const double up[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    memcpy(axis[2], up, sizeof up);
}

static status refuse_mirrored(struct error *err)
{
    return error_set(err, STATUS_INVALID, "the markers lie mirrored: their places do not fit to what the camera sees");
}

status plane_map_camera(const double m[9], const double focal_px[2], const double center_px[2], double camera[3],
                        struct error *err)
{
    double axis[4][3];
    pose_of_map(m, focal_px, center_px, axis);
    const double *t = axis[3];
    for (size_t k = 0; k < 3; k++) camera[k] = -(axis[k][0] * t[0] + axis[k][1] * t[1] + axis[k][2] * t[2]);
    return camera[2] > 0.0 ? STATUS_OK : refuse_mirrored(err);
}

status plane_map_project(const double m[9], const double focal_px[2], const double center_px[2], const double p[3],
                         double pixel[2], struct error *err)
{
    double axis[4][3], at[3];
    pose_of_map(m, focal_px, center_px, axis);
    for (size_t c = 0; c < 3; c++) at[c] = axis[3][c] + p[0] * axis[0][c] + p[1] * axis[1][c] + p[2] * axis[2][c];
    if (!(at[2] > 0.0)) return refuse_mirrored(err);
    for (size_t c = 0; c < 2; c++) pixel[c] = center_px[c] + focal_px[c] * at[c] / at[2];
    return STATUS_OK;
}
