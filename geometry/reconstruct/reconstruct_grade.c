/* The grade of the traced lines against their scan. */
#include "geometry/reconstruct/reconstruct.h"

#include <math.h>

/* Parts of the error of positions, chosen on scans whose fibers are known (geometry/NOTES.md): of the stated noise, and
 * of blur^2 / diameter where fibers touch. */
static const double OF_NOISE = 0.85, OF_CONTACT = 1.0;

/* The fit has the blurred edge of a plane, and blurred cylinders that touch differ from a sum of such edges by a
 * distance of about blur^2 / diameter. Lines are moved by that where they have a neighbour. */
static void add_contact(struct reconstruct_report *report, double voxel_m)
{
    const double blur = report->profile_blur_m, diameter = report->fiber_diameter_voxel * voxel_m,
                 beside = report->grade.beside_share;
    if (!(report->axis_noise_se_m > 0.0) || isnan(beside)) return;
    report->axis_position_se_m =
        hypot(OF_NOISE * report->axis_noise_se_m, OF_CONTACT * beside * blur * blur / diameter);
}

struct coverage_input reconstruct_coverage_input(const struct volume *v, const struct fiber_set *f,
                                                 const struct reconstruct_report *report)
{
    return (struct coverage_input){v, f, report->fiber_diameter_voxel, report->profile_blur_m / v->voxel_size_m[0],
                                   report->noise.mapped_sd};
}

status reconstruct_grade(const struct volume *v, const struct fiber_set *f, struct thread_pool *pool,
                         struct reconstruct_report *report, float *safe, struct error *err)
{
    const struct coverage_input in = reconstruct_coverage_input(v, f, report);
    status s = fiber_kinds_measure(v, f, report->single_radius_se_m, report->radius_se_m[0], &report->kinds, err);
    if (s == STATUS_OK) s = scan_grade_measure(v, f, pool, NULL, &report->grade, safe, err);
    if (s == STATUS_OK) add_contact(report, v->voxel_size_m[0]);
    return s == STATUS_OK ? scan_grade_explain(&in, pool, &report->grade, safe, err) : s;
}
