/* Angles of lamp, camera and cloth in the names of photographs, such as t45_p180.dng. */
#ifndef SELVEDGE_CLIENTS_NAME_ANGLES_H
#define SELVEDGE_CLIENTS_NAME_ANGLES_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

enum name_angle { NAME_LIGHT_THETA, NAME_LIGHT_PHI, NAME_CAMERA_THETA, NAME_CAMERA_PHI, NAME_ROTATION, NAME_N_ANGLE };

/* Keys of a photograph in the job document: "light_theta_deg" and so forth. */
extern const char *const name_angle_key[NAME_N_ANGLE];

struct name_angles {
    double deg[NAME_N_ANGLE];
    bool given[NAME_N_ANGLE];
};

/* Reads the angles from a name without its ending. The pattern has the letters of the name, whatever their case, with
 * numbers at {light_theta}, {light_phi}, {camera_theta}, {camera_phi} and {rotation}; '*' is any text, and '_' also
 * '-', '.' and a blank. Returns whether the whole name fits. */
bool name_angles_read(const char *pattern, const char *name, struct name_angles *angles);
/* STATUS_INVALID for a pattern with an unknown or a second place of an angle, or without any. */
status name_angles_check(const char *pattern, struct error *err);
/* The first of the usual patterns that all n names fit; NULL: none. */
const char *name_angles_guess(const char *const *name, size_t n);

#endif
