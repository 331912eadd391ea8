#include "optimizer/report/textures/texture_usd.h"

#include <stddef.h>

static void print_piece(FILE *text, const struct texture_maps *m)
{
    const double x = 0.5 * m->pixel_mm[0] * (double)(m->width * m->repeat[0]),
                 y = 0.5 * m->pixel_mm[1] * (double)(m->height * m->repeat[1]);
    fprintf(text,
            "    def Mesh \"Piece\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )\n    {\n"
            "        int[] faceVertexCounts = [4]\n        int[] faceVertexIndices = [0, 1, 2, 3]\n"
            "        point3f[] points = [(%.9g, %.9g, 0), (%.9g, %.9g, 0), (%.9g, %.9g, 0), (%.9g, %.9g, 0)]\n"
            "        float3[] extent = [(%.9g, %.9g, 0), (%.9g, %.9g, 0)]\n"
            "        normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)] (\n"
            "            interpolation = \"vertex\"\n        )\n"
            "        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (\n"
            "            interpolation = \"vertex\"\n        )\n"
            "        uniform token subdivisionScheme = \"none\"\n        uniform bool doubleSided = 1\n"
            "        rel material:binding = </Cloth/Surface>\n    }\n",
            -x, -y, x, -y, x, y, -x, y, -x, -y, x, y);
}

static const char preview[] =
    "        token outputs:surface.connect = </Cloth/Surface/preview.outputs:surface>\n"
    "        token outputs:mtlx:surface.connect = </Cloth/Surface/open_pbr.outputs:out>\n"
    "        def Shader \"preview\"\n        {\n            uniform token info:id = \"UsdPreviewSurface\"\n"
    "            color3f inputs:diffuseColor.connect = </Cloth/Surface/reflected.outputs:rgb>\n"
    "            normal3f inputs:normal.connect = </Cloth/Surface/normal.outputs:rgb>\n"
    "            int inputs:useSpecularWorkflow = 1\n            color3f inputs:specularColor = (0, 0, 0)\n"
    "            float inputs:roughness = 1\n            token outputs:surface\n        }\n"
    "        def Shader \"reflected\"\n        {\n            uniform token info:id = \"UsdUVTexture\"\n"
    "            asset inputs:file = @./reflected.png@\n            token inputs:sourceColorSpace = \"sRGB\"\n"
    "            token inputs:wrapS = \"repeat\"\n            token inputs:wrapT = \"repeat\"\n"
    "            float2 inputs:st.connect = </Cloth/Surface/st.outputs:result>\n"
    "            float3 outputs:rgb\n        }\n"
    "        def Shader \"normal\"\n        {\n            uniform token info:id = \"UsdUVTexture\"\n"
    "            asset inputs:file = @./normal.png@\n            token inputs:sourceColorSpace = \"raw\"\n"
    "            float4 inputs:scale = (2, 2, 2, 1)\n            float4 inputs:bias = (-1, -1, -1, 0)\n"
    "            token inputs:wrapS = \"repeat\"\n            token inputs:wrapT = \"repeat\"\n"
    "            float2 inputs:st.connect = </Cloth/Surface/st.outputs:result>\n"
    "            float3 outputs:rgb\n        }\n"
    "        def Shader \"st\"\n        {\n            uniform token info:id = \"UsdPrimvarReader_float2\"\n"
    "            string inputs:varname = \"st\"\n            float2 outputs:result\n        }\n";

