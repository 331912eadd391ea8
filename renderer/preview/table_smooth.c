/* Less noise in a table by means over neighbouring cells, as long as they bring it nearer to the truth. */
#include "renderer/preview/appearance_table.h"
#include "renderer/preview/table_walks.h"

/* One axis of the table: n cells, `stride` floats apart. */
struct axis {
    size_t n, stride;
};

/* to = (1/4, 1/2, 1/4) of from along the axis; at its ends the cell itself takes the place of the missing one. */
static void smooth_axis(const float *from, float *to, size_t n_value, const struct axis *a)
{
    for (size_t i = 0; i < n_value; i++) {
        size_t k = i / a->stride % a->n;
        float low = k > 0 ? from[i - a->stride] : from[i], high = k + 1 < a->n ? from[i + a->stride] : from[i];
        to[i] = 0.5f * from[i] + 0.25f * (low + high);
    }
}

void table_smooth(const struct appearance_table *t, float *value, float *spare)
{
    const size_t own = 3 * t->n_basis, l = t->light_edge, v = t->view_edge, view = t->n_side * l * l * own,
                 n_value = t->n_side * v * v * view;
    const struct axis axis[4] = {{l, own}, {l, l * own}, {v, view}, {v, v * view}};
    for (int i = 0; i < 4; i += 2) {
        smooth_axis(value, spare, n_value, &axis[i]);
        smooth_axis(spare, value, n_value, &axis[i + 1]);
    }
}
