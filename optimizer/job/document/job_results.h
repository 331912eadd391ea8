/* The sections of a job document that say which results are wanted besides the fit: renderings, pictures of the
 * cloth on surfaces, a twin for the browser, and files for other programs. */
#ifndef SELVEDGE_OPTIMIZER_JOB_RESULTS_H
#define SELVEDGE_OPTIMIZER_JOB_RESULTS_H

#include "optimizer/job/document/job_limits.h"

#include <stdbool.h>
#include <stddef.h>

enum { JOB_MAX_SURFACE_PICTURE = 32, JOB_MAX_PREVIEW_PX = 2048, JOB_MAX_EXPORT = 16 };

/* How a picture is rendered: JOB_PICTURE_PATH and so forth, a value for each row of picture_methods.def. */
enum job_picture_method {
#define PICTURE_METHOD(id, ...) JOB_PICTURE_##id,
#include "base/catalogue/picture_methods.def"
};

enum job_surface {
    JOB_ON_FLAT,
    JOB_ON_CYLINDER,
    JOB_ON_DRAPE,
    JOB_ON_MESH,
    JOB_ON_ROLL, /* of studio pictures only, and the next */
    JOB_ON_FOLD
};

/* The set-up of a picture: as of a measurement, or a view of the studio (checks/picture_kinds.c). */
enum job_picture_kind {
    JOB_KIND_MEASUREMENT,
    JOB_KIND_SWATCH,
    JOB_KIND_ROLL,
    JOB_KIND_DRAPE,
    JOB_KIND_FOLD,
    JOB_KIND_CLOSE_UP,
    JOB_KIND_FAR,
    JOB_KIND_LIT_THROUGH
};

/* Its word in job documents. */
const char *job_picture_kind_name(enum job_picture_kind kind);

struct job_surface_picture;
/* A picture of the studio with the settings that a document leaves out. */
void job_picture_studio(enum job_picture_kind kind, struct job_surface_picture *p);

/* A picture of the fitted cloth laid on a surface. */
struct job_surface_picture {
    const char *name; /* of its files, pictures/<name>.png; NULL: on-<number> */
    bool is_draft;    /* a better one will replace it */
    enum job_picture_kind kind;
    enum job_surface on;
    char mesh_file[JOB_MAX_NAME_BYTES]; /* of JOB_ON_MESH; "" otherwise */
    double mesh_unit_mm;                /* a unit of the file in millimetres */
    double radius_mm, size_mm; /* of the cylinder or the ball; of a flat or draped piece, or along the cylinder */
    double wrap_deg;           /* of the cylinder */
    int black_sheet;           /* 0, 1, or -1: as in the document */
    double light_theta_deg, light_phi_deg, camera_theta_deg, camera_phi_deg, cloth_rotation_deg;
    double lamp_sharpness; /* of a Gaussian lamp in place of the document's; NaN: the document's */
    double width_mm;       /* width of the area in the picture */
    double aperture_mm;    /* diameter of the camera's lens; 0: a pinhole */
    double focus_mm;       /* distance of the lens from what is sharp; NaN: the orbit center is */
    int preview_filter;    /* of JOB_PICTURE_SHEARED: enum ray_filter_way */
    size_t px, sample;
    enum job_picture_method method;
    bool reference;                      /* also path by path, and compared with that */
    bool filter;                         /* also filtered for the eye (renderer/preview) */
    bool visibility_by_tables;           /* of JOB_PICTURE_FAST */
    bool deep_by_cells;                  /* of JOB_PICTURE_FAST; with visibility_by_tables in any case */
    size_t cell_order;                   /* of the harmonics of cells */
    double cell_free_paths;              /* edge of a cell over the mean free path */
    size_t n_deep_path;                  /* that make the table in place of the cells */
    bool speckle;                        /* of single fibers (renderer/scattering/speckle.h) */
    bool field_by_pixel;                 /* near fields become far fields where pixels are as wide as fibers */
    double ground_gap_mm, ground_albedo; /* of a plane under the cloth; gap NaN: none */
};

struct job_results {
    size_t render_px, render_sample; /* 0: chosen from the paths of the fit */
    bool no_pictures;                /* "pictures": "none": nothing is made after the result */
    size_t n_surface_picture;
    struct job_surface_picture *surface_picture;
    bool twin; /* tables for the page in the browser */
    size_t twin_paths, twin_texels;
    bool exported[JOB_MAX_EXPORT]; /* in the order of the rows EXPORT */
    double texture_cm;             /* edge of exported textures, of which a whole number of tiles is nearest */
    size_t texture_px;             /* most pixels of their longer side */
    bool export_pdf;
    char report_file[JOB_MAX_NAME_BYTES]; /* report.html of another job, in place of the job's own; "": none */
};

#endif
