#include "renderer/glint/glint_element.h"

#include "renderer/glint/wave_lanes.h"

#include <math.h>
#include <stdlib.h>

status glint_lattice_make(const struct glint_option *o, const struct glint_map *m, struct glint_lattice *l,
                          struct error *err)
{
    const double step = (double)o->step_texel;
    *l = (struct glint_lattice){.n = (size_t)((double)m->n / step), .step_um = o->step_texel * m->texel_um};
    l->period_um = m->texel_um * (float)m->n;
    l->variance_h = l->step_um * l->step_um / (8 * logf(2));
    l->variance_r = o->roughness * o->roughness;
    l->element = malloc(l->n * l->n * sizeof *l->element);
    if (l->element == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make glint elements: out of memory");
    for (size_t k = 0; k < l->n * l->n; k++) {
        const double place[2] = {((double)(k % l->n) + 0.5) * step, ((double)(k / l->n) + 0.5) * step};
        struct glint_element *e = &l->element[glint_lattice_index(l, k % l->n, k / l->n)];
        for (int a = 0; a < 2; a++) e->place_um[a] = (float)place[a] * m->texel_um;
        glint_map_at(m, place, e->normal, e->jacobian);
        for (int c = 0; c < 4; c++) e->jacobian[c] = o->is_plain ? 0 : e->jacobian[c] / m->texel_um;
    }
    return STATUS_OK;
}

void glint_lattice_release(struct glint_lattice *l)
{
    free(l->element);
    l->element = NULL;
}

/* Sum over the lattice of h^2 N(p - u_i; C), by Poisson's formula: terms of the wave numbers (1, 0), (0, 1) and
 * (1, +-1) per step. The next ones are below 1e-6, because C >= sigma_h^2 I. */
static float total_weight(const struct glint_lattice *l, const struct glint_query *q)
{
    static const float wave[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
    const float per_step2 = 1 / (l->step_um * l->step_um);
    float sum = 1;
    for (int k = 0; k < 4; k++) {
        const float a = wave[k][0], b = wave[k][1];
        const float decay =
            2 * (float)(M_PI * M_PI) * per_step2 * (a * a * q->wide[0] + 2 * a * b * q->wide[1] + b * b * q->wide[2]);
        if (decay > 20) continue;
        const float turn = (a * q->center_um[0] + b * q->center_um[1]) / l->step_um - (a + b) / 2;
        sum += 2 * expf(-decay) * cosf(2 * (float)M_PI * (turn - rintf(turn)));
    }
    return sum;
}

void glint_query_init(const struct glint_lattice *l, const struct glint_footprint *at, struct glint_query *q)
{
    const float *p = at->covariance_um2;
    q->wide[0] = p[0] + l->variance_h;
    q->wide[1] = p[1];
    q->wide[2] = p[2] + l->variance_h;
    const float det = q->wide[0] * q->wide[2] - q->wide[1] * q->wide[1];
    q->inverse[0] = q->wide[2] / det;
    q->inverse[1] = -q->wide[1] / det;
    q->inverse[2] = q->wide[0] / det;
    for (int c = 0; c < 3; c++) q->gain[c] = l->variance_h * q->inverse[c];
    /* S = sigma_h^2 (I - sigma_h^2 C^-1) */
    q->narrow[0] = fmaxf(l->variance_h * (1 - q->gain[0]), 0);
    q->narrow[1] = -l->variance_h * q->gain[1];
    q->narrow[2] = fmaxf(l->variance_h * (1 - q->gain[2]), 0);
    for (int a = 0; a < 2; a++)
        q->center_um[a] = at->center_um[a] - l->period_um * floorf(at->center_um[a] / l->period_um);
    q->variance_r = l->variance_r;
    q->factor = l->step_um * l->step_um / (4 * (float)(M_PI * M_PI) * sqrtf(det) * total_weight(l, q));
}

/* The density of eight elements, without the factor of the query. */
static inline lanes eight(const struct glint_query *q, const lanes place[4], const lanes j[4], const float center[2],
                          const float half[2])
{
    const lanes du = center[0] - place[0], dv = center[1] - place[1];
    const lanes far = du * du * q->inverse[0] + 2 * du * dv * q->inverse[1] + dv * dv * q->inverse[2];
    const lanes ku = q->gain[0] * du + q->gain[1] * dv, kv = q->gain[1] * du + q->gain[2] * dv;
    const lanes rs = half[0] - place[2] - (j[0] * ku + j[1] * kv), rt = half[1] - place[3] - (j[2] * ku + j[3] * kv);
    const lanes as = q->narrow[0] * j[0] + q->narrow[1] * j[1], bs = q->narrow[1] * j[0] + q->narrow[2] * j[1];
    const lanes at = q->narrow[0] * j[2] + q->narrow[1] * j[3], bt = q->narrow[1] * j[2] + q->narrow[2] * j[3];
    const lanes ss = q->variance_r + as * j[0] + bs * j[1], st = as * j[2] + bs * j[3];
    const lanes tt = q->variance_r + at * j[2] + bt * j[3], per_det = 1 / (ss * tt - st * st);
    const lanes near = (rs * rs * tt - 2 * rs * rt * st + rt * rt * ss) * per_det;
    return lanes_exp_negative(-0.5F * (far + near)) * lanes_sqrt(per_det);
}

float glint_query_sum(const struct glint_query *q, const struct glint_element *element, const uint32_t *index, size_t n,
                      const float shift_um[2], const float half[2])
{
    const float center[2] = {q->center_um[0] - shift_um[0], q->center_um[1] - shift_um[1]};
    lanes sum = {0};
    for (size_t k = 0; k < n; k += LANES) {
        lane_row place[LANES], slope[LANES];
        lanes place_of[4], slope_of[4], valid;
        for (size_t i = 0; i < LANES; i++) {
            const struct glint_element *e = &element[index[k + i < n ? k + i : k]];
            place[i] = *(const lane_row *)e->place_um;
            slope[i] = *(const lane_row *)e->jacobian;
            valid[i] = k + i < n ? 1 : 0;
        }
        lanes_of_rows(place, place_of);
        lanes_of_rows(slope, slope_of);
        sum += valid * eight(q, (const lanes *)place_of, (const lanes *)slope_of, center, half);
    }
    return lanes_sum(sum);
}

void glint_query_normal(const struct glint_query *q, const struct glint_element *e, const float d[2], float mean[2],
                        float covariance[3])
{
    const float *j = e->jacobian, *n = q->narrow;
    const float ku = q->gain[0] * d[0] + q->gain[1] * d[1], kv = q->gain[1] * d[0] + q->gain[2] * d[1];
    for (int c = 0; c < 2; c++) mean[c] = e->normal[c] + j[2 * c] * ku + j[2 * c + 1] * kv;
    covariance[0] = q->variance_r + n[0] * j[0] * j[0] + 2 * n[1] * j[0] * j[1] + n[2] * j[1] * j[1];
    covariance[1] = n[0] * j[0] * j[2] + n[1] * (j[0] * j[3] + j[1] * j[2]) + n[2] * j[1] * j[3];
    covariance[2] = q->variance_r + n[0] * j[2] * j[2] + 2 * n[1] * j[2] * j[3] + n[2] * j[3] * j[3];
}
