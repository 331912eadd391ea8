#include "renderer/mesh/mesh_shapes.h"

#include <math.h>

/* A grid of (n[0] + 1) x (n[1] + 1) points, each with a texture coordinate; positions are the caller's. */
static status new_grid(const size_t n[2], struct mesh *m, struct error *err)
{
    size_t n_point = (n[0] + 1) * (n[1] + 1), i = 0;
    status s = mesh_new(m, n_point, n_point, 2 * n[0] * n[1], err);
    for (size_t y = 0; y < n[1] && s == STATUS_OK; y++)
        for (size_t x = 0; x < n[0]; x++) {
            uint32_t a = (uint32_t)(y * (n[0] + 1) + x), b = a + 1, c = a + (uint32_t)n[0] + 1, d = c + 1;
            m->triangle[i++] = (struct mesh_triangle){{a, b, d}, {a, b, d}};
            m->triangle[i++] = (struct mesh_triangle){{a, d, c}, {a, d, c}};
        }
    return s;
}

static status check_size(double a, double b, size_t n, size_t n_other, struct error *err)
{
    if (a > 0.0 && b > 0.0 && isfinite(a) && isfinite(b) && n > 0 && n_other > 0 && n <= 10000 && n_other <= 10000)
        return STATUS_OK;
    return error_set(err, STATUS_INVALID, "cannot make a mesh of %g x %g mm with %zu x %zu cells", a, b, n, n_other);
}

status mesh_flat(const double size_mm[2], const size_t n_cell[2], struct mesh *m, struct error *err)
{
    status s = check_size(size_mm[0], size_mm[1], n_cell[0], n_cell[1], err);
    if (s == STATUS_OK) s = new_grid(n_cell, m, err);
    for (size_t i = 0; s == STATUS_OK && i < m->n_position; i++)
        for (int a = 0; a < 2; a++) {
            size_t k = a == 0 ? i % (n_cell[0] + 1) : i / (n_cell[0] + 1);
            m->position_mm[i][a] = m->texture_mm[i][a] = size_mm[a] * ((double)k / (double)n_cell[a] - 0.5);
        }
    return s;
}

status mesh_cylinder(double radius_mm, double length_mm, double angle_rad, size_t n_cell, struct mesh *m,
                     struct error *err)
{
    const size_t n[2] = {n_cell, 1};
    status s = check_size(radius_mm, length_mm, n_cell, 1, err);
    if (s == STATUS_OK && !(angle_rad > 0.0 && angle_rad <= M_PI))
        s = error_set(err, STATUS_INVALID, "cannot make a cylinder over an angle of %g rad", angle_rad);
    if (s == STATUS_OK) s = new_grid(n, m, err);
    for (size_t i = 0; s == STATUS_OK && i < m->n_position; i++) {
        double angle = angle_rad * (2.0 * (double)(i % (n_cell + 1)) / (double)n_cell - 1.0);
        double along = length_mm * ((double)(i / (n_cell + 1)) - 0.5);
        m->position_mm[i][0] = radius_mm * sin(angle);
        m->position_mm[i][1] = m->texture_mm[i][1] = along;
        m->position_mm[i][2] = radius_mm * (cos(angle) - 1.0);
        m->texture_mm[i][0] = radius_mm * angle;
    }
    return s;
}
