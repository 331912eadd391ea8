#include "tests/support/cloth/cached_estimate.h"

#include "base/files/durable.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

void fit_check_memory(const void *p)
{
    if (p != NULL) return;
    fputs("out of memory\n", stderr);
    exit(1);
}

void kept_run_counts(const struct fit_phantom *f, const struct cached_call *c, uint32_t iteration, const size_t *count,
                     struct estimate *out)
{
    struct error err = {0};
    const struct estimate_request q = {
        .input = {.scene = {.fibers = f->cloth.scene, .volume = f->cloth.has_volume ? &f->cloth.volume_scene : NULL},
                  .model = &f->model,
                  .param = c->param,
                  .want_derivative = c->want_jacobian,
                  .plain_paths = c->plain_paths},
        .configuration = c->configuration,
        .n_configuration = c->n_configuration,
        .n_path = count,
        .seed = c->seed,
        .iteration = iteration,
        .replica = c->replica};
    fit_check(estimate_run(&q, f->pool, NULL, out, &err), &err);
}

void kept_run(const struct fit_phantom *f, const struct cached_call *c, uint32_t iteration, size_t n_path,
              struct estimate *out)
{
    size_t count[FIT_MAX_OBSERVATION];
    for (size_t i = 0; i < c->n_configuration; i++) count[i] = n_path;
    kept_run_counts(f, c, iteration, count, out);
}

uint32_t cached_call_sum(const struct fit_phantom *f, const struct cached_call *c, uint32_t chunk, size_t n_path)
{
    const struct fiber_set *s = &f->cloth.fiber;
    const uint32_t number[] = {(uint32_t)c->seed, c->replica, chunk, c->want_jacobian, (uint32_t)n_path};
    uint32_t sum = (uint32_t)crc32_z(0, (const void *)s->position_m, 3 * s->n_vertex * sizeof *s->position_m);
    sum = (uint32_t)crc32_z(sum, (const void *)f->model.id, strlen(f->model.id));
    sum = (uint32_t)crc32_z(sum, (const void *)c->param, f->model.n_param * sizeof *c->param);
    for (size_t i = 0; i < c->n_configuration; i++) {
        const struct configuration *k = &c->configuration[i];
        const double angle[] = {k->light_theta_rad, k->light_phi_rad, k->camera_theta_rad, k->camera_phi_rad,
                                k->cloth_rotation_rad};
        sum = (uint32_t)crc32_z(sum, (const void *)angle, sizeof angle);
        if (k->n_rotation > 1) sum = (uint32_t)crc32_z(sum, (const void *)&k->n_rotation, sizeof k->n_rotation);
    }
    if (f->guided) sum = (uint32_t)crc32_z(sum, (const void *)"guided", 6);
    return (uint32_t)crc32_z(sum, (const void *)number, sizeof number);
}

static void chunk_estimate(const struct fit_phantom *f, const struct cached_call *c, uint32_t chunk, size_t n_path,
                           struct estimate *out)
{
    struct error err = {0};
    char path[1024], *data = NULL;
    size_t n = c->n_configuration * sizeof *out, n_read = 0;
    snprintf(path, sizeof path, "%s/%08x.estimates", f->folder, cached_call_sum(f, c, chunk, n_path));
    if (file_read_all(path, n, &data, &n_read, &err) == STATUS_OK && n_read == n) {
        memcpy(out, data, n);
    } else {
        kept_run(f, c, chunk, n_path, out);
        fit_check(durable_replace_volatile(path, out, n, &err), &err);
    }
    free(data);
}

/* Adds share times the means of part to sum. Chunks have equal path counts, so the share of each is 1 / n_chunk. */
static void merge(struct estimate *sum, const struct estimate *part, double share)
{
    for (int c = 0; c < 3; c++) {
        sum->mean[c] += share * part->mean[c];
        sum->var[c] += share * share * part->var[c];
    }
    for (int k = 0; k < 3 * SCATTERING_MAX_FLAT; k++) {
        sum->jac[k] += share * part->jac[k];
        sum->jac_var[k] += share * share * part->jac_var[k];
    }
    sum->n_path += part->n_path;
    sum->n_bounce += part->n_bounce;
}

size_t cached_n_chunks(size_t n_path) { return (n_path + FIT_CHUNK - 1) / FIT_CHUNK; }

void cached_estimate(const struct fit_phantom *f, const struct cached_call *c, size_t first_chunk, size_t n_path,
                     struct estimate *out)
{
    size_t n_chunk = cached_n_chunks(n_path);
    struct estimate *part = calloc(c->n_configuration, sizeof *part);
    fit_check_memory(part);
    memset(out, 0, c->n_configuration * sizeof *out);
    for (size_t k = 0; k < n_chunk; k++) {
        chunk_estimate(f, c, (uint32_t)(first_chunk + k), n_path / n_chunk, part);
        for (size_t i = 0; i < c->n_configuration; i++) merge(&out[i], &part[i], 1.0 / (double)n_chunk);
    }
    free(part);
}
