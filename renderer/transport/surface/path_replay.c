#include "renderer/transport/surface/path_scatter.h"
#include "renderer/transport/surface/path_tracer.h"

struct replay {
    const struct parameter_sets *sets;
    bool shows_width;
};

static void eval(const struct replay *r, uint32_t i_group, const float wi[3], const float wo[3], float s_rgb[3])
{
    const struct scattering_model *m = r->sets->model;
    const struct film_material *film = parameter_sets_film(r->sets, i_group);
    if (film != NULL) {
        path_film_eval(film, wi, wo, s_rgb);
        return;
    }
    const struct scattering_state *state = r->sets->state[r->sets->n > 1 ? i_group : 0];
    m->eval(state, wi, wo, s_rgb, NULL);
    if (!r->shows_width) return;
    const float widths = path_scatter_widths(m, state, wi, wo, NULL);
    for (int c = 0; c < 3; c++) s_rgb[c] *= widths;
}

/* Light that step s receives: from the lamp, from the image, and from the lamp by way of another fiber. */
static double step_light(const struct replay *r, const struct path_step *s, const double t[3], double sum)
{
    float rgb[3];
    if (s->light > 0) {
        eval(r, s->i_group, s->light_wi, s->wo, rgb);
        for (int c = 0; c < 3; c++) sum += t[c] * (double)rgb[c] * (double)s->light;
    }
    if (s->image[0] + s->image[1] + s->image[2] > 0) {
        eval(r, s->i_group, s->image_wi, s->wo, rgb);
        for (int c = 0; c < 3; c++) sum += t[c] * (double)rgb[c] * (double)s->image[c];
    }
    if (s->guided_light > 0) {
        float ahead[3];
        eval(r, s->i_group, s->guided_wi, s->wo, rgb);
        eval(r, s->i_guided_group, s->guided_light_wi, s->guided_wo, ahead);
        for (int c = 0; c < 3; c++) sum += t[c] * (double)rgb[c] * (double)ahead[c] * (double)s->guided_light;
    }
    return sum;
}

double path_replay(const struct parameter_sets *sets, const struct path_record *record, bool shows_width)
{
    const struct replay all = {sets, shows_width}, *r = &all;
    double t[3] = {1, 1, 1}, sum = 0;
    for (size_t i = 0; i < record->n_step; i++) {
        const struct path_step *s = &record->step[i];
        float rgb[3];
        sum = step_light(r, s, t, sum);
        if (s->weight <= 0) continue; /* the path ended here */
        eval(r, s->i_group, s->wi, s->wo, rgb);
        for (int c = 0; c < 3; c++) {
            t[c] *= (double)rgb[c] * (double)s->weight;
            sum += t[c] * (double)s->escape[c];
        }
    }
    return sum;
}
