#include "renderer/transport/lamp_strip.h"
#include "renderer/scattering/von_mises.h"

/* Standard deviation, in half sides of the lamp, up to which a lobe counts as narrow. Pictures by tables of a Gabardine
 * (0.46) have 0.8 times the variance with 0.8 in place of 0.4, in the same time (transport/NOTES.md). */
#define NARROW 0.8f
#define REACH_SD 3.0f     /* a lobe whose middle is that far off the lamp sends next to no light of it */
#define SLOPES_MOST 1.45f /* above the root of 2, by more than rounding: the most of the sum of both slopes */

static float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void lamp_strip_init(struct lamp_strip *strip, const struct lamp *lamp, const float position_mm[3],
                     const float tangent[3], float sin_o, float lobe_rad)
{
    float n[3], slope[2];
    strip->used = false;
    if (!(lobe_rad > 0) || lamp->distant) return;
    for (int a = 0; a < 3; a++) n[a] = lamp->centre_mm[a] - position_mm[a];
    float inv = 1 / sqrtf(dot(n, n)), cos2_o = 1 - sin_o * sin_o, sd = lobe_rad * sqrtf(cos2_o > 0 ? cos2_o : 0),
          half_side = inv * lamp->half_side_mm;
    if (!(sd < NARROW * inv * lamp->half_side_mm)) return; /* slopes are at most that */
    for (int a = 0; a < 3; a++) n[a] *= inv;
    float sin_i = dot(tangent, n);
    if (!(fabsf(sin_i + sin_o) < SLOPES_MOST * half_side + REACH_SD * sd)) return; /* most lobes miss the lamp */
    for (int k = 0; k < 2; k++) /* of the sine of th_i, by half sides along the edge */
        slope[k] = (dot(tangent, lamp->edge[k]) - sin_i * dot(n, lamp->edge[k])) * inv * lamp->half_side_mm;
    float steep = sqrtf(slope[0] * slope[0] + slope[1] * slope[1]);
    if (!(sd < NARROW * steep)) return;
    float per = 1 / steep;
    strip->sd = sd * per;
    strip->middle = (-sin_o - sin_i) * per;
    for (int k = 0; k < 2; k++) {
        strip->mirror[k] = copysignf(1, slope[k]);
        strip->across[k] = fabsf(slope[k]) * per;
    }
    strip->reach = strip->across[0] + strip->across[1];
    if (!(fabsf(strip->middle) < strip->reach + REACH_SD * strip->sd)) return;
    float scale = (float)M_SQRT1_2 / strip->sd;
    strip->low = erff(scale * (-strip->reach - strip->middle));
    strip->all = erff(scale * (strip->reach - strip->middle)) - strip->low;
    strip->used = strip->all > 1e-4f;
}

/* Ends of the line at s through the square [-1, 1]^2, as distances from its point nearest to the middle. */
static void line_ends(const struct lamp_strip *strip, float s, float end[2])
{
    /* points s (a, b) + t (-b, a), with a, b >= 0 */
    float a = strip->across[0], b = strip->across[1];
    end[0] = -1e9f;
    end[1] = 1e9f;
    if (b > 1e-6f) { /* -1 <= s a - t b <= 1 */
        end[0] = (s * a - 1) / b;
        end[1] = (s * a + 1) / b;
    }
    if (a > 1e-6f) { /* -1 <= s b + t a <= 1 */
        end[0] = fmaxf(end[0], (-1 - s * b) / a);
        end[1] = fminf(end[1], (1 - s * b) / a);
    }
}

void lamp_strip_sample(const struct lamp_strip *strip, const float u[2], float lamp_u[2])
{
    float s = strip->middle + (float)M_SQRT2 * strip->sd * erf_inverse(strip->low + u[0] * strip->all), end[2];
    s = fminf(fmaxf(s, -strip->reach), strip->reach);
    line_ends(strip, s, end);
    float t = end[0] + u[1] * (end[1] - end[0]);
    const float point[2] = {s * strip->across[0] - t * strip->across[1], s * strip->across[1] + t * strip->across[0]};
    for (int k = 0; k < 2; k++) lamp_u[k] = fminf(fmaxf(0.5f + 0.5f * strip->mirror[k] * point[k], 0), 1 - 0x1p-24f);
}

static float ratio_at(const struct lamp_strip *strip, float x, float y)
{
    float s = strip->across[0] * strip->mirror[0] * x + strip->across[1] * strip->mirror[1] * y, end[2];
    line_ends(strip, s, end);
    float off = (s - strip->middle) / strip->sd, length = fmaxf(end[1] - end[0], 1e-6f);
    /* the normal density cut to the lamp is sqrt(2 / pi) / sd exp(-off^2 / 2) / all; evenly it is length / 4 */
    return (float)(2 * M_2_SQRTPI * M_SQRT2) * expf(-0.5f * off * off) / (strip->sd * strip->all * length);
}

float lamp_strip_ratio(const struct lamp_strip *strip, const float lamp_u[2])
{
    return ratio_at(strip, 2 * lamp_u[0] - 1, 2 * lamp_u[1] - 1);
}

float lamp_strip_ratio_towards(const struct lamp_strip *strip, const struct lamp *lamp, const float position_mm[3],
                               const float direction[3])
{
    float to[3];
    for (int a = 0; a < 3; a++) to[a] = position_mm[a] - lamp->centre_mm[a];
    float t = -dot(to, lamp->normal) / dot(direction, lamp->normal);
    for (int a = 0; a < 3; a++) to[a] += t * direction[a];
    float inv = 1 / lamp->half_side_mm;
    return ratio_at(strip, inv * dot(to, lamp->edge[0]), inv * dot(to, lamp->edge[1]));
}
