#include "optimizer/photographs/camera/marker_views.h"

#include "base/option_id.h"
#include "geometry/vision/vision_markers.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/camera/cylinder_place.h"
#include "optimizer/photographs/camera/plane_pose.h"
#include "optimizer/photographs/reader/photograph.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double largest_misfit = 0.1; /* of a marker's edge */
enum { ENOUGH_CORNERS = 8 };              /* of a chessboard: the rougher corners of its markers then do not count */

static int compare_float(const void *a, const void *b)
{
    float x, y;
    memcpy(&x, a, sizeof x);
    memcpy(&y, b, sizeof y);
    return x < y ? -1 : x > y;
}

/* The green channel with a curve that shows dark and bright parts, for the search. */
static uint8_t *grey_of(const struct image *im)
{
    enum { N = 4096 };
    float value[N];
    size_t n = im->width * im->height;
    uint8_t *grey = malloc(n);
    for (size_t i = 0; i < N; i++) value[i] = im->pixel[3 * (size_t)((double)i / N * (double)n) + 1];
    qsort(value, N, sizeof *value, compare_float);
    double bright = fmax((double)value[N * 99 / 100], 1e-30);
    for (size_t i = 0; i < n && grey != NULL; i++)
        grey[i] = (uint8_t)lrint(255.0 * sqrt(fmin(fmax((double)im->pixel[3 * i + 1] / bright, 0.0), 1.0)));
    return grey;
}

/* Points that are known on the plane and in the picture. */
struct point_list {
    size_t n, n_marker;
    bool seen[MARKER_MAX];
    double plane[4 * MARKER_MAX + MARKER_MAX_CORNER][2], pixel[4 * MARKER_MAX + MARKER_MAX_CORNER][2];
};

/* Adds the four corners of a found marker, if the board has it. */
static void add_marker(const struct marker_board *b, const struct lens *lens, const struct vision_marker *found,
                       struct point_list *list)
{
    static const double side[4][2] = {{-0.5, 0.5}, {0.5, 0.5}, {0.5, -0.5}, {-0.5, -0.5}};
    size_t m = 0;
    while (m < b->n && b->id[m] != found->id) m++;
    if (m == b->n || list->seen[m]) return;
    list->seen[m] = true;
    list->n_marker++;
    for (size_t k = 0; k < 4; k++, list->n++) {
        for (size_t c = 0; c < 2; c++) list->plane[list->n][c] = b->center_mm[m][c] + side[k][c] * b->side_mm;
        lens_undistort(lens, found->corner_px + 2 * k, list->pixel[list->n]);
    }
}

/* Adds the corners of the chessboard between found markers. map: from the markers. */
static status add_board_corners(const struct marker_board *b, const struct lens *lens, const uint8_t *grey,
                                const size_t size[2], const double map[9], struct point_list *list, struct error *err)
{
    double at[MARKER_MAX_CORNER][2], promised[MARKER_MAX_CORNER][2];
    size_t which[MARKER_MAX_CORNER], n = 0;
    const double origin[2] = {0, 0};
    double px_per_square = b->square_mm * plane_map_scale(map, origin), half = floor(0.1 * px_per_square);
    if (half < 2.0) return STATUS_OK;
    for (size_t i = 0; i < b->n_corner; i++) {
        double ideal[2];
        if (!list->seen[b->corner_marker[i][0]] || !list->seen[b->corner_marker[i][1]]) continue;
        plane_map_apply(map, b->corner_mm[i], ideal);
        memcpy(at[n], ideal, sizeof ideal);
        if (lens->has_distortion) lens_distort(lens, ideal, at[n]);
        memcpy(promised[n], at[n], sizeof at[n]);
        if (at[n][0] > 2.0 * half && at[n][1] > 2.0 * half && at[n][0] < (double)size[0] - 2.0 * half &&
            at[n][1] < (double)size[1] - 2.0 * half)
            which[n++] = i;
    }
    status s = vision_refine_corners(grey, size, (size_t)fmin(half, 20.0), n, at, err);
    for (size_t i = 0; i < n && s == STATUS_OK; i++) {
        double moved = hypot(at[i][0] - promised[i][0], at[i][1] - promised[i][1]);
        if (!(moved < 0.1 * px_per_square) || !(moved > 0.0)) continue; /* another edge, or none */
        memcpy(list->plane[list->n], b->corner_mm[which[i]], sizeof *list->plane);
        lens_undistort(lens, at[i], list->pixel[list->n++]);
    }
    return s;
}

