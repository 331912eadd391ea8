/* results/export/blender/: the fitted cloth for Blender 3.4 and later, as a script, because Blender reads hair curves
 * with radii from no file that all its builds know (Debian's has neither USD nor Alembic):
 *
 *     blender --python cloth.py          or: blender -b --python cloth.py -- picture.exr SAMPLES PX ROW
 *                                    or: blender -b --python cloth.py -- --save cloth.blend
 *
 * fibers-<group>.txt has the vertices of each fiber with its radius, scene.json the data for the script, which makes
 * hair curves with two Principled Hair BSDFs mixed (hair_on_cloth.h; Cycles), instances, black sheet, camera and lamp.
 * Millimetres. */
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/report/export/blend_file.h"
#include "optimizer/report/export/export_scene.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

static const double mm = 1e3;

static const char script_head[] =
    "\"\"\"Made by Selvedge: builds the cloth of scene.json in Blender 3.4 or later.\n\n"
    "blender --python cloth.py, or blender -b --python cloth.py -- picture.exr SAMPLES PX ROW,\n"
    "or blender -b --python cloth.py -- --save cloth.blend\n"
    "ROW: of rows.csv, from 0; the first one where it is left out.\"\"\"\n"
    "import csv\nimport json\nimport os\nimport sys\n\nimport bpy\nfrom mathutils import Matrix, Vector\n\n"
    "HERE = os.path.dirname(os.path.abspath(__file__))\n\n\n"
    "def nodes_of(name, kind, **inputs):\n"
    "    material = bpy.data.materials.new(name)\n    material.use_nodes = True\n"
    "    tree = material.node_tree\n    tree.nodes.clear()\n    shader = tree.nodes.new(kind)\n"
    "    out = tree.nodes.new('ShaderNodeOutputMaterial')\n"
    "    tree.links.new(shader.outputs[0], out.inputs['Surface'])\n"
    "    for key, value in inputs.items():\n        shader.inputs[key.replace('_', ' ')].default_value = value\n"
    "    return material\n\n\n"
    "def blend(name, hairs):\n"
    "    \"\"\"The second material's share of each point of a fiber.\"\"\"\n"
    "    material = bpy.data.materials.new(name)\n    material.use_nodes = True\n"
    "    tree = material.node_tree\n    tree.nodes.clear()\n"
    "    mix = tree.nodes.new('ShaderNodeMixShader')\n    mix.inputs[0].default_value = hairs[1]['share']\n"
    "    for k, hair in enumerate(hairs):\n        shader = tree.nodes.new('ShaderNodeBsdfHairPrincipled')\n"
    "        shader.name = 'hair-%d' % k\n"
    "        if hasattr(shader, 'model'):\n            shader.model = 'CHIANG'\n"
    "        shader.parametrization = 'ABSORPTION'\n"
    "        for key, value in (('Absorption Coefficient', hair['absorption']), ('IOR', hair['index']),\n"
    "                           ('Roughness', hair['longitudinal_roughness']), ('Coat', 0), ('Offset', 0),\n"
    "                           ('Radial Roughness', hair['azimuthal_roughness']), ('Random Roughness', 0)):\n"
    "            shader.inputs[key].default_value = value\n"
    "        tree.links.new(shader.outputs[0], mix.inputs[1 + k])\n"
    "    out = tree.nodes.new('ShaderNodeOutputMaterial')\n"
    "    tree.links.new(mix.outputs[0], out.inputs['Surface'])\n    return material\n\n\n"
    "def put(name, data):\n    thing = bpy.data.objects.new(name, data)\n"
    "    bpy.context.scene.collection.objects.link(thing)\n    return thing\n\n\n"
    "def look(thing, place, up):\n    \"\"\"Cameras and lamps look along -z.\"\"\"\n"
    "    z = Vector(place).normalized()\n    x = Vector(up).cross(z).normalized()\n    y = z.cross(x)\n"
    "    thing.matrix_world = Matrix.Translation(place) @ Matrix((x, y, z)).transposed().to_4x4()\n\n\n"
    "def square(name, half, material):\n    x, y = half\n    mesh = bpy.data.meshes.new(name)\n"
    "    mesh.from_pydata([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], [], [(0, 1, 2, 3)])\n"
    "    mesh.materials.append(material)\n    return put(name, mesh)\n\n\n"
    "def fibers(name, path, material):\n"
    "    \"\"\"Hair curves: made as a curve, and converted.\"\"\"\n"
    "    curve = bpy.data.curves.new(name, 'CURVE')\n    curve.dimensions = '3D'\n"
    "    with open(path, encoding='utf-8') as f:\n        text = f.read()\n"
    "    for part in text.split('\\n\\n'):\n"
    "        lines = [[float(x) for x in line.split()] for line in part.strip().split('\\n') if line]\n"
    "        if not lines:\n            continue\n"
    "        spline = curve.splines.new('POLY')\n        spline.points.add(len(lines) - 1)\n"
    "        for point, (x, y, z, radius) in zip(spline.points, lines):\n"
    "            point.co, point.radius = (x, y, z, 1), radius\n"
    "    thing = put(name, curve)\n    bpy.context.view_layer.objects.active = thing\n"
    "    bpy.ops.object.select_all(action='DESELECT')\n    thing.select_set(True)\n"
    "    bpy.ops.object.convert(target='CURVES')\n    thing = bpy.context.view_layer.objects.active\n"
    "    thing.data.materials.clear()\n    thing.data.materials.append(material)\n    return thing\n\n\n";

