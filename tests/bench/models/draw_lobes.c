/* Draws <folder>-lobes.svg of a folder of renderer/scattering/models: how its models scatter light with the parameters
 * of their starts, in green. The program of `make docs-lobes`.
 *
 *     draw_lobes ID... > <folder>-lobes.svg
 *
 * Left: S cos(th_i) over the azimuth between light and view, both at right angles to the fiber; light comes from the
 * right. Right: its mean over the azimuth, over the angle of the view along the fiber, for light at 30 degrees. A phase
 * function is drawn as f. Near fields and flat sections are drawn as the mean over all views of the fiber. The root
 * of each value is drawn, so that weak light is seen; a lobe of one model that is far higher than the others is cut off
 * at the circle. */
#include "base/angle.h"
#include "renderer/scattering/phase_model.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { N_AZIMUTH = 180, N_ALONG = 90, N_VIEW = 64, MAX_MODEL = 5, SIZE = 360, CHANNEL = 1 };
static const double light_along_rad = 30.0 * RAD_PER_DEG;
static const char *const color[MAX_MODEL] = {"#1f5fa8", "#b5471f", "#2e7d32", "#7b3fa0", "#9a7400"};

struct drawn_model {
    const char *id;
    double around[N_AZIMUTH + 1], along[N_ALONG + 1];
};

/* A model of either kind with its state. */
struct evaluated {
    const struct scattering_model *surface;
    const struct phase_model *volume;
    struct scattering_state *surface_state;
    struct phase_state *volume_state;
};

static void direction(double theta_rad, double phi_rad, float w[3])
{
    w[0] = (float)sin(theta_rad);
    w[1] = (float)(cos(theta_rad) * cos(phi_rad));
    w[2] = (float)(cos(theta_rad) * sin(phi_rad));
}

static double value(const struct evaluated *e, double theta_i_rad, double theta_o_rad, double phi_rad)
{
    float wi[3], wo[3], rgb[3];
    if (e->volume != NULL) {
        direction(theta_i_rad, phi_rad, wi);
        direction(theta_o_rad, 0, wo);
        e->volume->eval_pdf(e->volume_state, wi, wo, NULL, rgb, NULL);
        return (double)rgb[CHANNEL];
    }
    double sum = 0;
    for (int k = 0; k < N_VIEW; k++) {
        double turn = scattering_view_azimuth_rad(e->surface, k, N_VIEW);
        direction(theta_i_rad, turn + phi_rad, wi);
        direction(theta_o_rad, turn, wo);
        e->surface->eval(e->surface_state, wi, wo, rgb, NULL);
        sum += (double)rgb[CHANNEL] * cos(theta_i_rad) / N_VIEW;
    }
    return sum;
}

static status prepare(const char *id, struct evaluated *e, struct error *err)
{
    double param[SCATTERING_MAX_PARAM];
    *e = (struct evaluated){.surface = scattering_find(id), .volume = phase_find(id)};
    if (e->surface == NULL && e->volume == NULL) return error_set(err, STATUS_INVALID, "no model is named '%s'", id);
    const struct param_info *info = e->surface != NULL ? e->surface->param : e->volume->param;
    size_t n_param = e->surface != NULL ? e->surface->n_param : e->volume->n_param;
    for (size_t p = 0; p < n_param; p++) param[p] = info[p].start;
    return e->surface != NULL ? scattering_prepare(e->surface, param, NULL, &e->surface_state, err)
                              : e->volume->prepare(param, &e->volume_state, err);
}

static status evaluate(const char *id, struct drawn_model *m, struct error *err)
{
    struct evaluated e;
    status s = prepare(id, &e, err);
    if (s != STATUS_OK) return s;
    m->id = id;
    for (int i = 0; i <= N_AZIMUTH; i++) m->around[i] = value(&e, 0, 0, 2 * M_PI * i / N_AZIMUTH);
    for (int i = 0; i <= N_ALONG; i++) {
        double theta = fmin(fmax(M_PI * ((double)i / N_ALONG - 0.5), -1.57), 1.57);
        m->along[i] = 0;
        for (int k = 0; k < N_AZIMUTH; k++)
            m->along[i] += value(&e, light_along_rad, theta, 2 * M_PI * k / N_AZIMUTH) / N_AZIMUTH;
    }
    if (e.surface != NULL)
        e.surface->release(e.surface_state);
    else
        e.volume->release(e.volume_state);
    return STATUS_OK;
}

