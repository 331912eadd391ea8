#include "renderer/scene/scene_embree.h"
#include "renderer/scene/scene_visitor.h"

#include "renderer/scene/scene_ellipse.h"

#include <math.h>
#include <string.h>

static void on_device_error(void *user, enum RTCError code, const char *text)
{
    struct error *e = user;
    if (e->code != STATUS_OK) return; /* the first is the cause */
    error_set_at(e, code == RTC_ERROR_OUT_OF_MEMORY ? STATUS_NO_MEMORY : STATUS_INTERNAL, "embree", "",
                 "cannot build scene: Embree: %s", text == NULL ? "unknown error" : text);
}

static bool count_device_memory(void *user, ssize_t bytes, bool post)
{
    (void)post;
    struct scene *s = user;
    atomic_fetch_add_explicit(&s->device_bytes, bytes, memory_order_relaxed);
    return true;
}

static void build_tile(struct scene *s)
{
    RTCGeometry g = scene_ellipse_geometry(s);
    rtcCommitGeometry(g);
    s->tile = rtcNewScene(s->device);
    rtcSetSceneFlags(s->tile, RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    rtcAttachGeometry(s->tile, g);
    rtcReleaseGeometry(g);
    rtcCommitScene(s->tile);
}

static void build_block(struct scene *s)
{
    s->block = rtcNewScene(s->device);
    rtcSetSceneFlags(s->block, RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    for (int j = -s->half_block[1]; j <= s->half_block[1]; j++)
        for (int i = -s->half_block[0]; i <= s->half_block[0]; i++) {
            RTCGeometry g = rtcNewGeometry(s->device, RTC_GEOMETRY_TYPE_INSTANCE);
            float m[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, (float)(i * s->tile_mm[0]), (float)(j * s->tile_mm[1]), 0};
            rtcSetGeometryInstancedScene(g, s->tile);
            rtcSetGeometryTransform(g, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, m);
            rtcCommitGeometry(g);
            rtcAttachGeometry(s->block, g);
            rtcReleaseGeometry(g);
        }
    rtcCommitScene(s->block);
}

status scene_embree_build(struct scene *s, struct error *err)
{
    struct error device_error = {0};
    /* one build thread: the order of the tree's leaves, which decides ties, must not depend on timing */
    s->device = rtcNewDevice(s->no_avx512 ? "threads=1,set_affinity=0,isa=avx2" : "threads=1,set_affinity=0");
    if (s->device == NULL)
        return error_set(err, STATUS_UNSUPPORTED, "cannot build scene: Embree does not start (error %d)",
                         (int)rtcGetDeviceError(NULL));
    rtcSetDeviceErrorFunction(s->device, on_device_error, &device_error);
    rtcSetDeviceMemoryMonitorFunction(s->device, count_device_memory, s);
    build_tile(s);
    build_block(s);
    rtcSetDeviceErrorFunction(s->device, NULL, NULL); /* device_error is on this stack */
    if (device_error.code != STATUS_OK && err != NULL) *err = device_error;
    return device_error.code;
}

void scene_embree_free(struct scene *s)
{
    if (s->block != NULL) rtcReleaseScene(s->block);
    if (s->tile != NULL) rtcReleaseScene(s->tile);
    if (s->device != NULL) rtcReleaseDevice(s->device);
}

/* ---- rays ---- */

/* Context of the filters. */
struct query {
    struct RTCIntersectContext embree;
    struct scene_visitor *visitor;
};

static bool comes_out(const struct RTCRay *ray, const struct RTCHit *hit)
{
    return ray->dir_x * hit->Ng_x + ray->dir_y * hit->Ng_y + ray->dir_z * hit->Ng_z > 0;
}

/* Embree's filter of rays that may start in fibers (scene_faces.h). */
static void refuse_back(const struct RTCFilterFunctionNArguments *a)
{
    /* single rays: N is 1 */
    if (comes_out((const struct RTCRay *)a->ray, (const struct RTCHit *)a->hit)) a->valid[0] = 0;
}

/* Embree's filter of rays that visit fibers. */
static void visit_face(const struct RTCFilterFunctionNArguments *a)
{
    struct query *q = (struct query *)(void *)a->context;
    refuse_back(a);
    if (a->valid[0] != 0 && scene_visitor_see(q->visitor, ((const struct RTCHit *)a->hit)->primID))
        a->valid[0] = 0; /* so that Embree goes on looking */
}

static void fill_ray(struct RTCRay *q, const struct scene_ray *r, float tnear, float tfar)
{
    memset(q, 0, sizeof *q);
    q->org_x = r->origin_mm[0];
    q->org_y = r->origin_mm[1];
    q->org_z = r->origin_mm[2];
    q->tnear = tnear;
    q->dir_x = r->direction[0];
    q->dir_y = r->direction[1];
    q->dir_z = r->direction[2];
    q->tfar = tfar;
    q->mask = ~0u;
}

bool scene_embree_trace(const struct scene *s, const struct scene_ray *r, float t_far, struct scene_face *face)
{
    struct query query;
    float t_near = r->tnear_mm;
    rtcInitIntersectContext(&query.embree);
    if (r->inside) query.embree.filter = refuse_back;
    while (t_far > t_near) {
        struct RTCRayHit q;
        fill_ray(&q.ray, r, t_near, t_far);
        q.hit.geomID = q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(s->block, &query.embree, &q);
        if (q.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
        if (!comes_out(&q.ray, &q.hit)) {
            const int side = 2 * s->half_block[0] + 1, i_copy = (int)q.hit.instID[0];
            *face = (struct scene_face){.t = q.ray.tfar,
                                        .i_segment = q.hit.primID,
                                        .copy = {i_copy % side - s->half_block[0], i_copy / side - s->half_block[1]},
                                        .normal = {q.hit.Ng_x, q.hit.Ng_y, q.hit.Ng_z}};
            return true;
        }
        t_near = q.ray.tfar * (1 + 1e-6f) + 1e-6f; /* rounding has put the start of the ray into a fiber */
    }
    return false;
}

bool scene_embree_occluded(const struct scene *s, const struct scene_ray *r, float t_far, struct scene_visitor *visitor)
{
    struct query query = {.visitor = visitor};
    struct RTCRay q;
    rtcInitIntersectContext(&query.embree);
    if (visitor != NULL)
        query.embree.filter = visit_face;
    else if (r->inside)
        query.embree.filter = refuse_back;
    fill_ray(&q, r, r->tnear_mm, t_far);
    rtcOccluded1(s->block, &query.embree, &q);
    return q.tfar < 0;
}