static const char script_scene[] =
    "def build(s):\n"
    "    for thing in list(bpy.data.objects):\n        bpy.data.objects.remove(thing)\n"
    "    scene = bpy.context.scene\n    scene.render.engine = 'CYCLES'\n    scene.unit_settings.scale_length = 0.001\n"
    "    scene.cycles_curves.shape = 'THICK'\n    scene.cycles_curves.subdivisions = 1\n"
    "    scene.view_settings.view_transform = 'Standard'\n"
    "    for key in ('max_bounces', 'transmission_bounces', 'glossy_bounces', 'diffuse_bounces'):\n"
    "        setattr(scene.cycles, key, 1000)\n"
    "    for key in ('sample_clamp_indirect', 'sample_clamp_direct', 'blur_glossy'):\n"
    "        setattr(scene.cycles, key, 0)\n"
    "    scene.cycles.use_denoising = False\n    scene.cycles.use_adaptive_sampling = False\n"
    "    scene.cycles.pixel_filter_type = 'BOX'\n"
    "    scene.world = scene.world or bpy.data.worlds.new('World')\n    scene.world.use_nodes = True\n"
    "    background = scene.world.node_tree.nodes['Background']\n"
    "    background.inputs[0].default_value, background.inputs[1].default_value = (*s['sky'], 1), 1\n"
    "    for g, m in enumerate(s['materials']):\n"
    "        hair = blend('fiber-%d' % g, m['hair'])\n"
    "        first = fibers('fibers-%d' % g, os.path.join(HERE, m['file']), hair)\n"
    "        for i, (x, y) in enumerate(s['repeats']):\n"
    "            thing = first if i == 0 else put('fibers-%d-%d' % (g, i), first.data)\n"
    "            thing.location = (x, y, 0)\n"
    "    if s['sheet']:\n"
    "        black = nodes_of('sheet', 'ShaderNodeBsdfDiffuse', Color=(0, 0, 0, 1))\n"
    "        square('sheet', s['sheet']['half'], black).location = (0, 0, s['sheet']['z'])\n"
    "    if s['lamp']['side'] > 0:\n"
    "        half = s['lamp']['side'] / 2\n"
    "        light = nodes_of('lamp', 'ShaderNodeEmission', Color=(1, 1, 1, 1), Strength=s['lamp']['radiance'])\n"
    "        lamp = square('lamp', (half, half), light)\n        lamp.visible_camera = False\n"
    "    elif s['lamp']['irradiance'] > 0:\n"
    "        sun = bpy.data.lights.new('lamp', 'SUN')\n        sun.energy, sun.angle = s['lamp']['irradiance'], 0\n"
    "        lamp = put('lamp', sun)\n"
    "    if s['lamp']['side'] > 0 or s['lamp']['irradiance'] > 0:\n        look(lamp, s['lamp']['at'], (0, 0.1, 1))\n"
    "    view = bpy.data.cameras.new('camera')\n    distance = Vector(s['camera']['at']).length\n"
    "    view.clip_start, view.clip_end = 0.01 * distance, 10 * distance\n"
    "    if s['camera']['fov_deg']:\n"
    "        view.angle = s['camera']['fov_deg'] * 3.141592653589793 / 180\n"
    "    else:\n        view.type, view.ortho_scale = 'ORTHO', s['camera']['width']\n"
    "    scene.camera = put('camera', view)\n    look(scene.camera, s['camera']['at'], s['camera']['up'])\n"
    "    scene.render.resolution_x = scene.render.resolution_y = 256\n"
    "    scene.render.image_settings.file_format = 'OPEN_EXR'\n"
    "    scene.render.image_settings.color_depth = '32'\n\n\n"
    "def main():\n    with open(os.path.join(HERE, 'scene.json'), encoding='utf-8') as f:\n"
    "        scene = json.load(f)\n"
    "    more = sys.argv[sys.argv.index('--') + 1:] if '--' in sys.argv else []\n"
    "    if len(more) > 3:\n"
    "        with open(os.path.join(HERE, 'rows.csv'), encoding='utf-8') as f:\n"
    "            row = list(csv.DictReader(f))[int(more[3])]\n"
    "        for key in ('lamp', 'camera'):\n"
    "            scene[key]['at'] = [float(row[f'{key}_{x}_mm']) for x in 'xyz']\n"
    "        scene['camera']['up'] = [float(row[f'up_{x}']) for x in 'xyz']\n"
    "    if more[:1] == ['--save']:\n        build(scene)\n"
    "        bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(more[1]), compress=True)\n        return\n"
    "    build(scene)\n    if more:\n"
    "        render = bpy.context.scene.render\n        render.filepath = os.path.abspath(more[0])\n"
    "        bpy.context.scene.cycles.samples = int(more[1]) if len(more) > 1 else 64\n"
    "        if len(more) > 2:\n            render.resolution_x = render.resolution_y = int(more[2])\n"
    "        bpy.ops.render.render(write_still=True)\n\n\nmain()\n";