static double peak(const struct drawn_model *m)
{
    double most = 0;
    for (int i = 0; i <= N_AZIMUTH; i++) most = fmax(most, m->around[i]);
    return most;
}

/* The largest value of the models whose peak is at most four times the first model's: a lobe that is much higher is cut
 * off at the circle. */
static double largest(const struct drawn_model *m, int n_model)
{
    double most = 0;
    for (int k = 0; k < n_model; k++)
        if (peak(&m[k]) <= 4 * peak(&m[0])) most = fmax(most, peak(&m[k]));
    return most;
}

static double largest_along(const struct drawn_model *m, int n_model)
{
    double most = 0;
    for (int k = 0; k < n_model; k++)
        for (int i = 0; i <= N_ALONG; i++) most = fmax(most, m[k].along[i]);
    return most;
}

static void draw_around(const struct drawn_model *m, int n_model)
{
    const double middle = SIZE / 2.0, radius = 0.42 * SIZE, most = largest(m, n_model);
    printf("<circle cx=\"%g\" cy=\"%g\" r=\"%g\" fill=\"none\" stroke=\"#bbb\"/>\n", middle, middle, radius);
    printf("<path d=\"M%g %gh%g\" stroke=\"#bbb\"/>\n<circle cx=\"%g\" cy=\"%g\" r=\"4\" fill=\"#888\"/>\n",
           middle - radius, middle, 2 * radius, middle, middle);
    printf("<text x=\"%d\" y=\"14\">around the fiber (light from the right)</text>\n", 8);
    for (int k = 0; k < n_model; k++) {
        printf("<polygon fill=\"none\" stroke=\"%s\" stroke-width=\"1.5\" points=\"", color[k]);
        for (int i = 0; i < N_AZIMUTH; i++) {
            double r = radius * fmin(sqrt(m[k].around[i] / most), 1), phi = 2 * M_PI * i / N_AZIMUTH;
            printf("%.1f,%.1f ", middle + r * cos(phi), middle - r * sin(phi));
        }
        printf("\"/>\n");
    }
}

static void draw_along(const struct drawn_model *m, int n_model)
{
    const double left = SIZE + 20.0, width = SIZE - 40.0, low = SIZE - 40.0, height = SIZE - 80.0;
    const double most = largest_along(m, n_model);
    printf("<path d=\"M%g %gh%g\" stroke=\"#bbb\"/>\n<text x=\"%g\" y=\"14\">along the fiber, for light at 30 "
           "degrees</text>\n",
           left, low, width, left);
    for (int deg = -90; deg <= 90; deg += 30)
        printf("<path d=\"M%.1f %gv4\" stroke=\"#888\"/><text x=\"%.1f\" y=\"%g\" text-anchor=\"middle\">%d</text>\n",
               left + width * (deg + 90) / 180.0, low, left + width * (deg + 90) / 180.0, low + 18, deg);
    for (int k = 0; k < n_model; k++) {
        printf("<polyline fill=\"none\" stroke=\"%s\" stroke-width=\"1.5\" points=\"", color[k]);
        for (int i = 0; i <= N_ALONG; i++)
            printf("%.1f,%.1f ", left + width * i / N_ALONG, low - height * sqrt(m[k].along[i] / most));
        printf("\"/>\n<text x=\"%g\" y=\"%d\" fill=\"%s\">%s</text>\n", left + 0.6 * width, 46 + 16 * k, color[k],
               m[k].id);
    }
}

int main(int argc, char **argv)
{
    static struct drawn_model model[MAX_MODEL];
    struct error err = {0};
    int n_model = argc - 1 < MAX_MODEL ? argc - 1 : MAX_MODEL;
    for (int k = 0; k < n_model; k++)
        if (evaluate(argv[k + 1], &model[k], &err) != STATUS_OK) {
            fprintf(stderr, "draw_lobes: %s\n", err.text);
            return 1;
        }
    printf("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" font-family=\"sans-serif\" "
           "font-size=\"12\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
           2 * SIZE, SIZE);
    draw_around(model, n_model);
    draw_along(model, n_model);
    printf("</svg>\n");
    return 0;
}
