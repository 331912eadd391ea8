#include "tests/support/cloth/weave_labels.h"

#include "geometry/volume/format/volume_source.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void count(const struct direction_volume *d, const float *label, const size_t n[3], double *accuracy,
                  double *kept)
{
    size_t right = 0, total = 0, n_kept = 0;
    for (size_t z = 0; z < n[2]; z++)
        for (size_t y = 0; y < n[1]; y++)
            for (size_t x = 0; x < n[0]; x++) {
                int tow = (int)label[volume_index(n, x, y, z)] - 1;
                size_t at = volume_index(d->n, z, x, y); /* axes "zxy" */
                if (tow != 0 && tow != 1) continue;
                total++;
                if (d->density[at] == 0) continue;
                float e[3];
                direction_volume_get(d, at, e);
                n_kept++;
                right += fabsf(e[tow]) >= fabsf(e[1 - tow]) && fabsf(e[tow]) >= fabsf(e[2]);
            }
    *kept = (double)n_kept / (double)total;
    *accuracy = (double)right / (double)n_kept;
}

status weave_label_accuracy(const struct direction_volume *d, const char *label_path, double *accuracy, double *kept,
                            struct error *err)
{
    struct volume_source *source = NULL;
    size_t n[3];
    status s = volume_source_open(&label_path, 1, &source, err);
    if (s != STATUS_OK) return s;
    memcpy(n, volume_source_describe(source)->n, sizeof n);
    float *label = malloc(volume_n_voxel(n) * sizeof *label);
    if (label == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot read labels: out of memory");
    else if (n[2] != d->n[0] || n[0] != d->n[1] || n[1] != d->n[2])
        s = error_set(err, STATUS_INVALID, "labels '%s' do not have the size of the scan", label_path);
    else
        s = volume_source_read(source, 0, n[2], label, err);
    if (s == STATUS_OK) count(d, label, n, accuracy, kept);
    free(label);
    volume_source_close(source);
    return s;
}
