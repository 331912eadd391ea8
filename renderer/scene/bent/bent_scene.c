#include "renderer/scene/bent/bent_scene.h"

#include <stdlib.h>
#include <string.h>

static status build_outer(struct bent_cloth *b, struct error *err)
{
    b->device = rtcNewDevice("threads=1,set_affinity=0");
    if (b->device == NULL)
        return error_set(err, STATUS_UNSUPPORTED, "cannot bend the cloth: Embree does not start (error %d)",
                         (int)rtcGetDeviceError(NULL));
    const struct shell *s = &b->shell;
    RTCGeometry g = rtcNewGeometry(b->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *node =
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof *s->node_mm, s->n_node);
    uint32_t *corner =
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof *s->outer, s->n_outer);
    if (node == NULL || corner == NULL) {
        rtcReleaseGeometry(g);
        return error_set(err, STATUS_NO_MEMORY, "cannot bend the cloth: no memory for %zu triangles", s->n_outer);
    }
    memcpy(node, s->node_mm, s->n_node * sizeof *s->node_mm);
    memcpy(corner, s->outer, s->n_outer * sizeof *s->outer);
    rtcCommitGeometry(g);
    b->outer = rtcNewScene(b->device);
    rtcSetSceneFlags(b->outer, RTC_SCENE_FLAG_ROBUST);
    rtcAttachGeometry(b->outer, g);
    rtcReleaseGeometry(g);
    rtcCommitScene(b->outer);
    return STATUS_OK;
}

status scene_bend(const struct scene *flat, const struct mesh *m, bool black_sheet, struct scene **bent,
                  struct error *err)
{
    if (flat->bent != NULL) return error_set(err, STATUS_INVALID, "cannot bend a cloth that is bent already");
    struct bent_cloth *b = calloc(1, sizeof *b);
    struct scene *s = calloc(1, sizeof *s);
    status st =
        b != NULL && s != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot bend the cloth: out of memory");
    if (st == STATUS_OK) {
        memcpy(s, flat, sizeof *s);
        memcpy(&b->flat, flat, sizeof b->flat);
        s->bent = b;
        s->black_sheet = black_sheet;
        st = shell_new(m, -(double)flat->bottom_mm, (double)SCENE_MARGIN_MM, &b->shell, err);
    }
    if (st == STATUS_OK) st = build_outer(b, err);
    if (st == STATUS_OK) {
        *bent = s;
        return STATUS_OK;
    }
    if (s != NULL && s->bent != NULL)
        bent_free(s);
    else {
        free(b);
        free(s);
    }
    return st;
}

void bent_free(struct scene *s)
{
    struct bent_cloth *b = s->bent;
    if (b->outer != NULL) rtcReleaseScene(b->outer);
    if (b->device != NULL) rtcReleaseDevice(b->device);
    shell_release(&b->shell);
    free(b);
    free(s);
}

size_t bent_memory_bytes(const struct scene *s)
{
    const struct shell *h = &s->bent->shell;
    return sizeof *s + sizeof *s->bent + h->n_cell * (sizeof *h->cell + sizeof *h->corner) +
           2 * h->n_node * sizeof *h->node_mm + h->n_outer * (2 * sizeof *h->outer + 64);
}
