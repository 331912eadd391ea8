/* The labelled tows of weave-ct (github.com/nasa/puma, python/pumapy/data, NOSA 1.3) against reconstructed directions. */
#ifndef SELVEDGE_TESTS_WEAVE_LABELS_H
#define SELVEDGE_TESTS_WEAVE_LABELS_H

#include "geometry/volume/volume.h"

/* Labels 1: tows along the file's z (cloth x), 2: along its x (cloth y); directions of a scan read with axes "zxy".
 * accuracy: share of kept labelled voxels whose direction is nearest to their tow's axis; kept: share of labelled voxels with a direction. */
status weave_label_accuracy(const struct direction_volume *d, const char *label_path, double *accuracy, double *kept,
                            struct error *err);

#endif
