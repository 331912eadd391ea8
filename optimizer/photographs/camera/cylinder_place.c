#include "optimizer/photographs/camera/cylinder_place.h"

#include "base/angle.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/camera/plane_pose.h"

#include <math.h>

static struct cylinder_station station_of(bool far, double theta_deg, double phi_deg, double distance_cm)
{
    return (struct cylinder_station){far, theta_deg * RAD_PER_DEG, phi_deg * RAD_PER_DEG, 10.0 * distance_cm};
}

status cylinder_place_view(const struct job_setup *setup, const struct job_photograph *p, struct cylinder_view *v,
                           struct error *err)
{
    const double light_cm = p->light_distance_cm > 0.0 ? p->light_distance_cm : setup->lamp_distance_cm,
                 camera_cm = p->camera_distance_cm > 0.0 ? p->camera_distance_cm : setup->camera_distance_cm;
    *v = (struct cylinder_view){
        .radius_mm = p->cylinder.radius_mm,
        .light = station_of(setup->lamp_directional, p->light_theta_deg, p->light_phi_deg, light_cm),
        .camera = station_of(setup->camera_far_field, p->camera_theta_deg, p->camera_phi_deg, camera_cm)};
    return cylinder_view_init(v, err);
}

status cylinder_place_by_markers(const struct job_setup *setup, const double map[9], const struct lens *lens,
                                 struct job_photograph *p, struct error *err)
{
    const double half = 5.0 * setup->crop_cm;
    struct cylinder_view v;
    status s = cylinder_place_view(setup, p, &v, err);
    for (size_t i = 0; i < 4 && s == STATUS_OK; i++) {
        const double a = v.camera_azimuth_rad + (i < 2 ? -1.0 : 1.0) * v.edge_rad;
        const double at[3] = {v.radius_mm * sin(a), i % 2 == 0 ? -half : half, v.radius_mm * (cos(a) - 1.0)};
        s = plane_map_project(map, lens->focal_px, lens->center_px, at, p->cylinder.markers_px + 2 * i, err);
    }
    return s;
}
