/* The grade of the traced lines against their scan. */
#include "geometry/reconstruct/reconstruct.h"

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
    return s == STATUS_OK ? scan_grade_explain(&in, pool, &report->grade, safe, err) : s;
}
