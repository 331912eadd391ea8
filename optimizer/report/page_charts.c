#include "optimizer/report/page_charts.h"
#include "optimizer/report/page_text.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { WIDTH = 460, HEIGHT = 340, LEFT = 62, RIGHT = 18, TOP = 14, BOTTOM = 44 };
static const char *const channel_color[] = {"#c0392b", "#1e8449", "#2457a6"};

struct axes {
    double x0, x1, y0, y1;
    bool log_x, log_y;
};

static double place(double v, double from, double to, bool logarithmic)
{
    double t = logarithmic ? log(v / from) / log(to / from) : (v - from) / (to - from);
    return fmin(fmax(t, 0.0), 1.0);
}

static double x_of(const struct axes *a, double v)
{
    return LEFT + place(v, a->x0, a->x1, a->log_x) * (WIDTH - LEFT - RIGHT);
}

static double y_of(const struct axes *a, double v)
{
    return HEIGHT - BOTTOM - place(v, a->y0, a->y1, a->log_y) * (HEIGHT - BOTTOM - TOP);
}

static void text_at(FILE *out, double x, double y, const char *anchor, const char *text)
{
    fprintf(out, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\" font-size=\"11\" fill=\"#555\">", x, y, anchor);
    page_escaped(text, out);
    fputs("</text>\n", out);
}

