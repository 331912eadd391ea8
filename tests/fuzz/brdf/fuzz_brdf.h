/* Reads bytes as a measured BRDF and evaluates it. */
#ifndef SELVEDGE_TESTS_FUZZ_BRDF_H
#define SELVEDGE_TESTS_FUZZ_BRDF_H

#include "optimizer/job/document/job_rows.h"
#include "optimizer/photographs/rows/brdf_file.h"
#include "tests/fuzz/fuzz_input.h"

#include <math.h>
#include <stdlib.h>

static inline void fuzz_brdf_place(double theta, double phi, double v[3])
{
    v[0] = sin(theta) * cos(phi);
    v[1] = sin(theta) * sin(phi);
    v[2] = cos(theta);
}

/* Evaluates pairs of directions over both hemispheres; a value that is negative or no number aborts. */
static inline void fuzz_brdf_evaluate(const brdf_reader *reader, const void *handle)
{
    for (int i = 0; i < 60; i++) {
        double light[3], camera[3], f[3] = {0};
        fuzz_brdf_place(0.26 * (i % 7), 0.5 * M_PI * (i % 5) - M_PI, light);
        fuzz_brdf_place(0.31 * (i % 6), 0.25 * M_PI * (i % 9) - M_PI, camera);
        if (!reader->eval(handle, light, camera, f)) continue;
        for (int c = 0; c < 3; c++)
            if (!(f[c] >= 0.0 && f[c] < 1e12)) abort();
    }
}

static inline void fuzz_brdf(const brdf_reader *reader, const char *path, enum job_symmetry symmetry)
{
    void *handle = NULL;
    struct error err = {0};
    struct job_measured_row row = {0};
    status s = reader->open(path, symmetry, &handle, &err);
    fuzz_check_error(s, &err);
    if (s != STATUS_OK) return;
    (void)reader->isotropic(handle);
    for (size_t i = 0; reader->measured != NULL && reader->measured(handle, i, &row); i++)
        if (!(row.light_theta_deg < 80.1 && row.camera_theta_deg < 80.1) || i > 100) abort();
    fuzz_brdf_evaluate(reader, handle);
    reader->close(handle);
}

#endif
