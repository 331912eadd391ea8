#include "optimizer/job/document/job_rows.h"
#include "base/angle.h"

#include <math.h>

void job_angles_of_position(const double p[3], double *theta_deg, double *phi_deg, double *distance_cm)
{
    *theta_deg = atan2(hypot(p[0], p[1]), p[2]) * DEG_PER_RAD;
    *phi_deg = atan2(p[1], p[0]) * DEG_PER_RAD;
    *distance_cm = 0.1 * sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
}
