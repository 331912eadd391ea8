/* The job document: what a job is to do, as JSON text and as a struct. The daemon and the worker read and check it with
 * the same code.
 *
 * The keys, with type, unit, range, default and meaning, are the rows of optimizer/job/options (for people:
 * docs/sample-preparation.md, section 4). Unknown keys are errors, so that a misspelt option is not ignored. Errors:
 * STATUS_INVALID with err->field a key such as "photographs[3].light_theta_deg" and a text that says what is allowed.
 */
#ifndef SELVEDGE_OPTIMIZER_JOB_DOCUMENT_H
#define SELVEDGE_OPTIMIZER_JOB_DOCUMENT_H

#include "base/catalogue/correction_numbers.h"
#include "base/catalogue/model_sets.h"
#include "base/status.h"
#include "optimizer/job/job_fit_option.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

enum {
    JOB_MAX_DOCUMENT_BYTES = 1 << 20,
    JOB_MAX_PHOTOGRAPH = 1024,
    JOB_MAX_MORE_EXPOSURES = 15,
    JOB_MAX_DARK_FRAME = 256,
    JOB_MAX_VOLUME_FILE = 4096,
    JOB_MAX_NAME_BYTES = 128, /* input file names: [A-Za-z0-9._-], not starting with '.' */
    JOB_MAX_CANDIDATE = 1024,
    JOB_MAX_SURFACE_PICTURE = 32,
    JOB_MAX_MEASURED_ROW = 455, /* as many means over rotations as a table may have */
    JOB_MAX_TEXTURE_CELLS = 32, /* blocks along the edge of a crop; the renderer has the same limit */
    JOB_MAX_BOWL_MARK = 100,
    JOB_MAX_BOWL_PHOTOGRAPH = 64,
    JOB_MAX_MODEL = 32 /* more than there are models, so that a job can compare all of them */
};

/* One model to be fitted. */
struct job_model {
    char id[64];
    double fixed[JOB_MAX_PARAM], start[JOB_MAX_PARAM]; /* file units, one value for each parameter; NaN: not given */
    struct job_fit_option option;
    int first_free; /* the first parameter that neither "fixed" nor "tied" holds; -1: all are held */
};

enum job_set { JOB_SET_FIT, JOB_SET_HELD_OUT };
/* Of a measured BRDF: as its file says, or as the job says. */
enum job_symmetry { JOB_SYMMETRY_FILE, JOB_SYMMETRY_ISOTROPIC, JOB_SYMMETRY_ANISOTROPIC };
/* How integer samples of a picture stand for light. */
enum job_transfer { JOB_TRANSFER_UNDECLARED, JOB_TRANSFER_LINEAR, JOB_TRANSFER_SRGB };

/* One more exposure of the view of a photograph. */
struct job_exposure {
    char file[JOB_MAX_NAME_BYTES];
    double exposure_s; /* NaN: as the file states */
};

struct job_photograph {
    char file[JOB_MAX_NAME_BYTES];
    enum job_set set;
    double light_theta_deg, light_phi_deg, camera_theta_deg, camera_phi_deg, cloth_rotation_deg;
    double scale, weight;
    /* As given: a view of the rig (""), or places in mm from the orbit center (NaN). The angles follow from either. */
    char view[64];
    double light_position_mm[3], camera_position_mm[3];
    double light_distance_cm, camera_distance_cm; /* NaN: those of the document */
    size_t crop_px[4];                            /* all 0: whole picture */
    double crop_exact_px[4];                      /* the same before rounding, where markers gave it; or all 0 */
    enum job_transfer transfer;
    double exposure_s, iso, aperture, black_level; /* NaN: as the file states */
    size_t n_exposure;                             /* besides the first one, which is `file` */
    struct job_exposure *exposure;
};

/* A place on the bowl of a single fiber, and where the photographs show it. */
struct job_bowl_mark {
    double at_mm[3], px[2];
};

struct job_bowl_photograph {
    struct job_photograph picture;       /* members that belong to a view of the cloth are unused */
    char background[JOB_MAX_NAME_BYTES]; /* "": none */
    double theta_i_deg, phi_i_deg;
};

