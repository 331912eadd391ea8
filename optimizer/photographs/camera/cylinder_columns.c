#include "optimizer/photographs/camera/cylinder_columns.h"

#include "base/angle.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/camera/cylinder_place.h"
#include "optimizer/photographs/camera/photograph_develop.h"
#include "optimizer/photographs/cylinder/column_picture.h"
#include "optimizer/photographs/cylinder/cylinder_edges.h"
#include "optimizer/photographs/cylinder/cylinder_view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double largest_misfit = 0.05,       /* of the radius */
    search_margin = 0.06, least_margin_px = 6.0, /* share of the width by markers */
    least_width_px = 2.0, lit_cos = 0.05;        /* a silhouette with less light counts as dark */

/* ---- the outline ---- */

/* A photograph on its way to columns. */
struct wrapped {
    const struct photograph_process *process;
    const struct job_setup *setup;
    const struct job_photograph *photograph;
    struct cylinder_view view;
    struct cylinder_edges edges;
    bool marked;     /* markers promise its outline */
    size_t limit[4]; /* part of the picture that is used */
};

/* The side, "-x" or "+x", whose silhouette has no light of the lamp; NULL when both have. */
static const char *dark_side(const struct cylinder_view *v)
{
    for (int k = 0; k < 2; k++) {
        struct cylinder_angles angles;
        cylinder_view_angles(v, v->camera_azimuth_rad + (k == 0 ? -1.0 : 1.0) * v->edge_rad, &angles);
        if (cos(angles.light_theta_rad) < lit_cos) return k == 0 ? "-x" : "+x";
    }
    return NULL;
}

static void extent_of(const double px[8], double box[4])
{
    for (size_t a = 0; a < 2; a++) {
        box[a] = fmin(fmin(px[a], px[2 + a]), fmin(px[4 + a], px[6 + a]));
        box[2 + a] = fmax(fmax(px[a], px[2 + a]), fmax(px[4 + a], px[6 + a]));
    }
}

/* The part of the picture across the cylinder where the markers promise it, with a margin; else all of it. */
static void part_to_search(const struct wrapped *w, size_t part[4])
{
    const struct job_cylinder *c = &w->photograph->cylinder;
    double box[4];
    memcpy(part, w->limit, sizeof w->limit);
    if (!w->marked) return;
    const size_t across = c->axis == JOB_AXIS_UP || c->axis == JOB_AXIS_DOWN ? 0 : 1;
    extent_of(c->markers_px, box);
    const double margin = fmax(search_margin * (box[2 + across] - box[across]), least_margin_px);
    part[across] = (size_t)fmax(floor(box[across] - margin), (double)w->limit[across]);
    part[2 + across] =
        (size_t)fmax(fmin(ceil(box[2 + across] + margin), (double)w->limit[2 + across]), (double)part[across] + 1.0);
}

/* Looks for the silhouettes in the picture im, which shows w->limit. */
static status search(struct wrapped *w, const struct image *im, struct error *err)
{
    size_t part[4];
    struct image area;
    part_to_search(w, part);
    const double origin[2] = {(double)part[0], (double)part[1]};
    status s = image_init(&area, part[2] - part[0], part[3] - part[1], 3, err);
    if (s != STATUS_OK) return s;
    for (size_t y = 0; y < area.height; y++)
        memcpy(area.pixel + 3 * y * area.width,
               im->pixel + 3 * ((y + part[1] - w->limit[1]) * im->width + part[0] - w->limit[0]),
               3 * area.width * sizeof *area.pixel);
    s = cylinder_edges_find(&area, origin, w->photograph->cylinder.axis, &w->edges, err);
    image_release(&area);
    const char *side = s == STATUS_OK && w->edges.dark_background ? dark_side(&w->view) : NULL;
    if (side == NULL) return s;
    return error_set(err, STATUS_NOT_FOUND, "its silhouette on the side of %s lies in shadow before a dark background",
                     side);
}

static double middle_of(const struct wrapped *w)
{
    const double middle[2] = {0.5 * (double)(w->limit[0] + w->limit[2]), 0.5 * (double)(w->limit[1] + w->limit[3])};
    double uv[2];
    cylinder_edges_to_frame(w->photograph->cylinder.axis, middle, uv);
    return uv[1];
}

