#include "optimizer/photographs/reader/photograph_info.h"

#include <math.h>

double photograph_saturation(const struct photograph_info *info)
{
    return fmin(info->saturation[0], fmin(info->saturation[1], info->saturation[2]));
}