/* A bowl into which a single fiber scatters (option_rows_profile.c). */
struct job_bowl {
    bool given, is_rgb;
    double radius_mm, height_mm, reflectance[3], fiber_mm[3]; /* height NaN: not given; see job_check_bowl */
    double focal_px, center_px[2];                            /* NaN: not given */
    double rim_deg, fiber_mask_mm, cell_deg;
    char mask[JOB_MAX_NAME_BYTES]; /* "": none */
    size_t n_mark, n_photograph;
    struct job_bowl_mark *mark;
    struct job_bowl_photograph *photograph;
};

/* A configuration of which a photograph might be taken. */
struct job_candidate {
    double light_theta_deg, light_phi_deg, camera_theta_deg, camera_phi_deg, cloth_rotation_deg;
};

/* How a picture is rendered: path by path, by the tables of renderer/fast, by tables with some whole paths, whose
 * expectation is that of path tracing, by dual scattering (renderer/dual), or by diffusion (renderer/diffusion). */
enum job_picture_method {
    JOB_PICTURE_PATH,
    JOB_PICTURE_FAST,
    JOB_PICTURE_CORRECTED,
    JOB_PICTURE_DUAL,
    JOB_PICTURE_DIFFUSION
};

enum job_surface { JOB_ON_FLAT, JOB_ON_CYLINDER, JOB_ON_DRAPE, JOB_ON_MESH };

/* A picture of the fitted cloth laid on a surface. */
struct job_surface_picture {
    enum job_surface on;
    char mesh_file[JOB_MAX_NAME_BYTES]; /* of JOB_ON_MESH; "" otherwise */
    double mesh_unit_mm;                /* a unit of the file in millimetres */
    double radius_mm, size_mm; /* of the cylinder or the ball; of a flat or draped piece, or along the cylinder */
    double wrap_deg;           /* of the cylinder */
    int black_sheet;           /* 0, 1, or -1: as in the document */
    double light_theta_deg, light_phi_deg, camera_theta_deg, camera_phi_deg, cloth_rotation_deg;
    double lamp_sharpness; /* of a Gaussian lamp in place of the document's; NaN: the document's */
    double width_mm;       /* what the picture shows */
    size_t px, sample;
    enum job_picture_method method;
    bool reference;                      /* also path by path, and compared with that */
    bool filter;                         /* also filtered for the eye (renderer/preview) */
    bool visibility_by_tables;           /* of JOB_PICTURE_FAST */
    bool deep_by_cells;                  /* of JOB_PICTURE_FAST; with visibility_by_tables in any case */
    size_t n_deep_path;                  /* that make the table in place of the cells */
    bool speckle;                        /* of single fibers (renderer/scattering/speckle) */
    bool field_by_pixel;                 /* near fields become far fields where pixels are as wide as fibers */
    double ground_gap_mm, ground_albedo; /* of a plane under the cloth; gap NaN: none */
};

/* What a kind of yarn in the document counts or names; 0 fibers: not given. */
struct job_cloth_yarn {
    size_t n_fiber, n_ply, melange_with;
    char name[MODEL_SET_NAME_BYTES]; /* "": none */
};

struct job_fault_list;

/* A configuration that is taken from a file of a measured BRDF. */
struct job_measured_row {
    enum job_set set;
    double light_theta_deg, light_phi_deg, camera_theta_deg, camera_phi_deg, cloth_rotation_deg;
};

