/* Set-up that the functions of OpenCV (C++) behind the headers of this folder need before their first use. */
#ifndef SELVEDGE_GEOMETRY_VISION_H
#define SELVEDGE_GEOMETRY_VISION_H

#ifdef __cplusplus
extern "C" {
#endif

#include "base/status.h"

/* Turns OpenCV's own threads off, so that results do not depend on them. To be called before the functions of the other
 * headers; further calls have no effect. STATUS_INTERNAL. */
status vision_init(struct error *err);

#ifdef __cplusplus
}
#endif
#endif
