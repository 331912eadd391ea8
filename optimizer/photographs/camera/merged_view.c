#include "optimizer/photographs/camera/merged_view.h"

void merged_view_release(struct merged_view *e)
{
    for (size_t i = 0; i < e->n; i++) image_release(&e->image[i]);
    image_release(&e->variance);
}
