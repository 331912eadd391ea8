#include "renderer/scene/scene_pack.h"

#include "renderer/scene/scene_data.h"

#include <math.h>
#include <stdlib.h>

/* What a scene holds besides its arrays. */
struct scene_head {
    uint64_t n_vertex, n_segment, n_group;
    double tile_mm[2];
    int32_t half_block[2];
    float inset_low_mm[2], inset_high_mm[2], bottom_mm;
    uint8_t black_sheet, no_avx512, has_group, has_axis, has_ratio, has_sections, shows_sections;
    struct film_groups films;
};

uint64_t scene_number(const struct scene *s) { return s->number; }

unsigned scene_engine_version(void)
{
    RTCDevice device = rtcNewDevice("threads=1,set_affinity=0");
    const unsigned version = device != NULL ? (unsigned)rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION) : 0;
    if (device != NULL) rtcReleaseDevice(device);
    return version;
}

void scene_pack(const struct scene *s, struct byte_pack *p)
{
    struct scene_head h = {.n_vertex = s->n_vertex,
                           .n_segment = s->n_segment,
                           .n_group = s->n_group,
                           .bottom_mm = s->bottom_mm,
                           .black_sheet = s->black_sheet,
                           .no_avx512 = s->no_avx512,
                           .has_group = s->segment_group != NULL,
                           .has_axis = s->long_axis != NULL,
                           .has_ratio = s->ratio != NULL,
                           .has_sections = s->has_sections,
                           .shows_sections = s->shows_sections,
                           .films = s->films};
    for (int a = 0; a < 2; a++) {
        h.tile_mm[a] = s->tile_mm[a];
        h.half_block[a] = s->half_block[a];
        h.inset_low_mm[a] = s->inset_low_mm[a];
        h.inset_high_mm[a] = s->inset_high_mm[a];
    }
    BYTE_PACK(p, h);
    byte_pack_put(p, s->vertex, s->n_vertex * sizeof *s->vertex);
    byte_pack_put(p, s->segment_vertex, s->n_segment * sizeof *s->segment_vertex);
    byte_pack_put(p, s->segment_fiber, s->n_segment * sizeof *s->segment_fiber);
    byte_pack_put(p, s->segment_flag, s->n_segment);
    if (h.has_group) byte_pack_put(p, s->segment_group, s->n_segment);
    if (h.has_axis) byte_pack_put(p, s->long_axis, s->n_vertex * sizeof *s->long_axis);
    if (h.has_ratio) byte_pack_put(p, s->ratio, s->n_vertex * sizeof *s->ratio);
}

/* Whether a vertex lies in the cloth, and its section in the tiles of the block. */
static bool vertex_in_range(const struct scene *s, size_t i)
{
    const struct scene_vertex *v = &s->vertex[i];
    const double root = s->ratio != NULL ? sqrt((double)s->ratio[i]) : 1, slack = 1.01, radius = (double)v->radius,
                 thickness = slack * fabs((double)s->bottom_mm), at[2] = {(double)v->x, (double)v->y};
    bool good = radius > 0 && radius / root <= thickness && fabs((double)v->z) <= thickness;
    for (int a = 0; a < 2; a++)
        good = good && fabs(at[a]) + radius * root <= slack * (s->half_block[a] + 1) * s->tile_mm[a];
    return good;
}

static bool films_in_range(const struct film_groups *f)
{
    bool good = f->n <= FILM_MAX_GROUP && f->first_group <= FIBER_MAX_GROUP;
    for (size_t k = 0; good && k < f->n; k++) {
        const struct film_material *m = &f->material[k];
        good = m->surface <= FILM_FLAKES && m->optics <= FILM_KIRCHHOFF && m->roughness > 0 && m->roughness <= 1 &&
               (m->surface == FILM_SMOOTH || (m->grain_um > 0 && isfinite(m->grain_um)));
        for (int c = 0; c < 3; c++) good = good && m->color[c] >= 0 && m->color[c] <= 1;
    }
    return good;
}

/* With sizes that scene_new does not permit, the cells of the grid could be filled for hours. */
static bool in_range(const struct scene *s)
{
    double largest_mm = 0;
    bool good = s->n_segment > 0 && s->n_group >= 1 && s->n_group <= FIBER_MAX_GROUP &&
                (s->ratio == NULL || s->long_axis != NULL) && films_in_range(&s->films) &&
                ((s->films.n == 0 && !s->shows_sections) || s->ratio != NULL) &&
                (!s->has_sections || s->long_axis != NULL) && isfinite(s->bottom_mm);
    for (size_t i = 0; i < s->n_vertex; i++) largest_mm = fmax(largest_mm, (double)s->vertex[i].radius);
    for (int a = 0; a < 2; a++)
        good = good && s->half_block[a] >= 1 && s->half_block[a] <= SCENE_MAX_HALF_BLOCK && s->tile_mm[a] > 0 &&
               SCENE_SMALLEST_RADIUS_OF_TILE * s->tile_mm[a] <= 2 * largest_mm;
    for (size_t i = 0; good && i < s->n_vertex; i++) good = vertex_in_range(s, i);
    for (size_t i = 0; good && i < s->n_segment; i++)
        good = s->segment_vertex[i] + (size_t)1 < s->n_vertex &&
               (s->segment_group == NULL || s->segment_group[i] < s->n_group || scene_film(s, (uint32_t)i) != NULL);
    return good;
}

status scene_unpack(struct byte_view *v, struct scene **scene, struct error *err)
{
    struct scene_head h;
    struct scene *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot build scene: out of memory");
    BYTE_VIEW(v, h);
    s->n_vertex = h.n_vertex;
    s->n_segment = h.n_segment;
    s->n_group = h.n_group;
    s->bottom_mm = h.bottom_mm;
    s->black_sheet = h.black_sheet != 0;
    s->no_avx512 = h.no_avx512 != 0;
    s->has_sections = h.has_sections != 0;
    s->shows_sections = h.shows_sections != 0;
    s->films = h.films;
    for (int a = 0; a < 2; a++) {
        s->tile_mm[a] = h.tile_mm[a];
        s->half_block[a] = h.half_block[a];
        s->inset_low_mm[a] = h.inset_low_mm[a];
        s->inset_high_mm[a] = h.inset_high_mm[a];
    }
    s->vertex = byte_view_array(v, s->n_vertex, sizeof *s->vertex);
    s->segment_vertex = byte_view_array(v, s->n_segment, sizeof *s->segment_vertex);
    s->segment_fiber = byte_view_array(v, s->n_segment, sizeof *s->segment_fiber);
    s->segment_flag = byte_view_array(v, s->n_segment, 1);
    if (h.has_group) s->segment_group = byte_view_array(v, s->n_segment, 1);
    if (h.has_axis) s->long_axis = byte_view_array(v, s->n_vertex, sizeof *s->long_axis);
    if (h.has_ratio) s->ratio = byte_view_array(v, s->n_vertex, sizeof *s->ratio);
    status st = byte_view_check(v, err);
    if (st == STATUS_OK && !in_range(s)) st = error_set(err, STATUS_FORMAT, "a scene of another rank is none");
    if (st == STATUS_OK) st = scene_build(s, err);
    if (st == STATUS_OK)
        *scene = s;
    else
        scene_free(s);
    return st;
}
