/* Measured BRDFs of RGL's database (Dupuy and Jakob 2018, "An Adaptive Parameterization for Efficient Material
 * Acquisition and Rendering"). Fields of the container (tensor_file.h), for light from (phi_i, theta_i) in radians:
 *   ndf, sigma       normals m of the microfacets, and their projected area, over the square of directions
 *   vndf             density of the visible normals over that square, for each direction of the light
 *   rgb or spectra   f cos(theta_o) 4 sigma(i) / ndf(m) (with jacobian 1, else f cos(theta_o)), over the square that
 *                    the warp by vndf makes even, for each direction of the light and channel or wavelength
 *   valid            optional: 0 where that sample was not measured
 * A direction is (sqrt(2 theta / pi), (phi + pi) / 2 pi) in the square; for isotropic BRDFs phi counts from the light.
 * One or two phi_i: isotropic. Azimuths of the light over half or a quarter of a turn, from -pi: the BRDF is symmetric
 * to a turn by pi, or also to both axes. */
#include "base/files/durable.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/photographs/rows/brdf_file.h"
#include "optimizer/photographs/rows/brdf_spectrum.h"
#include "optimizer/photographs/rows/brdf_warp.h"
#include "optimizer/photographs/rows/tensor_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_WAVELENGTH = 4096 };

struct rgl {
    bool isotropic, has_jacobian;
    int n_fold; /* azimuths of the light go over 1 / n_fold of a turn */
    struct warp_axes axes;
    struct warp_table ndf, sigma, vndf, valid, channel[3];
};

static void close_rgl(void *handle)
{
    struct rgl *r = handle;
    if (r == NULL) return;
    free(r->axes.phi_rad);
    free(r->axes.theta_rad);
    free(r->ndf.value);
    free(r->sigma.value);
    free(r->vndf.value);
    free(r->valid.value);
    for (size_t c = 0; c < 3; c++) free(r->channel[c].value);
    free(r);
}

/* The fault of a file, or NULL; "" when memory is short. */
typedef const char *fault_text;
static const char no_memory[] = "";

static fault_text copy_axis(const struct tensor_field *f, double **axis, size_t *n)
{
    if (f == NULL) return "it lacks phi_i or theta_i";
    *axis = malloc(f->n * sizeof **axis);
    *n = f->n;
    if (*axis == NULL) return no_memory;
    for (size_t i = 0; i < f->n; i++) {
        (*axis)[i] = tensor_field_float(f, i);
        if (!(fabs((*axis)[i]) < 7.0) || (i > 0 && !((*axis)[i] > (*axis)[i - 1])))
            return "its phi_i or theta_i do not rise";
    }
    return NULL;
}

/* Copies a field of n_slice x height x width values. */
static fault_text copy_table(const struct tensor_field *f, size_t n_slice, struct warp_table *t)
{
    if (f == NULL) return "it lacks sigma, ndf or vndf, or they have other shapes than RGL's";
    t->width = f->shape[f->n_dim - 1];
    t->height = f->shape[f->n_dim - 2];
    t->n_slice = n_slice;
    if (t->width < 2 || t->height < 2 || f->n != n_slice * t->width * t->height)
        return "its sigma, ndf or vndf have other shapes than RGL's";
    t->value = malloc(f->n * sizeof *t->value);
    if (t->value == NULL) return no_memory;
    for (size_t i = 0; i < f->n; i++) {
        t->value[i] = (float)tensor_field_float(f, i);
        if (!(t->value[i] >= 0.0f && t->value[i] < 1e9f)) return "its sigma, ndf or vndf have values below 0";
    }
    return NULL;
}

