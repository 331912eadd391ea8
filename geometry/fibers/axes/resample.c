#include "geometry/fibers/axes/axis_fit.h"

#include <math.h>

static float distance(const float a[3], const float b[3])
{
    float sum = 0.0f;
    for (int c = 0; c < 3; c++) sum += (a[c] - b[c]) * (a[c] - b[c]);
    return sqrtf(sum);
}

status polylines_resample(const struct polyline_set *lines, struct polyline_set *out, struct error *err)
{
    status s = STATUS_OK;
    for (size_t l = 0; l < lines->n_line && s == STATUS_OK; l++) {
        float length = 0.0f, passed = 0.0f;
        size_t end = lines->first[l + 1] - 1, i = lines->first[l];
        for (size_t k = i; k < end; k++) length += distance(lines->vertex[k], lines->vertex[k + 1]);
        int n = (int)fmaxf(1.0f, rintf(length));
        s = polyline_begin_like(out, lines, l, err);
        for (int k = 0; k <= n && s == STATUS_OK; k++) {
            float want = length * (float)k / (float)n, step, x[3];
            while (i + 1 < end && passed + distance(lines->vertex[i], lines->vertex[i + 1]) < want) {
                passed += distance(lines->vertex[i], lines->vertex[i + 1]);
                i++;
            }
            step = distance(lines->vertex[i], lines->vertex[i + 1]);
            float f = step > 0.0f ? fminf(1.0f, (want - passed) / step) : 0.0f;
            for (int a = 0; a < 3; a++)
                x[a] = lines->vertex[i][a] + f * (lines->vertex[i + 1][a] - lines->vertex[i][a]);
            s = polyline_add(out, x, err);
        }
    }
    return s;
}
