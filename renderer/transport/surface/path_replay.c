#include "renderer/transport/surface/path_tracer.h"

static void eval(const struct parameter_sets *sets, uint32_t i_group, const float wi[3], const float wo[3],
                 float s_rgb[3])
{
    sets->model->eval(sets->state[sets->n > 1 ? i_group : 0], wi, wo, s_rgb, NULL);
}

/* Light that step s receives: from the lamp, from the image, and from the lamp by way of another fiber. */
static double step_light(const struct parameter_sets *sets, const struct path_step *s, const double t[3], double sum)
{
    float rgb[3];
    if (s->light > 0) {
        eval(sets, s->i_group, s->light_wi, s->wo, rgb);
        for (int c = 0; c < 3; c++) sum += t[c] * (double)rgb[c] * (double)s->light;
    }
    if (s->image[0] + s->image[1] + s->image[2] > 0) {
        eval(sets, s->i_group, s->image_wi, s->wo, rgb);
        for (int c = 0; c < 3; c++) sum += t[c] * (double)rgb[c] * (double)s->image[c];
    }
    if (s->guided_light > 0) {
        float ahead[3];
        eval(sets, s->i_group, s->guided_wi, s->wo, rgb);
        eval(sets, s->i_guided_group, s->guided_light_wi, s->guided_wo, ahead);
        for (int c = 0; c < 3; c++) sum += t[c] * (double)rgb[c] * (double)ahead[c] * (double)s->guided_light;
    }
    return sum;
}

double path_replay(const struct parameter_sets *sets, const struct path_record *record)
{
    double t[3] = {1, 1, 1}, sum = 0;
    for (size_t i = 0; i < record->n_step; i++) {
        const struct path_step *s = &record->step[i];
        float rgb[3];
        sum = step_light(sets, s, t, sum);
        if (s->weight <= 0) continue; /* the path ended here */
        eval(sets, s->i_group, s->wi, s->wo, rgb);
        for (int c = 0; c < 3; c++) {
            t[c] *= (double)rgb[c] * (double)s->weight;
            sum += t[c] * (double)s->escape[c];
        }
    }
    return sum;
}
