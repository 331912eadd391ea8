#include "geometry/volume/volume.h"

#include "geometry/volume/kept_directions.h"

#include <math.h>
#include <string.h>

static status check_shape(const size_t n[3], struct error *err)
{
    size_t total = 1;
    for (int a = 0; a < 3; a++) {
        if (n[a] == 0)
            return error_set(err, STATUS_INVALID, "cannot make volume: %zu x %zu x %zu voxels", n[0], n[1], n[2]);
        if (__builtin_mul_overflow(total, n[a], &total) || total > SIZE_MAX / 16)
            return error_set(err, STATUS_TOO_LARGE, "cannot make volume of %zu x %zu x %zu voxels: too large", n[0],
                             n[1], n[2]);
    }
    return STATUS_OK;
}

status volume_init_in(struct volume *v, const size_t n[3], const double voxel_size_m[3], struct scratch_space *space,
                      struct error *err)
{
    *v = (struct volume){.space = space};
    status s = check_shape(n, err);
    if (s != STATUS_OK) return s;
    memcpy(v->n, n, sizeof v->n);
    memcpy(v->voxel_size_m, voxel_size_m, sizeof v->voxel_size_m);
    void *density;
    s = scratch_new(space, volume_n_voxel(n) * sizeof *v->density, "densities", &density, err);
    v->density = density;
    return s;
}

status volume_init(struct volume *v, const size_t n[3], const double voxel_size_m[3], struct error *err)
{
    return volume_init_in(v, n, voxel_size_m, NULL, err);
}

void volume_release(struct volume *v)
{
    if (v == NULL) return;
    scratch_release(v->space, v->density);
    scratch_release(v->space, v->filled.voxel);
    scratch_release(v->space, v->filled.density);
    scratch_release(v->space, v->unknown.run);
    scratch_release(v->space, v->light.run);
    *v = (struct volume){0};
}

status volume_copy_unfilled(const struct volume *v, struct volume *to, struct error *err)
{
    const size_t n_slice = v->n[0] * v->n[1];
    status s = volume_init_in(to, v->n, v->voxel_size_m, v->space, err);
    for (size_t k = 0; k < v->n[2] && s == STATUS_OK; k++) {
        memcpy(to->density + k * n_slice, v->density + k * n_slice, n_slice * sizeof *v->density);
        scratch_keep_within(v->space);
    }
    for (size_t i = 0; i < v->filled.n && s == STATUS_OK; i++) to->density[v->filled.voxel[i]] = v->filled.density[i];
    return s;
}

status volume_fill_marked(struct volume *v, const uint8_t *mark, uint8_t least, struct error *err)
{
    const size_t n_slice = v->n[0] * v->n[1], n_all = volume_n_voxel(v->n);
    void *array[2] = {NULL, NULL};
    size_t n = 0;
    for (size_t i = 0; i < v->filled.n; i++) v->density[v->filled.voxel[i]] = v->filled.density[i];
    scratch_release(v->space, v->filled.voxel);
    scratch_release(v->space, v->filled.density);
    v->filled = (struct volume_filled){0};
    for (size_t i = 0; i < n_all; i++) n += mark[i] >= least;
    if (n == 0) return STATUS_OK;
    status s = scratch_new(v->space, n * sizeof *v->filled.voxel, "the lumens of fibers", &array[0], err);
    if (s == STATUS_OK)
        s = scratch_new(v->space, n * sizeof *v->filled.density, "the lumens of fibers", &array[1], err);
    v->filled.voxel = array[0];
    v->filled.density = array[1];
    for (size_t i = 0; s == STATUS_OK && i < n_all; i++) {
        if (i % n_slice == 0) scratch_keep_within(v->space);
        if (mark[i] < least) continue;
        v->filled.voxel[v->filled.n] = i;
        v->filled.density[v->filled.n++] = v->density[i];
        v->density[i] = 1.0f;
    }
    return s;
}

status direction_volume_init_in(struct direction_volume *v, const size_t n[3], const double voxel_size_m[3],
                                struct scratch_space *space, struct error *err)
{
    *v = (struct direction_volume){.space = space};
    status s = check_shape(n, err);
    if (s != STATUS_OK) return s;
    memcpy(v->n, n, sizeof v->n);
    memcpy(v->voxel_size_m, voxel_size_m, sizeof v->voxel_size_m);
    void *density = NULL, *octahedral = NULL;
    s = scratch_new(space, volume_n_voxel(n) * sizeof *v->density, "the densities of directions", &density, err);
    v->density = density;
    if (s == STATUS_OK)
        s = scratch_new(space, 2 * volume_n_voxel(n) * sizeof *v->octahedral, "directions", &octahedral, err);
    v->octahedral = octahedral;
    if (s != STATUS_OK) direction_volume_release(v);
    return s;
}

status direction_volume_init(struct direction_volume *v, const size_t n[3], const double voxel_size_m[3],
                             struct error *err)
{
    return direction_volume_init_in(v, n, voxel_size_m, NULL, err);
}

status direction_volume_init_kept(struct direction_volume *v, const size_t n[3], const double voxel_size_m[3],
                                  struct scratch_space *space, struct error *err)
{
    *v = (struct direction_volume){.space = space};
    memcpy(v->n, n, sizeof v->n);
    memcpy(v->voxel_size_m, voxel_size_m, sizeof v->voxel_size_m);
    return kept_directions_new(n, space, &v->kept_only, err);
}

void direction_volume_release(struct direction_volume *v)
{
    if (v == NULL) return;
    scratch_release(v->space, v->density);
    scratch_release(v->space, v->octahedral);
    kept_directions_free(v->kept_only);
    *v = (struct direction_volume){0};
}

bool direction_volume_is_kept(const struct direction_volume *v, size_t i_voxel)
{
    return v->kept_only != NULL ? voxel_bits_has(&v->kept_only->kept, i_voxel) : v->density[i_voxel] > 0;
}

const int16_t *direction_volume_code(const struct direction_volume *v, size_t i_voxel)
{
    return v->kept_only != NULL ? kept_directions_code(v->kept_only, i_voxel) : v->octahedral + 2 * i_voxel;
}

/* Octahedral map (Cigolle et al. 2014, "A survey of efficient representations for independent unit vectors"). */
void direction_volume_get(const struct direction_volume *v, size_t i_voxel, float d[3])
{
    const int16_t *code = direction_volume_code(v, i_voxel);
    float u = (float)code[0] / 32767.0f, w = (float)code[1] / 32767.0f;
    float z = 1.0f - fabsf(u) - fabsf(w);
    if (z < 0.0f) {
        float u_folded = (1.0f - fabsf(w)) * copysignf(1.0f, u);
        w = (1.0f - fabsf(u)) * copysignf(1.0f, w);
        u = u_folded;
    }
    float scale = 1.0f / sqrtf(u * u + w * w + z * z);
    d[0] = u * scale;
    d[1] = w * scale;
    d[2] = z * scale;
}

void direction_volume_set(struct direction_volume *v, size_t i_voxel, const float d[3])
{
    float scale = 1.0f / (fabsf(d[0]) + fabsf(d[1]) + fabsf(d[2]));
    float u = d[0] * scale, w = d[1] * scale;
    if (d[2] < 0.0f) {
        float u_folded = (1.0f - fabsf(w)) * copysignf(1.0f, u);
        w = (1.0f - fabsf(u)) * copysignf(1.0f, w);
        u = u_folded;
    }
    v->octahedral[2 * i_voxel] = (int16_t)lrintf(u * 32767.0f);
    v->octahedral[2 * i_voxel + 1] = (int16_t)lrintf(w * 32767.0f);
}
