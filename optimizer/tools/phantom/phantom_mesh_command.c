/* The command "mesh". */
#include "base/angle.h"
#include "base/files/durable.h"
#include "optimizer/tools/phantom/phantom_commands.h"
#include "renderer/mesh/mesh_drape.h"
#include "renderer/mesh/mesh_shapes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage[] =
    "selvedge-phantom mesh --on SHAPE --out FILE.obj [options]\n"
    "\n"
    "Writes a surface that pictures show the cloth on (docs/bent-cloth.md) as Wavefront OBJ, in millimetres, with the\n"
    "places of the cloth as texture coordinates.\n"
    "\n"
    "  --on SHAPE         flat, cylinder or drape: a square piece that has fallen over a ball (five seconds)\n"
    "  --size-mm MM       edge of the piece, or length of the cylinder                [40]\n"
    "  --radius-mm MM     radius of the cylinder or of the ball                       [15]\n"
    "  --wrap-deg ANGLE   how far around the cylinder the cloth goes                  [180]\n"
    "\n"
    "Exit codes: 0 done, 1 failed, 2 wrong arguments.\n";

enum { CELLS_AROUND = 720 };

struct mesh_option {
    const char *on, *out;
    double size_mm, radius_mm, wrap_deg;
};

static status parse(int argc, char **argv, struct mesh_option *o, struct error *err)
{
    *o = (struct mesh_option){.size_mm = 40.0, .radius_mm = 15.0, .wrap_deg = 180.0};
    const struct command_option option[] = {
        {.name = "on", .kind = OPTION_TEXT, .to = &o->on},
        {.name = "out", .kind = OPTION_TEXT, .to = &o->out},
        {.name = "size-mm", .kind = OPTION_NUMBER, .to = &o->size_mm},
        {.name = "radius-mm", .kind = OPTION_NUMBER, .to = &o->radius_mm},
        {.name = "wrap-deg", .kind = OPTION_NUMBER, .to = &o->wrap_deg},
    };
    status s = command_options_parse(argc, argv, option, sizeof option / sizeof *option, err);
    if (s != STATUS_OK) return s;
    if (o->on == NULL || o->out == NULL) return error_set(err, STATUS_INVALID, "--on and --out are needed");
    if (strcmp(o->on, "flat") != 0 && strcmp(o->on, "cylinder") != 0 && strcmp(o->on, "drape") != 0)
        return error_set(err, STATUS_INVALID, "--on takes flat, cylinder or drape: '%s'", o->on);
    if (!(o->wrap_deg >= 1.0 && o->wrap_deg <= 360.0))
        return error_set(err, STATUS_INVALID, "--wrap-deg is %g: allowed are 1 to 360", o->wrap_deg);
    return STATUS_OK;
}

static status make(const struct mesh_option *o, struct mesh *m, struct error *err)
{
    const double degrees_around = 360.0;
    if (strcmp(o->on, "flat") == 0)
        return mesh_flat((const double[2]){o->size_mm, o->size_mm}, (const size_t[2]){1, 1}, m, err);
    if (strcmp(o->on, "drape") == 0) return mesh_drape(o->size_mm, o->radius_mm, NULL, m, err);
    return mesh_cylinder(o->radius_mm, o->size_mm, 0.5 * o->wrap_deg * RAD_PER_DEG,
                         (size_t)ceil(CELLS_AROUND * o->wrap_deg / degrees_around), m, err);
}

int phantom_command_mesh(int argc, char **argv)
{
    struct mesh_option o;
    struct mesh m = {0};
    struct error err = {0};
    char *text = NULL;
    size_t n_bytes = 0;
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "--help") == 0) {
            fputs(usage, stdout);
            return 0;
        }
    if (parse(argc, argv, &o, &err) != STATUS_OK) {
        fprintf(stderr, "selvedge-phantom mesh: %s\n", err.text);
        return 2;
    }
    status s = make(&o, &m, &err);
    if (s == STATUS_OK) s = mesh_obj_text(&m, &text, &n_bytes, &err);
    if (s == STATUS_OK) s = durable_replace(o.out, text, n_bytes, &err);
    if (s == STATUS_OK)
        printf("%zu points, %zu triangles\n", m.n_position, m.n_triangle);
    else
        fprintf(stderr, "selvedge-phantom mesh: %s\n", err.text);
    free(text);
    mesh_release(&m);
    return s == STATUS_OK ? 0 : 1;
}
