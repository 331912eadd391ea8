/* Rows of the option table: pictures of the fitted cloth on a surface. */
#include "base/catalogue/picture_method.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/options/option_rows.h"

#define OF_PICTURE(member) INTO_OF(struct job_surface_picture, member)

static const char *const surface_names[] = {"flat", "cylinder", "drape", "mesh", NULL};
/* In the order of enum job_picture_kind. */
static const char *const kind_names[] = {"measurement", "swatch", "roll",        "drape", "fold",
                                         "close_up",    "far",    "lit_through", NULL};
static const char of_measurement[] = "required of `kind` `measurement`, refused of others";
static const char *const deep_light_names[] = {"directions", "cells", NULL};
/* In the order of enum ray_filter_way. */
static const char *const preview_filter_names[] = {"passes", "whole", "axes", "none", NULL};
static const char *const visibility_names[] = {"traced", "tables", NULL};
/* " `path`: every path is traced. `fast`: ...", with a blank in front. */
static const char method_meaning[] =
#define PICTURE_METHOD(id, name, of_flat_cloth, meaning) " `" name "`: " meaning
#include "base/catalogue/picture_methods.def"
    ;

const struct job_option option_rows_pictures[] = {
    {.path = "pictures",
     .kind = OPTION_LIST,
     LIST_INTO(results, surface_picture, n_surface_picture),
     .upper = JOB_MAX_SURFACE_PICTURE,
     .check = job_check_pictures,
     .or_word = "none",
     .word_at = offsetof(struct job_results, no_pictures),
     .left_out = "a draped picture and the twin after the result",
     .allowed = "1..32, or `none`",
     .items = "pictures",
     .meaning =
         "Pictures of the fitted cloth laid on a surface (docs/bent-cloth.md), in the folder `pictures` of the "
         "results, by the best model. Without `photographs` and `measurements` nothing is fitted: they show "
         "`fit.model` with `fit.fixed`, which then names every parameter. `none`: also without pictures/hero.png and "
         "the twin, which the service makes after a result."},
    {.path = "pictures[].kind",
     .kind = OPTION_CHOICE,
     OF_PICTURE(kind),
     .choice = kind_names,
     .standard = "\"measurement\"",
     .meaning =
         "`measurement`: lamp, camera and surface are given by the keys below, on black. The others are pictures for "
         "the eye in a studio (docs/bent-cloth.md), which take `px`, `samples`, `method`, `deep_light_paths`, "
         "`cloth_rotation_deg` and `reference` only: a flat `swatch` of 40 mm with a scale bar, a `roll`, a `drape` "
         "over a ball, a hung piece in folds (`fold`), a `close_up` of 2 mm, a drape of 30 cm from `far`, and 8 mm "
         "on a light table (`lit_through`)."},
    {.path = "pictures[].on",
     .kind = OPTION_CHOICE,
     OF_PICTURE(on),
     .choice = surface_names,
     .left_out = of_measurement,
     .meaning =
         "A flat piece, a cylinder with the weft around it, a square piece that has fallen over a ball, or a mesh of "
         "your own."},
    {.path = "pictures[].mesh_file",
     .kind = OPTION_FILE_NAME,
     TEXT_INTO_OF(struct job_surface_picture, mesh_file),
     .id = OPTION_MESH_FILE,
     .left_out = "none",
     .allowed = ".obj",
     .meaning = "The mesh as Wavefront OBJ with texture coordinates, which say where the cloth lies. Its origin is the "
                "orbit center that lamp and camera are directed at, z is up."},
    {.path = "pictures[].mesh_unit_mm",
     .kind = OPTION_NUMBER,
     OF_PICTURE(mesh_unit_mm),
     RANGE(1e-6, 1e6),
     .unit = "mm",
     .standard = "1",
     .meaning = "Length of a unit of the file, for positions and texture coordinates."},
    {.path = "pictures[].radius_mm",
     .kind = OPTION_NUMBER,
     OF_PICTURE(radius_mm),
     .id = OPTION_PICTURE_RADIUS,
     RANGE(0.1, 10000),
     .unit = "mm",
     .standard = "15",
     .meaning = "Radius of the cylinder, whose highest line goes through the orbit center, or of the ball under the "
                "draped piece (0.02 to 10 times its size)."},
    {.path = "pictures[].wrap_deg",
     .kind = OPTION_NUMBER,
     OF_PICTURE(wrap_deg),
     RANGE(1, 360),
     .unit = "degrees",
     .standard = "180",
     .meaning = "How far around the cylinder the cloth goes, one half of it to each side of the highest line."},
    {.path = "pictures[].size_mm",
     .kind = OPTION_NUMBER,
     OF_PICTURE(size_mm),
     RANGE(0.1, 10000),
     .unit = "mm",
     .standard = "40",
     .meaning = "Edge of the flat or draped piece, or length of the cylinder."},
    {.path = "pictures[].black_sheet",
     .kind = OPTION_BOOL_OR_LEFT_OUT,
     OF_PICTURE(black_sheet),
     .left_out = "`black_sheet` of the job",
     .meaning =
         "Whether a black sheet lies under all of the cloth, bent as it is: without it light comes through. With "
         "`method` `fast` and `diffusion` it is that of the job."},
    ANGLE("pictures[]", struct job_surface_picture, light_theta_deg, 0, 180, .left_out = of_measurement,
          .allowed = "0 to 180; for a flat piece not 90, and above it only without the black sheet",
          .meaning = "Angle of the lamp from the vertical. Above 90 the lamp is below."),
    OTHER_ANGLES("pictures[]", struct job_surface_picture, .left_out = of_measurement),
    {.path = "pictures[].lamp_sharpness",
     .kind = OPTION_NUMBER,
     OF_PICTURE(lamp_sharpness),
     RANGE(1, 100000),
     .left_out = "`lamp` of the job",
     .meaning = "A spherical Gaussian in place of the job's lamp: light from infinitely far that falls off as "
                "exp(sharpness (cos - 1)), with a half width of 67 degrees over its root: 10 is soft, 200 like a lamp "
                "of 10 cm at 61 cm."},
    {.path = "pictures[].width_mm",
     .kind = OPTION_NUMBER,
     OF_PICTURE(width_mm),
     RANGE(0.01, 10000),
     .unit = "mm",
     .standard = "40",
     .meaning = "Width and height of what the picture shows, at the orbit center."},
    {.path = "pictures[].aperture_mm",
     .kind = OPTION_NUMBER,
     OF_PICTURE(aperture_mm),
     RANGE(0, 1000),
     .unit = "mm",
     .standard = "0",
     .meaning =
         "Diameter of the camera's lens, which blurs what is out of focus. Not with `camera.far_field`, `filter` or "
         "a ground."},
    {.path = "pictures[].focus_mm",
     .kind = OPTION_NUMBER,
     OF_PICTURE(focus_mm),
     RANGE(1, 100000),
     .unit = "mm",
     .left_out = "to the orbit center",
     .meaning = "Distance of the lens from the sharp plane."},
    {.path = "pictures[].px",
     .kind = OPTION_COUNT,
     OF_PICTURE(px),
     RANGE(8, 4096),
     .unit = "pixels",
     .left_out = "512, in the studio 1024",
     .meaning = "Width and height of the picture."},
    {.path = "pictures[].samples",
     .kind = OPTION_COUNT,
     OF_PICTURE(sample),
     RANGE(1, 65536),
     .unit = "per pixel",
     .standard = "16",
     .meaning = "Samples of a pixel. The result states the noise that they leave."},
    {.path = "pictures[].method",
     .kind = OPTION_CHOICE,
     OF_PICTURE(method),
     .id = OPTION_PICTURE_METHOD,
     .choice = picture_method_name,
     .removed_word = "corrected",
     .removed_why = "was removed, because it gained nothing over path tracing: take \"path\" or \"fast\"",
     .left_out = "`path`, in the studio `fast`",
     .meaning = method_meaning + 1},
    {.path = "pictures[].visibility",
     .kind = OPTION_SWITCH,
     OF_PICTURE(visibility_by_tables),
     .choice = visibility_names,
     .standard = "\"traced\"",
     .meaning =
         "Of method `fast`: whether a ray is traced to see if a fiber has the light, or tables of what each segment "
         "sees say so, as published (fabric thesis, section 6.4.1), with one hit of a path, and take several times as "
         "long to make."},
    {.path = "pictures[].deep_light",
     .kind = OPTION_SWITCH,
     OF_PICTURE(deep_by_cells),
     .choice = deep_light_names,
     .standard = "\"directions\"",
     .meaning =
         "Of method `fast`: the source of light that is scattered more than three times. `directions`: a table of view "
         "and light for threads along the weft and along the warp that rise, lie level and fall, as means over the "
         "repeat. `cells`: a table of the place of the third hit, in spherical harmonics, which is made faster; with "
         "`visibility` `tables` always."},
    {.path = "pictures[].cell_order",
     .kind = OPTION_COUNT,
     OF_PICTURE(cell_order),
     RANGE(1, 6),
     .standard = "4",
     .meaning = "Of light from cells: order of their harmonics, the same in all such pictures."},
    {.path = "pictures[].cell_paths",
     .kind = OPTION_NUMBER,
     OF_PICTURE(cell_free_paths),
     RANGE(0.25, 16),
     .unit = "mean free paths",
     .standard = "2",
     .meaning = "Edge of these cells. As `cell_order`."},
    {.path = "pictures[].deep_light_paths",
     .kind = OPTION_COUNT,
     OF_PICTURE(n_deep_path),
     RANGE(1000, 1000000000),
     .unit = "paths",
     .standard = "8000000",
     .meaning =
         "Of `deep_light` `directions`: paths that make its table, in 10 to 20 microseconds of a processor each. "
         "The largest number of all pictures counts. Refused in pictures that have no such table."},
    {.path = "pictures[].preview_filter",
     .kind = OPTION_CHOICE,
     OF_PICTURE(preview_filter),
     .choice = preview_filter_names,
     .standard = "\"passes\"",
     .meaning =
         "Of method `sheared`, whose `samples` are 1, 4, 9 up to 64: four `passes`; for comparison one `whole` sum, "
         "means along `axes`, or `none`."},
    {.path = "pictures[].speckle",
     .kind = OPTION_BOOL,
     OF_PICTURE(speckle),
     .standard = "false",
     .meaning = "Whether each fiber has a random pattern of bright and dark directions, with the mean 1 and the seed "
                "`fit.seed`. Needs method `path` and a model of waves (docs/bent-cloth.md)."},
    {.path = "pictures[].field_by_pixel",
     .kind = OPTION_BOOL,
     OF_PICTURE(field_by_pixel),
     .standard = "false",
     .meaning = "Of `fur_near.v1` and `dielectric_near.v1`: whether the far field is taken where a pixel is at least "
                "as wide as a fiber, with less noise and another mean in dense cloths (docs/bent-cloth.md). Refused "
                "without such a model."},
    {.path = "pictures[].reference",
     .kind = OPTION_BOOL,
     OF_PICTURE(reference),
     .standard = "false",
     .meaning =
         "Whether the picture is also rendered path by path, with as many samples. The result states how far the "
         "two are apart. Needs a `method` other than `path`."},
    {.path = "pictures[].ground_gap_mm",
     .kind = OPTION_NUMBER,
     OF_PICTURE(ground_gap_mm),
     RANGE(0, 1000),
     .unit = "mm",
     .left_out = "no ground",
     .meaning = "Puts a matte, level plane so far below the lowest point of the cloth, with its shadow. The lamp alone "
                "lights it, from above; it gives no light to the cloth, and the job has no `environment`."},
    {.path = "pictures[].ground_albedo",
     .kind = OPTION_NUMBER,
     OF_PICTURE(ground_albedo),
     RANGE(0, 1),
     .standard = "0.5",
     .meaning = "Share of the light that this plane reflects, the same in red, green and blue."},
    {.path = "pictures[].filter",
     .kind = OPTION_BOOL,
     OF_PICTURE(filter),
     .standard = "false",
     .meaning = "Whether a filtered view with less noise is made beside the picture, for the eye; the picture, its "
                "numbers and its OpenEXR file stay as rendered."},
    {.path = "twin",
     .kind = OPTION_SECTION,
     .left_out = "none",
     .meaning =
         "Tables of the best model's appearance, a surface model's, from which the browser shows the cloth while "
         "it is turned, bent and lit with the mouse (docs/bent-cloth.md)."},
    {.path = "twin.make",
     .kind = OPTION_BOOL,
     INTO(results, twin),
     .check = job_check_twin,
     .standard = "false",
     .meaning = "Whether to make them. Needs `photographs`, `measurements` or `pictures`."},
    {.path = "twin.paths",
     .kind = OPTION_COUNT,
     INTO(results, twin_paths),
     RANGE(1000, 1e9),
     .standard = "1200000",
     .meaning =
         "Camera paths of the tables, each with sixteen lamps. As many as by default take one to three minutes of "
         "one processor, and four times as many halve the noise."},
    {.path = "twin.texels",
     .kind = OPTION_COUNT,
     INTO(results, twin_texels),
     RANGE(16, 65536),
     .standard = "4096",
     .meaning = "About so many places of the tile are told apart."},
    {.path = NULL},
};
