/* The options of a reconstruction that nobody chose. */
#include "geometry/grade/reconstruct_option.h"

#include <math.h>

void reconstruct_option_default(struct reconstruct_option *o)
{
    *o = (struct reconstruct_option){
        .voxel_size_m = {NAN, NAN, NAN},
        .crop_keep = 0.5,
        .trim_above_voxel = (size_t)1 << 30,
        .matrix = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0},
        .density_low = NAN,
        .density_high = NAN,
        .hollow_fibers = -1,
        .fiber_diameter_voxel = NAN,
        .s = NAN,
        .t = NAN,
        .eps_d = NAN,
        .eps_j = NAN,
        .link_sigma_voxel = 5.0,
        .min_vertex = 10,
        .smooth_alpha = 0.1,
        .radius_m = {NAN, NAN, NAN},
        .radius_rule = RADIUS_AUTO,
    };
}