/* Compares the width in the picture with the width by lens or markers. */
static status check_radius(const struct wrapped *w, const struct cylinder_edges *by_markers, struct error *err)
{
    const struct lens *lens = &w->process->lens;
    const double width = cylinder_edges_width_px(&w->edges, middle_of(w));
    double wanted = NAN;
    if (by_markers != NULL)
        wanted = cylinder_edges_width_px(by_markers, middle_of(w));
    else if (lens->has_distortion && !w->view.camera.far)
        wanted = cylinder_view_width_px(&w->view, 0.5 * (lens->focal_px[0] + lens->focal_px[1]));
    if (isnan(wanted) || fabs(width / wanted - 1.0) < largest_misfit) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, OPTION_CYLINDER_RADIUS,
                           "its silhouettes are %.1f pixels apart, but by %s a cylinder of radius %g mm is %.1f pixels "
                           "wide: correct the radius, or the camera's distance",
                           width, by_markers != NULL ? "the markers" : "the lens of the rig", w->view.radius_mm,
                           wanted);
}

/* Finds the outline: as given, else in the picture, else by the markers. */
static status find_outline(struct wrapped *w, const struct image *im, struct error *err)
{
    const struct job_cylinder *c = &w->photograph->cylinder;
    struct cylinder_edges by_markers;
    struct error why = {0};
    status s = STATUS_OK;
    if (w->marked) s = cylinder_edges_of_points(c->axis, c->markers_px, &by_markers, err);
    if (s != STATUS_OK) return s;
    if (!isnan(c->edges_px[0])) {
        s = cylinder_edges_of_points(c->axis, c->edges_px, &w->edges, err);
        if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_CYLINDER_EDGES);
    } else if ((s = search(w, im, &why)) == STATUS_NOT_FOUND && w->marked) {
        const bool in_the_dark = w->edges.dark_background && dark_side(&w->view) != NULL;
        w->edges = by_markers;
        if (!in_the_dark)
            warning_send(
                w->process->warn, OPTION_NONE,
                "photograph '%s': the markers say where its cylinder is, but it was not found there (%s): check "
                "'cylinder_radius_mm'",
                w->photograph->file, why.text);
        return STATUS_OK;
    } else if (s == STATUS_NOT_FOUND)
        s = error_set_field(err, STATUS_INVALID, OPTION_CYLINDER_EDGES,
                            "the edges of its cylinder were not found: %s. Give 'cylinder_edges_px', a part of the "
                            "picture with an even background on both sides ('crop_px'), or a rig with markers and lens",
                            why.text);
    else if (s != STATUS_OK)
        s = error_set(err, s, "%s", why.text);
    return s == STATUS_OK ? check_radius(w, w->marked ? &by_markers : NULL, err) : s;
}

/* ---- columns ---- */

/* Reasons why columns are left out. */
struct left_out {
    size_t seen, lit, narrow;
};

struct column_list {
    size_t n, capacity;
    struct job_photograph *item;
};

