#include "optimizer/photographs/profile/bowl_profile.h"
#include "base/angle.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/photographs/profile/bowl_cells.h"
#include "optimizer/photographs/profile/bowl_pictures.h"
#include "optimizer/photographs/profile/bowl_place.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double most_saturated = 0.02, least_se = 1e-6; /* of the bowl's pixels; of the brightest cell */

static double wrap_deg(double phi) { return phi - 360.0 * floor((phi + 180.0) / 360.0); }

/* The bowl in one photograph. */
struct view {
    const struct job_bowl *bowl;
    const struct bowl_pictures *pictures;
    size_t i;
    struct bowl_shot shot;
    double reflected[3]; /* value that light from the bowl to itself adds */
};

static const char *name_of(const struct view *v) { return v->bowl->photograph[v->i].picture.file; }

#define view_error(v, err, ...)                                                                                        \
    bowl_pictures_error((v)->i, (err), "cannot use photograph '%s' of the bowl: " __VA_ARGS__)

/* The means over the bowl, by the area that each pixel sees, of the photograph and of its background. */
static status measure_means(struct view *v, struct error *err)
{
    const struct bowl_pictures *p = v->pictures;
    double area = 0.0, all[3] = {0}, background[3] = {0};
    for (size_t k = 0; k < p->width * p->height; k++) {
        struct bowl_place place;
        double value[3], dark[3];
        if (!bowl_pictures_place(p, k, &place)) continue;
        v->shot.n_pixel++;
        if (!bowl_pictures_value(p, k, value, dark)) {
            v->shot.n_saturated++;
            continue;
        }
        area += place.area;
        for (int c = 0; c < 3; c++) {
            all[c] += place.area * value[c];
            background[c] += place.area * dark[c];
        }
    }
    if (v->shot.n_pixel < BOWL_LEAST_SAMPLE)
        return view_error(v, err, "by the marks and the mask, %zu of its pixels show the inside of the bowl",
                          name_of(v), v->shot.n_pixel);
    if ((double)v->shot.n_saturated > most_saturated * (double)v->shot.n_pixel)
        return view_error(v, err, "%.1f %% of the bowl are saturated: take a shorter exposure, or 'more_exposures'",
                          name_of(v), 100.0 * (double)v->shot.n_saturated / (double)v->shot.n_pixel);
    for (int c = 0; c < 3; c++) {
        const double left = (all[c] - background[c]) / area;
        if (!(left > 0.0) && v->bowl->photograph[v->i].background[0] != '\0')
            return view_error(v, err,
                              "its background '%s' is brighter than it over the bowl (means %.4g and %.4g): they may "
                              "be exchanged, or have different exposures",
                              name_of(v), v->bowl->photograph[v->i].background, background[c] / area, all[c] / area);
        if (!(left > 0.0)) return view_error(v, err, "the mean over the bowl is %.4g", name_of(v), left);
        v->reflected[c] = v->bowl->reflectance[c] * v->bowl->height_mm / (2.0 * v->bowl->radius_mm) * left;
    }
    v->shot.mean = all[1] / area;
    v->shot.background = background[1] / area;
    v->shot.reflected = v->reflected[1];
    return STATUS_OK;
}

static void add_samples(const struct view *v, struct bowl_cells *cells)
{
    const struct bowl_pictures *p = v->pictures;
    const double lit = cos(v->bowl->photograph[v->i].theta_i_deg * RAD_PER_DEG);
    for (size_t k = 0; k < p->width * p->height; k++) {
        struct bowl_place place;
        double value[3], dark[3];
        if (!bowl_pictures_place(p, k, &place) || !place.counts || !bowl_pictures_value(p, k, value, dark)) continue;
        for (int c = 0; c < 3; c++)
            value[c] = (value[c] - dark[c] - v->reflected[c]) * lit * place.factor / v->bowl->reflectance[c];
        if (!v->bowl->is_rgb) value[0] = value[1] = value[2] = (value[0] + value[1] + value[2]) / 3.0;
        bowl_cells_add(cells, place.theta_o_rad * DEG_PER_RAD, place.azimuth_rad * DEG_PER_RAD, value);
    }
}