struct job_document {
    struct job_fault_list *fault; /* all faults go there while the document is read; NULL: reading ends at the first */
    char sample[256];
    /* volume */
    bool has_volume;
    size_t n_volume_file;
    char (*volume_file)[JOB_MAX_NAME_BYTES];
    size_t raw_shape[3]; /* all 0: not given */
    char raw_type[8];
    bool raw_big_endian;
    size_t raw_header_bytes;
    double voxel_size_um[3]; /* NaN: not given */
    char axes[8];
    double matrix[9];
    size_t crop_voxel[6];
    bool align, crop; /* true for "auto"; false where matrix or crop_voxel is given */
    double crop_keep; /* NaN: not given */
    bool join_seams, unresolved_fibers, trial;
    int hollow_fibers;           /* 0, 1, or -1: decided from the scan */
    double fiber_diameter_voxel; /* NaN: measured */
    double density_low, density_high, filter_s, filter_t, filter_eps_d, filter_eps_j; /* NaN: not given */
    size_t filter_h;                                                                  /* 0: not given */
    double link_sigma_voxel, radius_um;                                               /* NaN: not given */
    size_t min_vertex;
    int radius_per_axis;   /* 1: one radius for each axis class, 0: one for all, -1: the measurement decides */
    char geometry_job[64]; /* geometry: id of another job; "" when none is given */
    /* fibers */
    char fiber_file[JOB_MAX_NAME_BYTES];
    double tile_mm[2]; /* NaN: from the file */
    double voxel_um;   /* NaN: chosen from the radius */
    /* cloth, as given; `cloth` is the checked description, NULL without the section */
    char cloth_weave[16];
    char cloth_texture[JOB_MAX_NAME_BYTES]; /* photograph that shows the weave; "" when none is given */
    double cloth_texture_px_per_mm;         /* NaN: not given */
    bool cloth_texture_colors;              /* start C_TT of the kinds at the colors of the photograph */
    bool cloth_draft_from_texture;          /* neither weave nor draft is given */
    size_t cloth_tile_yarn[2];              /* of enum cloth_direction; 0: not given */
    size_t cloth_final_tiles;               /* times that the tile of the final fit is as long along both edges */
    bool cloth_renew_places;                /* other random places in each estimate of the joint fit */
    double cloth_threads_per_cm[2];         /* NaN: not given */
    uint64_t cloth_seed;
    size_t n_cloth_yarn;
    struct job_cloth_yarn *cloth_yarn;
    struct cloth_description *cloth;
    bool has_correction;
    struct cloth_number correction[CORRECTION_N]; /* of scanned or given fibers; set with has_correction */
    /* The groups of fibers that have scattering parameters of their own; 0: one set of parameters for all fibers. */
    size_t n_group;
    char group[MODEL_MAX_SET][MODEL_SET_NAME_BYTES];
    /* set-up */
    double lamp_side_cm, lamp_distance_cm, camera_distance_cm, crop_cm, camera_blur_mm;
    bool lamp_directional, camera_far_field;
    char rig_file[JOB_MAX_NAME_BYTES];   /* "" when none is given */
    char noise_file[JOB_MAX_NAME_BYTES]; /* record of the camera's noise; "" when none is given */
    size_t n_dark_frame;
    char (*dark_frame)[JOB_MAX_NAME_BYTES];
    /* From the camera's colors to radiances: by a photographed ColorChecker or by a white reference. Members of these
     * photographs that belong to a view of the cloth are unused. */
    bool has_color, has_chart, has_white;
    struct job_photograph chart, white;
    double chart_corner_px[8]; /* NaN: found in the picture */
    bool chart_from_2014;      /* made in November 2014 or later */
    double white_reflectance[3];
    double environment_rgb[3];
    char environment_file[JOB_MAX_NAME_BYTES]; /* "" when none is given */
    double environment_scale;
    bool black_sheet;
    /* observations */
    char measurement_file[JOB_MAX_NAME_BYTES]; /* "" when photographs are given */
    char profile_file[JOB_MAX_NAME_BYTES];     /* of a single fiber; "" for a job with a cloth */
    double profile_theta_i_deg, profile_scale; /* NaN: a column of the profile; fitted */
    struct job_bowl bowl;                      /* in place of profile_file */
    size_t n_measured_row;                     /* 0: the default ones; of files of measured BRDFs */
    struct job_measured_row *measured_row;
    enum job_symmetry measurement_symmetry;
    size_t n_photograph;
    struct job_photograph *photograph;
    /* fit */
    size_t n_model;
    struct job_model model[JOB_MAX_MODEL];
    char method[64];
    uint64_t seed;
    size_t max_iteration; /* 0: the method's default */
    uint64_t path_budget; /* 0: the method's default */
    double precision;     /* noise of tracing over the photographs' errors at which the fit ends; 0: none */
    char profile_job[64]; /* id of a job with a profile, whose results are priors; "" when none is given */
    bool share_camera_paths;
    double plain_prior; /* strength; 0: none */
    bool discrepancy;
    /* The density multiplier is the last parameter of a volume model. Its entries in job_model.fixed and
     * job_model.start follow from the next two members. */
    double density_multiplier_per_cm; /* NaN: the model's default */
    bool fit_density;
    bool fit_radius;
    double radius_lower_um, radius_upper_um; /* NaN: from the cloth */
    double texture_block_mm, texture_weight; /* texture_block_mm 0: no texture */
    size_t n_candidate;                      /* for the next photograph; 0: none are ranked */
    bool candidate_grid;                     /* true: the candidates are the built-in ones */
    struct job_candidate *candidate;
    size_t render_px, render_sample; /* 0: chosen from the paths of the fit */
    size_t n_surface_picture;
    struct job_surface_picture *surface_picture;
    bool twin; /* tables for the page in the browser */
    size_t twin_paths, twin_texels;
    bool export_mitsuba, export_pbrt, export_usd, export_blender, export_textures, export_pdf;
};

