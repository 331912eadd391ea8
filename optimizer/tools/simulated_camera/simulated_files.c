#include "optimizer/tools/simulated_camera/simulated_files.h"

#include "optimizer/tools/simulated_camera/phantom_files.h"

#include <stdio.h>
#include <string.h>

static int stem_length(const char *file)
{
    const char *dot = strrchr(file, '.');
    return dot != NULL ? (int)(dot - file) : (int)strlen(file);
}

void simulated_raw_name(const char *file, size_t i, char name[SIMULATED_NAME_BYTES])
{
    snprintf(name, SIMULATED_NAME_BYTES, "%.*s-%zu.dng", stem_length(file), file, i);
}

/* Adds a lamp or camera of these angles to `list` once; its name, such as "lamp 20 180". */
static const char *add_place(json_t *list, const char *kind, const json_t *theta, const json_t *phi,
                             char name[SIMULATED_NAME_BYTES])
{
    snprintf(name, SIMULATED_NAME_BYTES, "%s %g %g", kind, json_number_value(theta), json_number_value(phi));
    json_object_set_new(
        list, name, json_pack("{s:f, s:f}", "theta_deg", json_number_value(theta), "phi_deg", json_number_value(phi)));
    return name;
}

static json_t *lens_json(const struct lens *l)
{
    return json_pack("{s:{s:[f,f],s:f,s:[f,f,f]},s:{s:[f,f],s:[f,f],s:[f,f,f],s:[f,f]}}", "vignetting", "center_px",
                     l->vignetting_center_px[0], l->vignetting_center_px[1], "radius_px", l->vignetting_radius_px, "a",
                     l->vignetting[0], l->vignetting[1], l->vignetting[2], "distortion", "focal_px", l->focal_px[0],
                     l->focal_px[1], "center_px", l->center_px[0], l->center_px[1], "k", l->k[0], l->k[1], l->k[2], "p",
                     l->p[0], l->p[1]);
}

static json_t *markers_json(const struct marker_board *b)
{
    json_t *center = json_object();
    for (size_t m = 0; m < b->n; m++) {
        char id[16];
        snprintf(id, sizeof id, "%d", b->id[m]);
        json_object_set_new(center, id, json_pack("[f,f]", b->center_mm[m][0], b->center_mm[m][1]));
    }
    return json_pack("{s:s, s:f, s:o}", "dictionary", b->dictionary, "side_mm", b->side_mm, "center_mm", center);
}

static json_t *rig_json(const struct simulated_camera_option *o, const struct lens *lens,
                        const struct marker_board *board, const json_t *view)
{
    json_t *lamps = json_object(), *cameras = json_object(), *views = json_object();
    const json_t *row;
    size_t i;
    json_array_foreach(view, i, row)
    {
        const char *file = json_string_value(json_object_get(row, "file"));
        char name[SIMULATED_NAME_BYTES];
        json_t *own = json_object();
        json_object_set_new(own, "lamp",
                            json_string(add_place(lamps, "lamp", json_object_get(row, "light_theta_deg"),
                                                  json_object_get(row, "light_phi_deg"), name)));
        if (!o->cameras_from_markers)
            json_object_set_new(own, "camera",
                                json_string(add_place(cameras, "camera", json_object_get(row, "camera_theta_deg"),
                                                      json_object_get(row, "camera_phi_deg"), name)));
        json_object_set(own, "cloth_rotation_deg", json_object_get(row, "cloth_rotation_deg"));
        json_object_set_new(views, (snprintf(name, sizeof name, "%.*s", stem_length(file), file), name), own);
    }
    json_t *rig = json_pack("{s:i, s:o, s:o, s:o, s:o}", "selvedge_rig", 1, "lamps", lamps, "views", views, "lens",
                            lens_json(lens), "markers", markers_json(board));
    if (o->cameras_from_markers)
        json_decref(cameras);
    else
        json_object_set_new(rig, "cameras", cameras);
    return rig;
}

/* A row of "photographs": the first exposure, and the others. */
static json_t *photograph_json(const json_t *row)
{
    const char *file = json_string_value(json_object_get(row, "file"));
    char name[SIMULATED_NAME_BYTES], view[SIMULATED_NAME_BYTES];
    json_t *more = json_array();
    for (size_t k = 1; k < SIMULATED_EXPOSURES; k++) {
        simulated_raw_name(file, k, name);
        json_array_append_new(more, json_pack("{s:s}", "file", name));
    }
    simulated_raw_name(file, 0, name);
    snprintf(view, sizeof view, "%.*s", stem_length(file), file);
    return json_pack("{s:s, s:o, s:O, s:s}", "file", name, "more_exposures", more, "set", json_object_get(row, "set"),
                     "view", view);
}

static json_t *job_json(const struct simulated_camera_option *o, const json_t *view, const json_t *truth)
{
    const json_t *lamp = json_object_get(truth, "lamp"), *camera = json_object_get(truth, "camera"), *row;
    json_t *photographs = json_array();
    size_t i;
    json_array_foreach(view, i, row) json_array_append_new(photographs, photograph_json(row));
    return json_pack("{s:{s:s}, s:{s:O, s:O}, s:{s:O, s:f, s:s}, s:{s:{s:s, s:f}}, s:o}", "rig", "file", "rig.json",
                     "lamp", "distance_cm", json_object_get(lamp, "distance_cm"), "side_cm",
                     json_object_get(lamp, "side_cm"), "camera", "distance_cm", json_object_get(camera, "distance_cm"),
                     "crop_cm", o->crop_cm, "noise_file", "noise.json", "color", "chart", "file", "chart.dng",
                     "light_theta_deg", o->chart_light_theta_deg, "photographs", photographs);
}

status simulated_files_write(const struct simulated_camera_option *o, const struct lens *lens,
                             const struct marker_board *board, const json_t *view, const json_t *truth,
                             struct error *err)
{
    json_t *rig = rig_json(o, lens, board, view), *job = job_json(o, view, truth);
    status st = rig != NULL && job != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "out of memory");
    if (st == STATUS_OK) st = phantom_json_write(rig, o->folder, "rig.json", err);
    if (st == STATUS_OK) st = phantom_json_write(job, o->folder, "camera-job.json", err);
    if (st == STATUS_OK) st = phantom_json_write(truth, o->folder, "truth.json", err);
    json_decref(rig);
    json_decref(job);
    return st;
}
