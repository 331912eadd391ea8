/* Bytes of RGL's measured BRDFs for tests, whose values are known in closed form: sigma 0.5 and ndf 2 everywhere;
 * visible normals of the density 0.5 + x, so that the warp is x' = (x + x^2) / 2, y' = y; values of the channels c
 * = 0, 1, 2 are f cos(theta_o) = (c + 1) (0.1 + 0.2 x' + 0.05 y' + 0.03 (phi_i + pi)). */
#ifndef SELVEDGE_TESTS_RGL_BYTES_H
#define SELVEDGE_TESTS_RGL_BYTES_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { RGL_BYTES_MAX = 16384 };

struct rgl_bytes {
    size_t n_phi, n_wavelength; /* 0 wavelengths: rgb */
    size_t n_rgb;               /* channels of rgb; 0: 3 */
    double turn_rad;            /* azimuths of the light go from -pi over this angle */
    double first_nm, step_nm;
    bool without_sigma, some_not_measured;
    size_t n;
    char bytes[RGL_BYTES_MAX];
};

static inline void rgl_put(char *to, size_t *at, uint64_t value, size_t n)
{
    for (size_t i = 0; i < n; i++) to[(*at)++] = (char)(value >> (8 * i));
}

struct rgl_bytes_field {
    const char *name;
    size_t n_dim, shape[5];
    const float *value; /* NULL: 8-bit numbers, in octet */
    const char *octet;
};

static inline size_t rgl_bytes_count(const struct rgl_bytes_field *f)
{
    size_t n = f->value != NULL ? 4 : 1;
    for (size_t i = 0; i < f->n_dim; i++) n *= f->shape[i];
    return n;
}

static inline void rgl_bytes_assemble(struct rgl_bytes *b, const struct rgl_bytes_field *field, size_t n_field)
{
    size_t head = 18, at = 14;
    memcpy(b->bytes, "tensor_file\0\1", 14);
    for (size_t i = 0; i < n_field; i++) head += 13 + strlen(field[i].name) + 8 * field[i].n_dim;
    rgl_put(b->bytes, &at, n_field, 4);
    for (size_t i = 0; i < n_field; i++) {
        const struct rgl_bytes_field *f = &field[i];
        rgl_put(b->bytes, &at, strlen(f->name), 2);
        memcpy(b->bytes + at, f->name, strlen(f->name));
        at += strlen(f->name);
        rgl_put(b->bytes, &at, f->n_dim, 2);
        rgl_put(b->bytes, &at, f->value != NULL ? 10 : 1, 1);
        rgl_put(b->bytes, &at, head, 8);
        for (size_t k = 0; k < f->n_dim; k++) rgl_put(b->bytes, &at, f->shape[k], 8);
        memcpy(b->bytes + head, f->value != NULL ? (const char *)f->value : f->octet, rgl_bytes_count(f));
        head += rgl_bytes_count(f);
    }
    b->n = head;
}

static inline void rgl_bytes_make(struct rgl_bytes *b)
{
    static const float theta[2] = {0.0f, 1.5f}, ndf[4] = {2, 2, 2, 2}, sigma[4] = {0.5f, 0.5f, 0.5f, 0.5f};
    static const char jacobian[1] = {1};
    float phi[16], vndf[16 * 8], level[16 * 2 * 32 * 4], nm[32];
    char valid[16 * 8];
    size_t n_level = b->n_wavelength > 0 ? b->n_wavelength : b->n_rgb > 0 ? b->n_rgb : 3, n = 0;
    for (size_t p = 0; p < b->n_phi; p++) {
        double share = b->n_phi > 1 ? (double)p / (double)(b->n_phi - 1) : 0.0;
        phi[p] = (float)(b->n_phi > 2 ? -M_PI + share * b->turn_rad : 0.0);
        for (size_t i = 0; i < 8; i++) {
            vndf[8 * p + i] = i % 2 == 0 ? 0.5f : 1.5f;
            valid[8 * p + i] = !b->some_not_measured || i % 2 == 0;
        }
        for (size_t i = 0; i < 2 * n_level * 4; i++) {
            double c = b->n_wavelength > 0 ? 1.0 : (double)(i / 4 % 3 + 1), turned = b->n_phi > 2 ? phi[p] + M_PI : 0.0;
            level[n++] = (float)(c * (0.1 + 0.2 * (double)(i % 2) + 0.05 * (double)(i / 2 % 2) + 0.03 * turned));
        }
    }
    for (size_t i = 0; i < b->n_wavelength; i++) nm[i] = (float)(b->first_nm + b->step_nm * (double)i);
    const struct rgl_bytes_field field[] = {
        {"phi_i", 1, {b->n_phi}, phi, NULL},
        {"theta_i", 1, {2}, theta, NULL},
        {"ndf", 2, {2, 2}, ndf, NULL},
        {"vndf", 4, {b->n_phi, 2, 2, 2}, vndf, NULL},
        {"jacobian", 1, {1}, NULL, jacobian},
        {b->n_wavelength > 0 ? "spectra" : "rgb", 5, {b->n_phi, 2, n_level, 2, 2}, level, NULL},
        {"valid", 4, {b->n_phi, 2, 2, 2}, NULL, valid},
        {b->without_sigma ? "sigmo" : "sigma", 2, {2, 2}, sigma, NULL},
        {"wavelengths", 1, {b->n_wavelength}, nm, NULL},
    };
    rgl_bytes_assemble(b, field, b->n_wavelength > 0 ? 9 : 8);
}

#endif