/* Channels of the values at the wavelengths of `spectra`, or of `rgb` (wavelengths NULL). */
static fault_text copy_channels(const struct tensor_field *f, const struct tensor_field *wavelengths, struct rgl *r)
{
    size_t n_each = f->shape[3] * f->shape[4], n_level = f->shape[2], n_slice = f->shape[0] * f->shape[1];
    double nm[MAX_WAVELENGTH], weight[MAX_WAVELENGTH][3];
    if (f->shape[0] != r->axes.n_phi || f->shape[1] != r->axes.n_theta || f->shape[3] < 2 || f->shape[4] < 2)
        return "its rgb or spectra have another shape than RGL's";
    memset(weight, 0, sizeof weight);
    if (wavelengths == NULL) {
        if (n_level != 3) return "its rgb has another shape than RGL's";
        for (size_t c = 0; c < 3; c++) weight[c][c] = 1.0;
    } else {
        if (wavelengths->n != n_level || n_level > MAX_WAVELENGTH)
            return "it has another number of wavelengths than spectra";
        for (size_t i = 0; i < n_level; i++) nm[i] = tensor_field_float(wavelengths, i);
        if (!brdf_spectrum_weights(nm, n_level, weight)) return "its wavelengths give no color: it needs 400 to 700 nm";
    }
    for (size_t c = 0; c < 3; c++) {
        r->channel[c] = (struct warp_table){f->shape[4], f->shape[3], n_slice, calloc(n_slice * n_each, sizeof(float))};
        if (r->channel[c].value == NULL) return no_memory;
        for (size_t i = 0; i < n_slice * n_each; i++) {
            double sum = 0.0;
            for (size_t k = 0; k < n_level; k++) {
                size_t at = (i / n_each * n_level + k) * n_each + i % n_each;
                if (weight[k][c] != 0.0) sum += weight[k][c] * tensor_field_float(f, at);
            }
            if (!(fabs(sum) < 1e9)) return "its rgb or spectra have values that are no numbers";
            r->channel[c].value[i] = (float)sum;
        }
    }
    return NULL;
}

/* A file may say which samples were measured, in the shape of its channels or of one azimuth of the light. */
static fault_text copy_valid(const struct tensor_field *f, struct rgl *r)
{
    const struct warp_table *k = &r->channel[0];
    if (f == NULL || f->shape[3] != k->width || f->shape[2] != k->height || f->shape[1] != r->axes.n_theta ||
        f->shape[0] != r->axes.n_phi)
        return NULL;
    r->valid = (struct warp_table){k->width, k->height, k->n_slice, malloc(f->n * sizeof(float))};
    if (r->valid.value == NULL) return no_memory;
    for (size_t i = 0; i < f->n; i++) r->valid.value[i] = f->data[i] != 0 ? 1.0f : 0.0f;
    return NULL;
}

static fault_text set_symmetry(struct rgl *r)
{
    const struct warp_axes *a = &r->axes;
    r->isotropic = a->n_phi <= 2;
    r->n_fold = 1;
    if (r->isotropic) return NULL;
    r->n_fold = (int)lrint(2.0 * M_PI / (a->phi_rad[a->n_phi - 1] - a->phi_rad[0]));
    if (r->n_fold != 1 && r->n_fold != 2 && r->n_fold != 4)
        return "the azimuths of its light (phi_i) go over neither a whole, a half nor a quarter of a turn";
    if (fabs(a->phi_rad[0] + M_PI) > 0.1) return "the azimuths of its light (phi_i) do not begin at -pi";
    return NULL;
}

static fault_text fill(const struct tensor_file *t, struct rgl *r)
{
    const struct tensor_field *rgb = tensor_file_find(t, "rgb", TENSOR_FLOAT32, 5);
    const struct tensor_field *spectra = tensor_file_find(t, "spectra", TENSOR_FLOAT32, 5);
    const struct tensor_field *wavelengths = tensor_file_find(t, "wavelengths", TENSOR_FLOAT32, 1);
    const struct tensor_field *jacobian = tensor_file_find(t, "jacobian", TENSOR_UINT8, 1);
    const struct tensor_field *vndf = tensor_file_find(t, "vndf", TENSOR_FLOAT32, 4);
    fault_text fault = copy_axis(tensor_file_find(t, "phi_i", TENSOR_FLOAT32, 1), &r->axes.phi_rad, &r->axes.n_phi);
    if (fault == NULL)
        fault = copy_axis(tensor_file_find(t, "theta_i", TENSOR_FLOAT32, 1), &r->axes.theta_rad, &r->axes.n_theta);
    if (fault == NULL) fault = set_symmetry(r);
    if (fault == NULL) fault = copy_table(tensor_file_find(t, "ndf", TENSOR_FLOAT32, 2), 1, &r->ndf);
    if (fault == NULL) fault = copy_table(tensor_file_find(t, "sigma", TENSOR_FLOAT32, 2), 1, &r->sigma);
    if (fault == NULL && vndf != NULL && (vndf->shape[0] != r->axes.n_phi || vndf->shape[1] != r->axes.n_theta))
        fault = "its vndf has another shape than RGL's";
    if (fault == NULL) fault = copy_table(vndf, r->axes.n_phi * r->axes.n_theta, &r->vndf);
    if (fault == NULL && jacobian == NULL) fault = "it lacks jacobian";
    if (fault == NULL && rgb == NULL && (spectra == NULL || wavelengths == NULL))
        fault = "it has neither rgb nor spectra";
    if (fault == NULL) fault = copy_channels(rgb != NULL ? rgb : spectra, rgb != NULL ? NULL : wavelengths, r);
    if (fault == NULL) fault = copy_valid(tensor_file_find(t, "valid", TENSOR_UINT8, 4), r);
    if (fault != NULL) return fault;
    r->has_jacobian = jacobian->data[0] != 0;
    warp_table_normalize(&r->vndf);
    return NULL;
}