static status append_rows(struct view *v, const struct bowl_cells *cells, struct fiber_profile *profile,
                          struct error *err)
{
    const struct job_bowl_photograph *shot = &v->bowl->photograph[v->i];
    const size_t n = cells->n_theta * cells->n_azimuth;
    struct profile_row *more = realloc(profile->row, (profile->n + n) * sizeof *more);
    if (more == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the photographs of a bowl: out of memory");
    profile->row = more;
    for (size_t i = 0; i < n; i++) {
        double theta_deg, azimuth_deg;
        struct profile_row row = {.theta_i_rad = shot->theta_i_deg * RAD_PER_DEG};
        if (!bowl_cells_value(cells, i, row.radiance, row.se)) continue;
        bowl_cells_middle(cells, i, &theta_deg, &azimuth_deg);
        row.theta_o_rad = theta_deg * RAD_PER_DEG;
        row.phi_i_rad = wrap_deg(shot->phi_i_deg - shot->fiber_turn_deg) * RAD_PER_DEG;
        row.phi_rad = wrap_deg(azimuth_deg - shot->phi_i_deg) * RAD_PER_DEG;
        profile->row[profile->n++] = row;
        v->shot.n_cell++;
    }
    if (v->shot.n_cell == 0)
        return view_error(v, err, "no cell of %.3g degrees has the %d pixels that it needs: make 'cell_deg' larger",
                          name_of(v), v->bowl->cell_deg, BOWL_LEAST_SAMPLE);
    if (profile->n <= PROFILE_MAX_ROW) return STATUS_OK;
    bowl_pictures_error(v->i, err, "the photographs of the bowl give more than %d cells: make 'cell_deg' larger",
                        PROFILE_MAX_ROW);
    return STATUS_TOO_LARGE;
}

static status add_photograph(struct bowl_pictures *pictures, size_t i, struct fiber_profile *profile,
                             struct bowl_record *record, struct error *err)
{
    struct view v = {.bowl = pictures->bowl, .pictures = pictures, .i = i};
    struct bowl_cells cells = {0};
    status s = bowl_pictures_open(pictures, i, err);
    if (s == STATUS_OK) s = measure_means(&v, err);
    if (s == STATUS_OK) s = bowl_cells_init(&cells, v.bowl->cell_deg, err);
    if (s == STATUS_OK) {
        add_samples(&v, &cells);
        s = append_rows(&v, &cells, profile, err);
    }
    bowl_cells_release(&cells);
    if (record != NULL) record->shot[i] = v.shot;
    return s;
}

/* A cell whose samples do not scatter at all, as in a drawn picture, keeps an error above 0. */
static void bound_errors(struct fiber_profile *profile)
{
    double most = 0.0;
    for (size_t i = 0; i < profile->n; i++)
        for (size_t c = 0; c < profile->n_channel; c++) most = fmax(most, profile->row[i].radiance[c]);
    for (size_t i = 0; i < profile->n; i++)
        for (size_t c = 0; c < profile->n_channel; c++)
            profile->row[i].se[c] = fmax(profile->row[i].se[c], least_se * most);
}

status bowl_profile_load(struct fiber_profile *profile, const struct job_bowl *bowl, struct job_setup *setup,
                         struct job_rows *rows, const char *folder, struct bowl_record *record, struct error *err)
{
    struct bowl_pictures pictures;
    *profile = (struct fiber_profile){.n_channel = bowl->is_rgb ? 3 : 1, .has_se = true, .has_phi_i = true};
    if (record != NULL) *record = (struct bowl_record){.n_shot = bowl->n_photograph};
    status s = bowl_pictures_init(&pictures, bowl, setup, rows, folder, err);
    for (size_t i = 0; i < bowl->n_photograph && s == STATUS_OK; i++)
        s = add_photograph(&pictures, i, profile, record, err);
    if (record != NULL) record->camera = pictures.camera;
    bowl_pictures_release(&pictures);
    if (s == STATUS_OK)
        bound_errors(profile);
    else
        fiber_profile_release(profile);
    return s;
}

/* ---- the picture ---- */

/* Returns whether a line of the grid goes through between two angles in degrees. */
static bool crosses(double a_deg, double b_deg) { return floor(a_deg / 15.0) != floor(b_deg / 15.0); }

static void draw(const struct bowl_pictures *p, float bright, struct image *out)
{
    for (size_t k = 0; k < p->width * p->height; k++) {
        float *to = out->pixel + 3 * k;
        struct bowl_place here, left, above;
        const size_t x = k % p->width, y = k / p->width;
        const bool seen = bowl_pictures_place(p, k, &here);
        for (int c = 0; c < 3; c++) to[c] = fminf(p->photograph.pixel[3 * k + (size_t)c] / bright, 1.0f);
        if (!seen || !here.counts) {
            to[0] = 0.4f + 0.3f * to[0];
            to[1] *= 0.4f;
            to[2] *= 0.4f;
            continue;
        }
        if (x == 0 || y == 0 || !bowl_pictures_place(p, k - 1, &left) || !bowl_pictures_place(p, k - p->width, &above))
            continue;
        if (crosses(here.theta_o_rad * DEG_PER_RAD, left.theta_o_rad * DEG_PER_RAD) ||
            crosses(here.theta_o_rad * DEG_PER_RAD, above.theta_o_rad * DEG_PER_RAD))
            to[0] = 0.1f, to[1] = 0.5f, to[2] = 1.0f;
        if (crosses(here.azimuth_rad * DEG_PER_RAD, left.azimuth_rad * DEG_PER_RAD) ||
            crosses(here.azimuth_rad * DEG_PER_RAD, above.azimuth_rad * DEG_PER_RAD))
            to[0] = 1.0f, to[1] = 0.7f, to[2] = 0.1f;
    }
}

status bowl_profile_picture(const struct job_bowl *bowl, struct job_setup *setup, struct job_rows *rows,
                            const char *folder, struct image *picture, struct error *err)
{
    struct bowl_pictures p;
    *picture = (struct image){0};
    status s = bowl_pictures_init(&p, bowl, setup, rows, folder, err);
    if (s == STATUS_OK) s = bowl_pictures_open(&p, 0, err);
    if (s == STATUS_OK) s = image_init(picture, p.width, p.height, 3, err);
    if (s == STATUS_OK) {
        double sum = 0.0, n = 0.0;
        for (size_t k = 0; k < p.width * p.height; k++) {
            struct bowl_place place;
            if (!bowl_pictures_place(&p, k, &place)) continue;
            sum += (double)p.photograph.pixel[3 * k + 1];
            n += 1.0;
        }
        draw(&p, (float)(n > 0.0 && sum > 0.0 ? 2.5 * sum / n : 1.0), picture);
    }
    bowl_pictures_release(&p);
    return s;
}