static status append(struct column_list *list, const struct job_photograph *p, struct error *err)
{
    if (list->n >= JOB_MAX_PHOTOGRAPH)
        return error_set_field(err, STATUS_INVALID, OPTION_PHOTOGRAPHS,
                               "the photographs and columns of cylinders are more than %d rows: give larger "
                               "'cylinder_step_deg'",
                               JOB_MAX_PHOTOGRAPH);
    if (list->n == list->capacity) {
        const size_t capacity = 2 * list->capacity + 32;
        struct job_photograph *item = realloc(list->item, capacity * sizeof *item);
        if (item == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read photographs: out of memory");
        list->item = item;
        list->capacity = capacity;
    }
    struct job_photograph *to = &list->item[list->n];
    *to = *p;
    to->exposure = p->n_exposure > 0 ? malloc(p->n_exposure * sizeof *to->exposure) : NULL;
    if (p->n_exposure > 0 && to->exposure == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot read photographs: out of memory");
    if (p->n_exposure > 0) memcpy(to->exposure, p->exposure, p->n_exposure * sizeof *to->exposure);
    list->n++;
    return STATUS_OK;
}

/* Extent of the used part along the axis: the length that is asked for, about the middle, within the crop. */
static void extent_along(const struct wrapped *w, double v[2])
{
    const double corner[2][2] = {{(double)w->limit[0], (double)w->limit[1]},
                                 {(double)w->limit[2], (double)w->limit[3]}};
    double uv[2][2];
    for (size_t k = 0; k < 2; k++) cylinder_edges_to_frame(w->photograph->cylinder.axis, corner[k], uv[k]);
    v[0] = fmin(uv[0][1], uv[1][1]);
    v[1] = fmax(uv[0][1], uv[1][1]);
    if (w->marked || !(w->photograph->cylinder.length_mm > 0.0)) return; /* by markers the crop has this length */
    const double middle = 0.5 * (v[0] + v[1]), width = cylinder_edges_width_px(&w->edges, middle),
                 half = 0.5 * w->photograph->cylinder.length_mm * cylinder_view_px_per_mm(&w->view, width);
    v[0] = fmax(v[0], middle - half);
    v[1] = fmin(v[1], middle + half);
}

/* Returns whether lamp and camera see all of a column within the limit. */
static bool within_limit(const struct wrapped *w, const double a[2], struct left_out *out)
{
    const double limit = w->photograph->cylinder.limit_deg * RAD_PER_DEG;
    bool seen = true, lit = true;
    for (size_t k = 0; k < 2; k++) {
        struct cylinder_angles angles;
        cylinder_view_angles(&w->view, a[k], &angles);
        seen = seen && angles.camera_theta_rad <= limit;
        lit = lit && angles.light_theta_rad <= limit;
    }
    out->seen += !seen;
    out->lit += seen && !lit;
    return seen && lit;
}

/* Makes the column between the angles a[0] and a[1] of the photograph p. False when it is too narrow. */
static bool make_column(const struct wrapped *w, const double a[2], struct job_photograph *p)
{
    const double s[2] = {cylinder_view_s(&w->view, a[0]), cylinder_view_s(&w->view, a[1])};
    const double width = 0.5 * cylinder_edges_width_px(&w->edges, middle_of(w)), middle = 0.5 * (s[0] + s[1]);
    struct cylinder_angles angles;
    double v[2];
    if ((s[1] - s[0]) * width < least_width_px) return false;
    const double angle = cylinder_view_mean_angle(&w->view, s[0], s[1]);
    cylinder_view_angles(&w->view, angle, &angles);
    extent_along(w, v);
    cylinder_edges_part(&w->edges, p->cylinder.axis, v, s, p->column.corner_px);
    column_picture_crop((const double(*)[2])p->column.corner_px, w->limit, p->crop_px);
    memset(p->crop_exact_px, 0, sizeof p->crop_exact_px);
    p->column.angle_deg = angle * DEG_PER_RAD;
    const double slope = 0.5 *
                         (cylinder_view_angle(&w->view, fmin(middle + 1e-3, 1.0)) -
                          cylinder_view_angle(&w->view, fmax(middle - 1e-3, -1.0))) /
                         1e-3;
    p->column.angle_se_deg = slope * w->edges.se_px / width * DEG_PER_RAD;
    p->light_theta_deg = angles.light_theta_rad * DEG_PER_RAD;
    p->light_phi_deg = angles.light_phi_rad * DEG_PER_RAD;
    p->camera_theta_deg = angles.camera_theta_rad * DEG_PER_RAD;
    p->camera_phi_deg = angles.camera_phi_rad * DEG_PER_RAD;
    if (!w->view.light.far) p->light_distance_cm = 0.1 * angles.light_distance_mm;
    if (!w->view.camera.far) p->camera_distance_cm = 0.1 * angles.camera_distance_mm;
    p->scale /= angles.lamp_cos;
    return true;
}

/* The part of the photograph that holds all columns. */
static void part_of_columns(const struct job_photograph *column, size_t n, size_t part[4])
{
    memcpy(part, column[0].crop_px, sizeof column[0].crop_px);
    for (size_t i = 1; i < n; i++)
        for (size_t a = 0; a < 2; a++) {
            part[a] = column[i].crop_px[a] < part[a] ? column[i].crop_px[a] : part[a];
            part[2 + a] = column[i].crop_px[2 + a] > part[2 + a] ? column[i].crop_px[2 + a] : part[2 + a];
        }
}

static void report_left_out(const struct wrapped *w, size_t n, const struct left_out *out)
{
    const struct job_photograph *p = w->photograph;
    if (out->seen + out->lit + out->narrow == 0) return;
    warning_send(
        w->process->warn, OPTION_NONE,
        "photograph '%s' of a cylinder has %zu columns; left out are %zu seen and %zu more lit at over %g degrees "
        "from their normal, and %zu narrower than %g pixels",
        p->file, n, out->seen, out->lit, p->cylinder.limit_deg, out->narrow, least_width_px);
}

/* Appends the columns that both silhouettes enclose. */
static status append_columns(const struct wrapped *w, struct column_list *list, struct error *err)
{
    const double step = w->photograph->cylinder.step_deg * RAD_PER_DEG;
    const double from = w->view.camera_azimuth_rad - w->view.edge_rad,
                 to = w->view.camera_azimuth_rad + w->view.edge_rad;
    const size_t first = list->n;
    struct left_out out = {0};
    status s = STATUS_OK;
    for (long i = lround(ceil(from / step + 0.5)); (double)i + 0.5 <= to / step && s == STATUS_OK; i++) {
        const double a[2] = {((double)i - 0.5) * step, ((double)i + 0.5) * step};
        struct job_photograph p = *w->photograph;
        p.column.number = list->n - first + 1;
        if (!within_limit(w, a, &out)) continue;
        if (make_column(w, a, &p))
            s = append(list, &p, err);
        else
            out.narrow++;
    }
    if (s != STATUS_OK) return s;
    for (size_t i = first; i < list->n; i++) {
        list->item[i].column.n = list->n - first;
        part_of_columns(list->item + first, list->n - first, list->item[i].column.view_px);
    }
    report_left_out(w, list->n - first, &out);
    if (list->n > first) return STATUS_OK;
    return error_set(err, STATUS_INVALID,
                     "no column of its cylinder is lit and seen within %g degrees from its normal and two pixels wide: "
                     "check the angles, or give larger 'cylinder_step_deg' and 'cylinder_limit_deg'",
                     w->photograph->cylinder.limit_deg);
}

static status wrap(const struct photograph_process *k, const struct job_setup *setup, const char *folder,
                   const struct job_photograph *p, struct column_list *list, struct error *err)
{
    const double *mark = p->cylinder.markers_px;
    struct wrapped w = {.process = k, .setup = setup, .photograph = p, .marked = mark[0] != 0.0 || mark[1] != 0.0};
    struct image im = {0};
    status s = cylinder_place_view(setup, p, &w.view, err);
    if (s == STATUS_OK) s = photograph_develop(k, folder, p, &im, NULL, err);
    if (s != STATUS_OK) return s;
    memcpy(w.limit, p->crop_px, sizeof w.limit);
    w.limit[2] = w.limit[0] + im.width;
    w.limit[3] = w.limit[1] + im.height;
    s = find_outline(&w, &im, err);
    image_release(&im);
    if (s == STATUS_OK) s = append_columns(&w, list, err);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot use photograph '%s'", p->file);
}

/* Names the photograph in the field of an error that names none, or an option without its place. */
static void place_field(size_t i, struct error *err)
{
    if (err == NULL || strchr(err->field, '[') != NULL || strcmp(err->field, OPTION_PHOTOGRAPHS) == 0) return;
    if (err->field[0] == '\0') snprintf(err->field, sizeof err->field, OPTION_PHOTOGRAPH_FILE);
    const size_t n = strlen(err->field);
    snprintf(err->field + n, sizeof err->field - n, "[%zu]", i);
}

static void release_list(struct job_photograph *item, size_t n)
{
    for (size_t i = 0; i < n; i++) free(item[i].exposure);
    free(item);
}

status cylinder_columns_make(const struct photograph_process *k, const struct job_setup *setup, struct job_rows *rows,
                             const char *folder, struct error *err)
{
    struct column_list list = {0};
    bool any = false;
    status s = STATUS_OK;
    for (size_t i = 0; i < rows->n_photograph; i++) any = any || job_photograph_is_cylinder(&rows->photograph[i]);
    for (size_t i = 0; i < rows->n_photograph && any && s == STATUS_OK; i++) {
        const struct job_photograph *p = &rows->photograph[i];
        s = job_photograph_is_cylinder(p) ? wrap(k, setup, folder, p, &list, err) : append(&list, p, err);
        if (s != STATUS_OK) place_field(p->index, err);
    }
    if (s != STATUS_OK || !any) {
        release_list(list.item, list.n);
        return s;
    }
    release_list(rows->photograph, rows->n_photograph);
    rows->photograph = list.item;
    rows->n_photograph = list.n;
    return STATUS_OK;
}