static status fit_map(const struct point_list *list, double map[9], double *rms_px, struct error *err)
{
    return plane_map_fit(list->n, (const double(*)[2])list->plane, (const double(*)[2])list->pixel, map, rms_px, err);
}

static status find_points(const struct marker_board *b, const struct lens *lens, const uint8_t *grey,
                          const size_t size[2], struct point_list *list, struct error *err)
{
    struct vision_marker found[MARKER_MAX];
    size_t n = 0;
    double map[9], rms_px;
    status s = vision_find_markers(grey, size, b->dictionary, b->n_corner == 0, MARKER_MAX, found, &n, err);
    for (size_t i = 0; i < n && s == STATUS_OK; i++) add_marker(b, lens, &found[i], list);
    if (s == STATUS_OK && list->n_marker < 2)
        return error_set(
            err, STATUS_INVALID,
            "it shows %zu of the %zu markers of the rig, at least two are needed: give 'crop_px' and the place "
            "of the camera, or markers that are sharp and not covered",
            list->n_marker, b->n);
    if (s != STATUS_OK || b->n_corner == 0) return s;
    s = fit_map(list, map, &rms_px, err);
    return s == STATUS_OK ? add_board_corners(b, lens, grey, size, map, list, err) : s;
}

static void keep_board_corners(struct point_list *list)
{
    size_t first = 4 * list->n_marker;
    list->n -= first;
    memmove(list->plane, list->plane + first, list->n * sizeof *list->plane);
    memmove(list->pixel, list->pixel + first, list->n * sizeof *list->pixel);
}