/* Frame, ticks at five places of each axis, labels. */
static void open_chart(const struct axes *a, const char *x_label, const char *y_label, FILE *out)
{
    fprintf(out, "<svg viewBox=\"0 0 %d %d\" width=\"%d\" role=\"img\">\n<title>%s over ", WIDTH, HEIGHT, WIDTH,
            y_label);
    page_escaped(x_label, out);
    fputs("</title>\n", out);
    fprintf(out, "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"none\" stroke=\"#bbb\"/>\n", LEFT, TOP,
            WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
    for (int k = 0; k <= 4; k++) {
        char text[24];
        double x = a->log_x ? a->x0 * pow(a->x1 / a->x0, k / 4.0) : a->x0 + (a->x1 - a->x0) * k / 4.0;
        double y = a->log_y ? a->y0 * pow(a->y1 / a->y0, k / 4.0) : a->y0 + (a->y1 - a->y0) * k / 4.0;
        snprintf(text, sizeof text, "%.3g", x);
        text_at(out, x_of(a, x), HEIGHT - BOTTOM + 16, "middle", text);
        snprintf(text, sizeof text, "%.3g", y);
        text_at(out, LEFT - 6, y_of(a, y) + 4, "end", text);
    }
    text_at(out, (LEFT + WIDTH - RIGHT) / 2.0, HEIGHT - 8, "middle", x_label);
    fprintf(out,
            "<text x=\"13\" y=\"%.1f\" text-anchor=\"middle\" font-size=\"11\" fill=\"#555\" "
            "transform=\"rotate(-90 13 %.1f)\">%s</text>\n",
            HEIGHT / 2.0, HEIGHT / 2.0, y_label);
}

static bool is_held_out(const json_t *row) { return strcmp(page_string(row, "set"), "fit") != 0; }

static void mark(FILE *out, double x, double y, const char *color, bool ring)
{
    fprintf(out,
            "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3.5\" stroke=\"%s\" stroke-width=\"1.4\" fill=\"%s\" "
            "fill-opacity=\"0.7\"/>\n",
            x, y, color, ring ? "none" : color);
}

static double component(const json_t *row, const char *key, size_t c)
{
    return json_number_value(json_array_get(json_object_get(row, key), c));
}

void page_scatter(const json_t *rows, FILE *out)
{
    struct axes a = {.x0 = INFINITY, .x1 = 0.0, .log_x = true, .log_y = true};
    size_t i;
    const json_t *row;
    json_array_foreach(rows, i, row) for (size_t c = 0; c < 3; c++)
    {
        double v[2] = {component(row, "measured", c), component(row, "rendered", c)};
        for (int k = 0; k < 2; k++)
            if (v[k] > 0.0) {
                a.x0 = fmin(a.x0, v[k] / 1.2);
                a.x1 = fmax(a.x1, v[k] * 1.2);
            }
    }
    if (!(a.x1 > a.x0)) return;
    a.y0 = a.x0;
    a.y1 = a.x1;
    open_chart(&a, "measured mean radiance", "rendered", out);
    fprintf(out, "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#999\"/>\n", x_of(&a, a.x0),
            y_of(&a, a.x0), x_of(&a, a.x1), y_of(&a, a.x1));
    json_array_foreach(rows, i, row) for (size_t c = 0; c < 3; c++)
    {
        double m = component(row, "measured", c), r = component(row, "rendered", c);
        if (m > 0.0 && r > 0.0) mark(out, x_of(&a, m), y_of(&a, r), channel_color[c], is_held_out(row));
    }
    fputs("</svg>\n", out);
}

void page_errors_over(const json_t *rows, const char *angle_key, const char *title, FILE *out)
{
    struct axes a = {.x0 = 0.0, .x1 = 1.0, .y0 = 0.0, .y1 = 1.0};
    size_t i;
    const json_t *row;
    json_array_foreach(rows, i, row)
    {
        double angle = page_number(row, angle_key), error = 100.0 * page_number(row, "rel_error");
        a.x0 = fmin(a.x0, angle);
        a.x1 = fmax(a.x1, angle);
        if (isfinite(error)) a.y1 = fmax(a.y1, 1.1 * error);
    }
    a.x1 = 20.0 * ceil(a.x1 / 20.0); /* so that the ticks are round */
    open_chart(&a, title, "relative error, %", out);
    json_array_foreach(rows, i, row)
    {
        double error = 100.0 * page_number(row, "rel_error"), se = 100.0 * page_number(row, "rel_error_se");
        if (!isfinite(error)) continue;
        double x = x_of(&a, page_number(row, angle_key));
        fprintf(out, "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#aaa\"/>\n", x, x,
                y_of(&a, error - se), y_of(&a, error + se));
        mark(out, x, y_of(&a, error), "#2457a6", is_held_out(row));
    }
    fputs("</svg>\n", out);
}

void page_measured_and_fitted(const char *x_label, const struct page_point *point, size_t n, size_t n_channel,
                              FILE *out)
{
    struct axes a = {.x0 = point[0].x, .x1 = point[n - 1].x, .y0 = 0.0, .y1 = 0.0};
    for (size_t i = 0; i < n * n_channel; i++) a.y1 = fmax(a.y1, 1.05 * fmax(point[i].measured, point[i].fitted));
    if (!(a.y1 > a.y0) || !(a.x1 > a.x0)) return;
    open_chart(&a, x_label, "radiance", out);
    for (size_t c = 0; c < n_channel; c++) {
        const struct page_point *p = point + c * n;
        const char *color = n_channel == 1 ? "#2457a6" : channel_color[c];
        for (size_t i = 0; i < n; i++) {
            const double x = x_of(&a, p[i].x);
            if (p[i].se > 0.0)
                fprintf(out, "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#aaa\"/>\n", x, x,
                        y_of(&a, p[i].measured - p[i].se), y_of(&a, p[i].measured + p[i].se));
            mark(out, x, y_of(&a, p[i].measured), color, false);
        }
        fputs("<polyline fill=\"none\" stroke-width=\"1.6\" stroke=\"#1c1f24\" points=\"", out);
        for (size_t i = 0; i < n; i++) fprintf(out, "%.1f,%.1f ", x_of(&a, p[i].x), y_of(&a, p[i].fitted));
        fputs("\"/>\n", out);
    }
    fputs("</svg>\n", out);
}

void page_curve(const json_t *curve, FILE *out)
{
    struct axes a = {.x0 = 0.0, .x1 = 1.0, .y0 = INFINITY, .y1 = 0.0, .log_y = true};
    size_t i;
    const json_t *point;
    json_array_foreach(curve, i, point)
    {
        double f = page_number(point, "objective"), se = page_number(point, "objective_se");
        a.x1 = fmax(a.x1, page_number(point, "step"));
        if (fmax(f, se) > 0.0) {
            a.y0 = fmin(a.y0, fmax(f, se) / 2.0);
            a.y1 = fmax(a.y1, fmax(f, se) * 1.5);
        }
    }
    if (!(a.y1 > a.y0)) return;
    a.x1 = 4.0 * ceil(a.x1 / 4.0); /* the ticks are whole steps */
    open_chart(&a, "step", "sum of squared errors (ring: below its noise)", out);
    json_array_foreach(curve, i, point)
    {
        double f = page_number(point, "objective"), se = page_number(point, "objective_se");
        if (fmax(f, se) > 0.0)
            mark(out, x_of(&a, page_number(point, "step")), y_of(&a, fmax(f, se)), "#2457a6", !(f > se));
    }
    fputs("</svg>\n", out);
}

void page_correlation(const json_t *parameters, const json_t *matrix, FILE *out)
{
    const double cell = 26.0, left = 130.0;
    size_t n = json_array_size(matrix);
    if (n == 0) return;
    fprintf(out,
            "<svg viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" role=\"img\" font-size=\"10\">\n"
            "<title>correlations of the parameters</title>\n",
            left + cell * (double)n + 4, cell * (double)n + 70, left + cell * (double)n + 4);
    for (size_t i = 0; i < n; i++) {
        const char *name = page_string(json_array_get(parameters, i), "name");
        double at = cell * (double)i;
        text_at(out, left - 6, at + 17, "end", name);
        fprintf(out, "<text transform=\"translate(%.1f %.1f) rotate(60)\" fill=\"#555\">", left + at + 8,
                cell * (double)n + 10);
        page_escaped(name, out);
        fputs("</text>\n", out);
        for (size_t j = 0; j < n; j++) {
            double r = json_number_value(json_array_get(json_array_get(matrix, i), j)), strength = fmin(fabs(r), 1.0);
            fprintf(out,
                    "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.0f\" height=\"%.0f\" fill=\"%s\" fill-opacity=\"%.2f\" "
                    "stroke=\"#ddd\"/>\n",
                    left + cell * (double)j, at, cell, cell, r < 0.0 ? "#c0392b" : "#2457a6", strength);
            if (i != j && strength >= 0.3)
                fprintf(out, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\" fill=\"%s\">%.1f</text>\n",
                        left + cell * ((double)j + 0.5), at + 17, strength > 0.6 ? "#fff" : "#333", r);
        }
    }
    fputs("</svg>\n", out);
}