static status open_rgl(const char *path, enum job_symmetry symmetry, void **handle, struct error *err)
{
    struct tensor_file t;
    status s = tensor_file_read(path, &t, err);
    if (s != STATUS_OK) return s;
    struct rgl *r = calloc(1, sizeof *r);
    fault_text fault = r != NULL ? fill(&t, r) : no_memory;
    tensor_file_release(&t);
    if (fault == NULL && symmetry != JOB_SYMMETRY_FILE && (symmetry == JOB_SYMMETRY_ISOTROPIC) != r->isotropic)
        fault = r->isotropic ? "it is isotropic; leave out 'symmetry'" : "it is anisotropic; leave out 'symmetry'";
    if (fault == NULL) {
        *handle = r;
        return STATUS_OK;
    }
    close_rgl(r);
    return error_set(err, fault == no_memory ? STATUS_NO_MEMORY : STATUS_FORMAT, "cannot read measured BRDF '%s': %s",
                     path_file_name(path), fault == no_memory ? "out of memory" : fault);
}

static bool isotropic_rgl(const void *handle) { return ((const struct rgl *)handle)->isotropic; }

/* Turns or mirrors both directions so that the azimuth of the light lies in the table: in (-pi, 0) or (-pi, -pi/2). */
static void fold(int n_fold, double light[3], double camera[3])
{
    double turn[2] = {1.0, 1.0};
    if (n_fold >= 2) turn[1] = light[1] >= 0.0 ? -1.0 : 1.0;
    if (n_fold == 2) turn[0] = turn[1];
    if (n_fold == 4) turn[0] = light[0] >= 0.0 ? -1.0 : 1.0;
    for (size_t c = 0; c < 2; c++) {
        light[c] *= turn[c];
        camera[c] *= turn[c];
    }
}

/* Place of a direction in the square of directions. */
static void square_of(double theta, double phi, double u[2])
{
    double turns = (phi + M_PI) / (2.0 * M_PI);
    u[0] = sqrt(theta * M_2_PI);
    u[1] = turns - floor(turns);
}

static bool was_measured(const struct rgl *r, const struct warp_mix *mix, const double s[2])
{
    return r->valid.value == NULL || warp_table_value(&r->valid, mix, s) > 0.5;
}

static bool eval_rgl(const void *handle, const double to_light[3], const double to_camera[3], double f_rgb[3])
{
    const struct rgl *r = handle;
    double light[3], camera[3], m[3], u_light[2], u_m[2], s[2];
    struct warp_mix mix;
    memcpy(light, to_light, sizeof light);
    memcpy(camera, to_camera, sizeof camera);
    if (light[2] <= 0.0 || camera[2] <= 0.0) return false;
    fold(r->n_fold, light, camera);
    for (size_t c = 0; c < 3; c++) m[c] = light[c] + camera[c];
    double theta_i = acos(fmin(light[2], 1.0)), phi_i = atan2(light[1], light[0]);
    double theta_m = atan2(hypot(m[0], m[1]), m[2]), phi_m = atan2(m[1], m[0]);
    square_of(theta_i, phi_i, u_light);
    square_of(theta_m, r->isotropic ? phi_m - phi_i : phi_m, u_m);
    warp_mix_at(&r->axes, phi_i, theta_i, &mix);
    warp_table_invert(&r->vndf, &mix, u_m, s);
    if (!was_measured(r, &mix, s)) return false;
    double factor = 1.0 / camera[2], sigma = warp_table_value(&r->sigma, NULL, u_light);
    if (r->has_jacobian) factor *= warp_table_value(&r->ndf, NULL, u_m) / (4.0 * sigma);
    for (size_t c = 0; c < 3; c++) {
        f_rgb[c] = fmax(factor * warp_table_value(&r->channel[c], &mix, s), 0.0);
        if (!(f_rgb[c] < 1e6)) return false;
    }
    return true;
}

const brdf_reader rgl_brdf_reader = {.id = "rgl.v1",
                                     .title = "RGL",
                                     .suffix = ".bsdf",
                                     .open = open_rgl,
                                     .isotropic = isotropic_rgl,
                                     .eval = eval_rgl,
                                     .close = close_rgl};