status marker_view_find(const struct marker_board *board, const struct lens *lens, const struct image *im,
                        struct marker_view *v, struct error *err)
{
    struct point_list list = {0};
    double map[9];
    const double origin[2] = {0, 0};
    *v = (struct marker_view){0};
    uint8_t *grey = grey_of(im);
    if (grey == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look for markers: out of memory");
    status s = find_points(board, lens, grey, (size_t[2]){im->width, im->height}, &list, err);
    free(grey);
    v->n_marker = list.n_marker;
    v->n_corner = list.n - 4 * list.n_marker;
    if (v->n_corner >= ENOUGH_CORNERS) keep_board_corners(&list);
    if (s == STATUS_OK) s = fit_map(&list, map, &v->rms_px, err);
    if (s != STATUS_OK) return s;
    memcpy(v->map, map, sizeof v->map);
    plane_map_apply(map, origin, v->center_px);
    v->px_per_mm = plane_map_scale(map, origin);
    if (v->rms_px > largest_misfit * board->side_mm * v->px_per_mm)
        return error_set(
            err, STATUS_INVALID,
            "its markers lie %.1f pixels (root mean square) from where the rig says: check their places and "
            "size",
            v->rms_px);
    v->has_camera = lens->has_distortion;
    return v->has_camera ? plane_map_camera(map, lens->focal_px, lens->center_px, v->camera_mm, err) : STATUS_OK;
}

static status set_crop(const struct marker_view *v, double crop_cm, size_t width, size_t height,
                       struct job_photograph *p, struct error *err)
{
    const double edge_mm = p->cylinder.length_mm > 0.0 ? p->cylinder.length_mm : 10.0 * crop_cm,
                 half = 0.5 * edge_mm * v->px_per_mm, size[2] = {(double)width, (double)height};
    const bool cylinder = job_photograph_is_cylinder(p);
    const size_t across = p->cylinder.axis == JOB_AXIS_UP || p->cylinder.axis == JOB_AXIS_DOWN ? 0 : 1;
    bool inside = true;
    for (size_t c = 0; c < 2; c++) {
        if (cylinder && c == across) {
            p->crop_px[c] = 0;
            p->crop_px[2 + c] = c == 0 ? width : height;
            continue;
        }
        double from = v->center_px[c] - half, to = v->center_px[c] + half, edge = fmax(rint(to - from), 1.0);
        inside = inside && from >= 0.0 && to <= size[c] && rint(from) + edge <= size[c];
        if (!inside) break;
        p->crop_px[c] = (size_t)rint(from);
        p->crop_px[2 + c] = (size_t)(rint(from) + edge);
        if (cylinder) continue;
        p->crop_exact_px[c] = from;
        p->crop_exact_px[2 + c] = to;
    }
    if (inside) return STATUS_OK;
    return error_set(err, STATUS_INVALID,
                     "the crop of %g mm about the orbit center, %.0f pixels about (%.0f, %.0f), is not all in the "
                     "picture",
                     edge_mm, rint(2.0 * half), v->center_px[0], v->center_px[1]);
}

status marker_view_apply(const struct marker_view *v, double crop_cm, size_t width, size_t height,
                         struct job_photograph *p, struct error *err)
{
    status s = p->crop_px[2] == 0 ? set_crop(v, crop_cm, width, height, p, err) : STATUS_OK;
    if (s != STATUS_OK || !isnan(p->camera_theta_deg)) return s;
    if (!v->has_camera)
        return error_set(err, STATUS_INVALID,
                         "the place of its camera is not given, and cannot follow from the markers without the focal "
                         "lengths of the lens ('distortion' of the rig)");
    job_angles_of_position(v->camera_mm, &p->camera_theta_deg, &p->camera_phi_deg, &p->camera_distance_cm);
    if (job_photograph_is_cylinder(p)) return STATUS_OK;
    p->camera_phi_deg += p->cloth_rotation_deg; /* the markers turn with the cloth, the camera does not */
    if (p->camera_phi_deg > 360.0) p->camera_phi_deg -= 360.0;
    if (p->camera_phi_deg < -360.0) p->camera_phi_deg += 360.0;
    return STATUS_OK;
}

static status apply_to(const struct marker_board *board, const struct lens *lens, const char *folder,
                       const struct job_setup *setup, struct job_photograph *p, struct error *err)
{
    struct job_photograph whole = *p;
    struct marker_view view;
    struct photograph_record r;
    struct image im;
    char path[4096];
    memset(whole.crop_px, 0, sizeof whole.crop_px);
    snprintf(path, sizeof path, "%s/%s", folder, p->file);
    status s = photograph_read_values(path, &whole, &im, &r, err);
    if (s != STATUS_OK) return s;
    s = marker_view_find(board, lens, &im, &view, err);
    if (s == STATUS_OK) s = marker_view_apply(&view, setup->crop_cm, im.width, im.height, p, err);
    if (s == STATUS_OK && job_photograph_is_cylinder(p) && view.has_camera)
        s = cylinder_place_by_markers(setup, view.map, lens, p, err);
    image_release(&im);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot use photograph '%s'", p->file);
}

status marker_views_apply(const struct marker_board *board, const struct lens *lens, const char *folder,
                          struct job_setup *setup, struct job_rows *rows, struct error *err)
{
    for (size_t i = 0; i < rows->n_photograph; i++) {
        struct job_photograph *p = &rows->photograph[i];
        const bool no_camera = isnan(p->camera_theta_deg),
                   no_edges = job_photograph_is_cylinder(p) && isnan(p->cylinder.edges_px[0]);
        status s = STATUS_OK;
        if (board->n > 0 && (no_camera || no_edges || p->crop_px[2] == 0))
            s = apply_to(board, lens, folder, setup, p, err);
        else if (no_camera)
            s = error_set(
                err, STATUS_INVALID,
                "cannot use photograph '%s': the place of its camera is not given, and the rig has no markers "
                "from which it could follow",
                p->file);
        if (s == STATUS_OK) continue;
        if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_PHOTOGRAPH_FILE "[%zu]", i);
        return s;
    }
    return STATUS_OK;
}