/* Parses and checks n_bytes of text, which need not be NUL-terminated. On success the caller frees *doc with
 * job_document_free. */
status job_document_parse(const char *text, size_t n_bytes, struct job_document **doc, struct error *err);
/* The same from parsed JSON. */
status job_document_read(const json_t *json, struct job_document **doc, struct error *err);
void job_document_free(struct job_document *doc);
/* Whether the job has photographs or a table of measurements, so that there is something to fit. */
bool job_document_has_rows(const struct job_document *doc);
/* Whether a job without rows ends with the geometry of its scan, or renders pictures of its cloth with the parameters
 * that the document holds fixed. */
bool job_document_geometry_only(const struct job_document *doc);
/* Whether the job fits models to the profile of a single fiber; it then has no cloth. */
bool job_document_of_profile(const struct job_document *doc);
/* The file that messages name the profile by: its table, or the first photograph of the bowl. */
const char *job_document_profile_name(const struct job_document *doc);
bool job_document_pictures_only(const struct job_document *doc);

/* Puts the section "cloth" before the field that a check or the builder of a described cloth named, in the error's text
 * too. */
void job_cloth_name_field(struct error *err);

/* STATUS_INVALID, field "final_tiles" or "renew_places", where the described cloth has no fitted numbers, or its tile
 * cannot be made as large as the document asks for. */
status job_cloth_check_final_tiles(const struct job_document *doc, struct error *err);

struct param_info;
/* Bounds, start and fixed flag of each parameter of a model, with ties, bounds and priors taken into account. out has
 * n_param elements; all of them may be fixed. Returns STATUS_INVALID with the field at fault when they contradict each
 * other. */
status job_fit_resolve(const struct param_info *info, size_t n_param, const struct job_model *given,
                       struct job_fit_parameter *out, struct error *err);

/* Number of blocks along the edge of the crop whose means are compared. Needs texture_block_mm > 0. */
size_t job_texture_cells(const struct job_document *doc);
/* Edge of these blocks in mm. It is near to texture_block_mm, which need not divide the crop. */
double job_texture_cell_mm(const struct job_document *doc);

/* Calls visit for every input file that the document names, with its role ("volume", "fibers", "environment",
 * "measurements", "photograph", "camera_noise", "dark_frame", "chart", "white_reference", "mesh", "profile"). */
void job_document_visit_files(const struct job_document *doc,
                              void (*visit)(void *context, const char *name, const char *role), void *context);
/* Writes the key that names an input file, as "photographs[2].file": the last one where several do, "" where none. */
void job_document_file_key(const struct job_document *doc, const char *name, char *key, size_t n_key);
/* Sets and returns the error of a job that fits the density although no fitted row is lit from behind. */
status job_density_undetermined(bool black_sheet, struct error *err);
/* Returns STATUS_INVALID with the key `path` when job_file_name_valid is false. */
status job_check_file_name(const char *path, const char *name, struct error *err);
/* Angles and distance of a place in mm from the orbit center: x along the weft, y along the warp, z up. */
void job_angles_of_position(const double position_mm[3], double *theta_deg, double *phi_deg, double *distance_cm);
/* True for [A-Za-z0-9._-]+, 1..127 bytes, not starting with '.'. */
bool job_file_name_valid(const char *name);
/* Makes a valid file name of any text: other characters become '_', and it is cut to 127 bytes. */
void job_file_name_make_valid(const char *text, char name[JOB_MAX_NAME_BYTES]);

#endif
