#include "optimizer/report/geometry/fiber_lengths.h"

#include <math.h>
#include <stdlib.h>

static int compare_double(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double one_length(const struct fiber_set *f, size_t i)
{
    double sum = 0.0;
    for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
        double square = 0.0;
        for (size_t a = 0; a < 3; a++)
            square += pow((double)f->position_m[3 * k + 3 + a] - (double)f->position_m[3 * k + a], 2.0);
        sum += sqrt(square);
    }
    return sum;
}

status fiber_lengths_measure(const struct fiber_set *f, struct fiber_lengths *l, struct error *err)
{
    size_t n = f->n_fiber;
    *l = (struct fiber_lengths){.shortest_m = NAN};
    double *length = malloc(2 * (n + 1) * sizeof *length);
    if (length == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the fibers' lengths: out of memory");
    double *sorted = length + n + 1;
    for (size_t i = 0; i < n; i++) {
        int class = f->axis_class[i] < 3 ? f->axis_class[i] : 2;
        sorted[i] = length[i] = one_length(f, i);
        l->n[class]++;
        l->total_m[class] += length[i];
        l->mean_m += length[i] / (double)n;
    }
    qsort(sorted, n, sizeof *sorted, compare_double);
    if (n > 0) {
        l->shortest_m = sorted[0];
        l->p10_m = sorted[(n - 1) / 10];
        l->median_m = sorted[(n - 1) / 2];
        l->p90_m = sorted[(n - 1) * 9 / 10];
        l->longest_m = sorted[n - 1];
    }
    double width = l->longest_m > 0.0 ? l->longest_m / LENGTH_BINS : 1.0;
    for (int b = 0; b <= LENGTH_BINS; b++) l->edge_m[b] = b * width;
    for (size_t i = 0; i < n; i++) {
        int class = f->axis_class[i] < 3 ? f->axis_class[i] : 2;
        size_t bin = (size_t)(length[i] / width);
        if (bin >= LENGTH_BINS) bin = LENGTH_BINS - 1;
        l->count[class][bin]++;
        l->length_in_bin_m[class][bin] += length[i];
    }
    free(length);
    return STATUS_OK;
}

/* Step between the labels of an axis: 1, 2 or 5 times a power of ten, so that at most 7 steps lead to `most`. */
static double round_step(double most)
{
    static const double factor[] = {0.1, 0.2, 0.5, 1.0, 2.0, 5.0};
    double power = pow(10.0, floor(log10(most)));
    size_t i = 0;
    while (i < 5 && most > 7.0 * factor[i] * power) i++;
    return factor[i] * power;
}

enum { WIDTH = 640, HEIGHT = 300, LEFT = 64, RIGHT = 16, TOP = 52, BOTTOM = 44 };

static const char *const class_name[] = {"weft", "warp", "pile"}, *const colour[] = {"#d08a2e", "#3f7fb5", "#5a9a5a"};

static void plot_axes(const struct fiber_lengths *l, double most_m, FILE *out)
{
    double x_most = l->longest_m * 1e3, y_most = most_m * 1e3;
    if (!(x_most > 0.0 && y_most > 0.0)) return;
    for (double y = 0.0, step = round_step(y_most); y <= y_most; y += step) {
        double at = HEIGHT - BOTTOM - y / y_most * (HEIGHT - TOP - BOTTOM);
        fprintf(out,
                "<line x1=\"%d\" y1=\"%.1f\" x2=\"%d\" y2=\"%.1f\" stroke=\"#ddd\"/><text x=\"%d\" y=\"%.1f\" "
                "text-anchor=\"end\">%.3g</text>\n",
                LEFT, at, WIDTH - RIGHT, at, LEFT - 6, at + 4.0, y);
    }
    for (double x = 0.0, step = round_step(x_most); x <= x_most; x += step)
        fprintf(out, "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%.3g</text>\n",
                LEFT + x / x_most * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM + 16, x);
    fprintf(out, "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">length of a fiber, mm</text>\n",
            (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 8);
    fprintf(out,
            "<text x=\"14\" y=\"%d\" text-anchor=\"middle\" transform=\"rotate(-90 14 %d)\">summed length, mm</text>\n",
            (TOP + HEIGHT - BOTTOM) / 2, (TOP + HEIGHT - BOTTOM) / 2);
}

static void plot_bars(const struct fiber_lengths *l, double most_m, FILE *out)
{
    double bar = (double)(WIDTH - LEFT - RIGHT) / LENGTH_BINS;
    for (int b = 0; b < LENGTH_BINS; b++) {
        double base = HEIGHT - BOTTOM;
        for (int class = 0; class < 3; class ++) {
            if (l->count[class][b] == 0) continue;
            double height = l->length_in_bin_m[class][b] / most_m * (HEIGHT - TOP - BOTTOM);
            base -= height;
            fprintf(out,
                    "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\"><title>%zu fibers of %s, "
                    "%.3g to %.3g mm</title></rect>\n",
                    LEFT + b * bar + 0.5, base, bar - 1.0, height, colour[class], l->count[class][b], class_name[class],
                    l->edge_m[b] * 1e3, l->edge_m[b + 1] * 1e3);
        }
    }
}

void fiber_lengths_plot(const struct fiber_lengths *l, double tile_m, FILE *out)
{
    double most_m = 0.0;
    for (int b = 0; b < LENGTH_BINS; b++)
        most_m = fmax(most_m, l->length_in_bin_m[0][b] + l->length_in_bin_m[1][b] + l->length_in_bin_m[2][b]);
    fprintf(out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\" "
            "font-family=\"sans-serif\" font-size=\"12\" "
            "fill=\"#222\">\n" SVG_DARK_STYLE "<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n",
            WIDTH, HEIGHT, WIDTH, HEIGHT, WIDTH, HEIGHT);
    plot_axes(l, most_m, out);
    if (most_m > 0.0) plot_bars(l, most_m, out);
    for (int class = 0, at = LEFT; class < 3; class ++) {
        if (l->n[class] == 0) continue;
        fprintf(out,
                "<rect x=\"%d\" y=\"10\" width=\"12\" height=\"12\" fill=\"%s\"/><text x=\"%d\" y=\"20\">%s: %zu "
                "fibers</text>\n",
                at, colour[class], at + 18, class_name[class], l->n[class]);
        at += 130;
    }
    if (tile_m > 0.0 && tile_m < l->longest_m) {
        double x = LEFT + tile_m / l->longest_m * (WIDTH - LEFT - RIGHT);
        fprintf(out,
                "<line x1=\"%.1f\" y1=\"%d\" x2=\"%.1f\" y2=\"%d\" stroke=\"#b00\" stroke-dasharray=\"4 3\"/><text "
                "x=\"%.1f\" y=\"42\" text-anchor=\"end\" "
                "fill=\"#b00\">edge of the tile</text>\n",
                x, TOP - 6, x, HEIGHT - BOTTOM, x);
    }
    fputs("</svg>\n", out);
}
