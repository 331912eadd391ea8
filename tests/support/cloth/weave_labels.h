/* Comparison of reconstructed directions with the labelled tows of the scan weave-ct (github.com/nasa/puma,
 * python/pumapy/data, NOSA 1.3). */
#ifndef SELVEDGE_TESTS_WEAVE_LABELS_H
#define SELVEDGE_TESTS_WEAVE_LABELS_H

#include "geometry/volume/volume.h"

/* Label 1 marks tows along z of the file (x of the cloth), label 2 tows along its x (y of the cloth). d must come
 * from a scan read with the axes "zxy". *kept is the share of labelled voxels that have a direction. *accuracy is the
 * share of these whose direction is nearest to the axis of their tow. */
status weave_label_accuracy(const struct direction_volume *d, const char *label_path, double *accuracy, double *kept,
                            struct error *err);

#endif
