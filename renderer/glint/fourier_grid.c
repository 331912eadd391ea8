#include "renderer/glint/fourier_grid.h"

#include <math.h>
#include <stdlib.h>

/* Radix-2 transform of one line; root[k] = exp(sign 2 pi i k / n). */
static void transform_line(double (*line)[2], size_t n, const double (*root)[2])
{
    for (size_t i = 1, j = 0; i < n; i++) {
        size_t bit = n >> 1;
        for (; j & bit; bit >>= 1) j ^= bit;
        j ^= bit;
        if (i >= j) continue;
        for (int c = 0; c < 2; c++) {
            const double t = line[i][c];
            line[i][c] = line[j][c];
            line[j][c] = t;
        }
    }
    for (size_t half = 1; half < n; half *= 2)
        for (size_t start = 0; start < n; start += 2 * half)
            for (size_t k = 0; k < half; k++) {
                double *a = line[start + k], *b = line[start + k + half];
                const double *w = root[k * (n / (2 * half))];
                const double re = b[0] * w[0] - b[1] * w[1], im = b[0] * w[1] + b[1] * w[0];
                b[0] = a[0] - re;
                b[1] = a[1] - im;
                a[0] += re;
                a[1] += im;
            }
}

status fourier_grid_transform(double (*value)[2], size_t n, int sign, struct error *err)
{
    double(*root)[2] = malloc(n * sizeof *root), (*column)[2] = malloc(n * sizeof *column);
    if (root == NULL || column == NULL) {
        free(root);
        free(column);
        return error_set(err, STATUS_NO_MEMORY, "cannot transform a grid: out of memory");
    }
    for (size_t k = 0; k < n; k++) {
        root[k][0] = cos(2 * M_PI * (double)k / (double)n);
        root[k][1] = sign * sin(2 * M_PI * (double)k / (double)n);
    }
    for (size_t y = 0; y < n; y++) transform_line(value + y * n, n, (const double(*)[2])root);
    for (size_t x = 0; x < n; x++) {
        for (size_t y = 0; y < n; y++) {
            column[y][0] = value[y * n + x][0];
            column[y][1] = value[y * n + x][1];
        }
        transform_line(column, n, (const double(*)[2])root);
        for (size_t y = 0; y < n; y++) {
            value[y * n + x][0] = column[y][0];
            value[y * n + x][1] = column[y][1];
        }
    }
    free(root);
    free(column);
    return STATUS_OK;
}