static const char nodes[] =
    "        def Shader \"place\"\n        {\n            uniform token info:id = \"ND_geompropvalue_vector2\"\n"
    "            string inputs:geomprop = \"st\"\n            float2 outputs:out\n        }\n"
    "        def Shader \"shading_normal\"\n        {\n"
    "            uniform token info:id = \"ND_normalmap_float\"\n"
    "            float3 inputs:in.connect = </Cloth/Surface/normal_map.outputs:out>\n"
    "            float3 outputs:out\n        }\n"
    "        def Shader \"along_u\"\n        {\n            uniform token info:id = \"ND_tangent_vector3\"\n"
    "            float3 outputs:out\n        }\n"
    "        def Shader \"surface_normal\"\n        {\n            uniform token info:id = \"ND_normal_vector3\"\n"
    "            float3 outputs:out\n        }\n"
    "        def Shader \"degrees\"\n        {\n            uniform token info:id = \"ND_multiply_float\"\n"
    "            float inputs:in1.connect = </Cloth/Surface/direction_map.outputs:out>\n"
    "            float inputs:in2 = 360\n            float outputs:out\n        }\n"
    "        def Shader \"across_fibers\"\n        {\n            uniform token info:id = \"ND_rotate3d_vector3\"\n"
    "            float3 inputs:in.connect = </Cloth/Surface/along_u.outputs:out>\n"
    "            float inputs:amount.connect = </Cloth/Surface/degrees.outputs:out>\n"
    "            float3 inputs:axis.connect = </Cloth/Surface/surface_normal.outputs:out>\n"
    "            float3 outputs:out\n        }\n";

static void print_image(FILE *text, const char *name, const char *node, const char *type, const char *file)
{
    fprintf(text,
            "        def Shader \"%s\"\n        {\n            uniform token info:id = \"ND_image_%s\"\n"
            "            asset inputs:file = @./%s@%s\n"
            "            float2 inputs:texcoord.connect = </Cloth/Surface/place.outputs:out>\n"
            "            %s outputs:out\n        }\n",
            name, node, file, type[0] == 'c' ? " (\n                colorSpace = \"srgb_texture\"\n            )" : "",
            type);
}

static void print_number(FILE *text, const char *name, double value)
{
    fprintf(text, "            float inputs:%s = %.6g\n", name, value);
}

static void print_open_pbr(FILE *text, const struct texture_surface *t)
{
    struct texture_input input[TEXTURE_N_INPUT];
    texture_surface_list(t, input);
    fprintf(text, "        def Shader \"open_pbr\"\n        {\n"
                  "            uniform token info:id = \"ND_open_pbr_surface_surfaceshader\"\n"
                  "            color3f inputs:base_color.connect = </Cloth/Surface/base_map.outputs:out>\n"
                  "            float inputs:specular_roughness.connect = </Cloth/Surface/roughness_map.outputs:out>\n"
                  "            float inputs:specular_roughness_anisotropy.connect = "
                  "</Cloth/Surface/anisotropy_map.outputs:out>\n"
                  "            float3 inputs:geometry_normal.connect = </Cloth/Surface/shading_normal.outputs:out>\n"
                  "            float3 inputs:geometry_tangent.connect = </Cloth/Surface/across_fibers.outputs:out>\n");
    for (size_t i = 0; i < TEXTURE_N_INPUT; i++) {
        const double *v = input[i].value;
        if (input[i].n == 1)
            print_number(text, input[i].name, v[0]);
        else
            fprintf(text, "            color3f inputs:%s = (%.6g, %.6g, %.6g)\n", input[i].name, v[0], v[1], v[2]);
    }
    fprintf(text, "            token outputs:out\n        }\n");
}

status texture_usd_write(const struct export_scene *e, const struct texture_surface *t, struct error *err)
{
    struct export_text text;
    status s = export_text_open(&text, err);
    if (s != STATUS_OK) return s;
    fprintf(text.file, "#usda 1.0\n(\n    defaultPrim = \"Cloth\"\n    doc = \"Made by Selvedge.\"\n"
                       "    metersPerUnit = 0.001\n    upAxis = \"Z\"\n)\n\n"
                       "def Xform \"Cloth\" (\n    kind = \"component\"\n)\n{\n");
    print_piece(text.file, t->maps);
    fprintf(text.file, "    def Material \"Surface\"\n    {\n");
    fputs(preview, text.file);
    fputs(nodes, text.file);
    print_image(text.file, "base_map", "color3", "color3f", "base_color.png");
    print_image(text.file, "roughness_map", "float", "float", "roughness.png");
    print_image(text.file, "anisotropy_map", "float", "float", "anisotropy.png");
    print_image(text.file, "direction_map", "float", "float", "anisotropy_rotation.png");
    print_image(text.file, "normal_map", "vector3", "float3", "normal.png");
    print_open_pbr(text.file, t);
    fprintf(text.file, "    }\n}\n");
    return export_text_close(e, &text, "cloth.usda", err);
}
