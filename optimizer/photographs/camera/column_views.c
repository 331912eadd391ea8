#include "optimizer/photographs/camera/column_views.h"

#include "optimizer/job/document/job_photograph.h"

#include <string.h>

void column_views_release(struct column_views *v)
{
    if (v->full) merged_view_release(&v->view);
    memset(v, 0, sizeof *v);
}

bool column_views_has(const struct column_views *v, const struct job_photograph *p)
{
    return v->full && v->index == p->index && memcmp(v->view_px, p->column.view_px, sizeof v->view_px) == 0;
}

void column_views_keep(struct column_views *v, const struct job_photograph *p, struct merged_view *e)
{
    column_views_release(v);
    v->full = true;
    v->index = p->index;
    memcpy(v->view_px, p->column.view_px, sizeof v->view_px);
    v->view = *e;
    memset(e, 0, sizeof *e);
    for (size_t i = 1; i < v->view.n; i++) { /* they are merged into the first */
        image_release(&v->view.image[i]);
        memset(&v->view.image[i], 0, sizeof v->view.image[i]);
    }
}

/* Copies the pixels from `at` on, width x height of them. */
static status copy_part(const struct image *from, const size_t at[2], size_t width, size_t height, struct image *to,
                        struct error *err)
{
    status s = image_init(to, width, height, 3, err);
    for (size_t y = 0; y < height && s == STATUS_OK; y++)
        memcpy(to->pixel + 3 * y * width, from->pixel + 3 * ((y + at[1]) * from->width + at[0]),
               3 * width * sizeof *to->pixel);
    return s;
}

status column_views_copy(const struct column_views *v, const struct job_photograph *p, bool cut, struct merged_view *e,
                         struct error *err)
{
    const struct merged_view *view = &v->view;
    const size_t *crop = p->crop_px, at[2] = {cut ? crop[0] - v->view_px[0] : 0, cut ? crop[1] - v->view_px[1] : 0},
                 width = cut ? crop[2] - crop[0] : view->image[0].width,
                 height = cut ? crop[3] - crop[1] : view->image[0].height;
    e->n = view->n;
    status s = copy_part(&view->image[0], at, width, height, &e->image[0], err);
    if (s == STATUS_OK && view->variance.pixel != NULL)
        s = copy_part(&view->variance, at, width, height, &e->variance, err);
    memcpy(e->record, view->record, sizeof e->record);
    memcpy(e->name, view->name, sizeof e->name);
    memcpy(e->time_error, view->time_error, sizeof e->time_error);
    memcpy(e->light_mean, view->light_mean, sizeof e->light_mean);
    return s;
}