static status write_script(const struct export_scene *e, struct error *err)
{
    struct export_text t;
    status s = export_text_open(&t, err);
    if (s != STATUS_OK) return s;
    fputs(script_head, t.file);
    fputs(script_scene, t.file);
    return export_text_close(e, &t, "cloth.py", err);
}

/* The curves of Blender go through their points. */
static void print_fiber(FILE *text, const struct export_scene *e, size_t i)
{
    double p[3];
    for (size_t k = 1; k + 1 < export_n_point(e, i); k++) {
        export_point(e, i, k, p);
        fprintf(text, "%.6f %.6f %.6f %.6f\n", p[0], p[1], p[2], export_point_radius_mm(e, i, k));
    }
    fputc('\n', text);
}

static json_t *repeats_json(const struct export_scene *e)
{
    json_t *list = json_array();
    int n[2];
    double at[2];
    export_repeats(e, n);
    for (int i = 0; i < n[0] * n[1]; i++) {
        export_repeat_at(e, n, i / n[1], i % n[1], at);
        json_array_append_new(list, json_number_list(at, 2, 1.0));
    }
    return list;
}

static json_t *files_json(const struct export_scene *e)
{
    json_t *materials = export_hair_json(e);
    char name[32];
    for (size_t g = 0; g < json_array_size(materials); g++) {
        export_fibers_name(g, ".txt", name);
        json_object_set_new(json_array_get(materials, g), "file", json_string(name));
    }
    return materials;
}

static json_t *scene_json(const struct export_scene *e)
{
    const struct configuration *k = &e->report->in.job->rows->observation.item[0].configuration;
    const struct export_view v = export_view_of(e, k);
    double half[2], z;
    const bool sheet = export_sheet(e, half, &z);
    json_t *below = sheet ? json_pack("{s:o, s:f}", "half", json_number_list(half, 2, 1.0), "z", z) : json_null();
    return json_pack("{s:o, s:o, s:o, s:o, s:{s:o, s:f, s:f, s:f}, s:{s:o, s:o, s:f, s:f}}", "materials", files_json(e),
                     "repeats", repeats_json(e), "sheet", below, "sky", json_number_list(k->environment_rgb, 3, 1.0),
                     "lamp", "at", json_number_list(v.lamp_mm, 3, 1.0), "side",
                     k->light == LIGHT_SQUARE_LAMP ? mm * k->lamp_side_m : 0.0, "radiance", v.radiance, "irradiance",
                     k->light == LIGHT_DIRECTIONAL ? v.irradiance : 0.0, "camera", "at",
                     json_number_list(v.camera_mm, 3, 1.0), "up", json_number_list(v.up, 3, 1.0), "fov_deg",
                     k->camera == CAMERA_FAR_FIELD ? 0.0 : v.fov_deg, "width", v.width_mm);
}

static status write_scene(const struct export_scene *e, struct error *err)
{
    char path[WORKER_PATH_BYTES], *text;
    json_t *json = scene_json(e);
    text = json != NULL ? json_dumps(json, JSON_INDENT(1) | JSON_REAL_PRECISION(9)) : NULL;
    json_decref(json);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot export a scene: out of memory");
    export_path(e, "scene.json", path);
    status s = worker_folder_replace(e->report->in.job->tools->folder, path, text, strlen(text), err);
    free(text);
    return s;
}

static status write_blender(struct export_scene *e, json_t **materials, struct error *err)
{
    status s = STATUS_OK;
    for (size_t g = 0; g < e->model->setup->sets.n_set && s == STATUS_OK; g++)
        s = export_fibers_write(e, g, ".txt", print_fiber, err);
    if (s == STATUS_OK) s = export_rows_write(e, err);
    if (s == STATUS_OK) s = write_script(e, err);
    if (s == STATUS_OK) s = write_scene(e, err);
    if (s == STATUS_OK) s = blend_file_write(e->report, err);
    if (s == STATUS_OK) *materials = export_hair_json(e);
    return s;
}

EXPORT(blender, "A script that builds the scene in Blender, with hair curves and Blender's hair material.")

/* Blender 3.4 loses some 5 % of the light at each bounce between fibers that mainly let light through. Its renderings
 * differ from Mitsuba's of the same mixtures by 1 to 10 % over the rows of the fits of make bench-exports. */
const struct export_format export_blender = {.has_hair = true, .deviation = 0.08, .write = write_blender};
