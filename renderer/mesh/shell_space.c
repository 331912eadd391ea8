#include "renderer/mesh/shell_walk.h"

#include <string.h>

static status build_outer(struct shell_space *b, struct error *err)
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

status shell_space_init(struct shell_space *s, const struct mesh *m, double thickness_mm, double margin_mm,
                        struct error *err)
{
    memset(s, 0, sizeof *s);
    status st = shell_new(m, thickness_mm, margin_mm, &s->shell, err);
    return st == STATUS_OK ? build_outer(s, err) : st;
}

void shell_space_release(struct shell_space *s)
{
    if (s->outer != NULL) rtcReleaseScene(s->outer);
    if (s->device != NULL) rtcReleaseDevice(s->device);
    shell_release(&s->shell);
    memset(s, 0, sizeof *s);
}
