/* The score of a reconstruction and its faults. Scores were compared with the smaller of recall and precision, and
 * limits chosen, on scans whose fibers are known (tests/bench/verdict). */
#include "geometry/grade/scan_grade.h"

#include <math.h>

/* Loss of score for each piece a fiber beyond the first. */
static const double PIECE_LOSS = 0.05;
/* Fibers in a line that holds several. Where the sections of all lines are uneven by more than the limit, and surely
 * where by 1 / SURELY_UNEVEN more, all lines are taken for such. */
static const double LEAST_HELD = 4.0, SURELY_UNEVEN = 10.0;
/* Loss of precision for each share of the length in lines that may be particles: others are a little longer. */
static const double PARTICLE_LOSS = 1.5;

static bool explains(const struct scan_coverage *c)
{
    bool enough = !(c->explained_share < GRADE_LEAST_EXPLAINED);
    for (int k = 0; k < COVERAGE_KINDS; k++)
        enough = enough && !(c->kind[k].share >= GRADE_KIND_SHARE && c->kind[k].explained_share < GRADE_LEAST_KIND);
    return enough;
}

static bool has_yarns(const struct section_misfit *m)
{
    return m->surface > SECTION_MOST_MISFIT || m->several_share > GRADE_MOST_SEVERAL;
}

status scan_grade_explain(const struct coverage_input *in, struct thread_pool *pool, struct scan_grade *grade,
                          float *safe, struct error *err)
{
    status s = scan_coverage_measure(in, pool, NULL, &grade->coverage, err);
    if (s != STATUS_OK) return s;
    s = section_misfit_measure(in->v, in->f, in->blur_voxel, pool, &grade->section, err);
    if (s != STATUS_OK) return s;
    fiber_likeness_measure(in->v, in->f, safe, &grade->likeness);
    const struct fiber_likeness *l = &grade->likeness;
    /* fmax and fmin take NaN for no share of such lines */
    const double all_uneven = fmin(1.0, SURELY_UNEVEN * fmax(0.0, grade->section.surface / SECTION_MOST_MISFIT - 1.0)),
                 held = fmax(all_uneven, fmax(0.0, grade->section.several_share)),
                 single = 1.0 / (1.0 + (LEAST_HELD - 1.0) * held),
                 fibers = fmax(0.0, 1.0 - PARTICLE_LOSS * l->particle_share) * (1.0 - grade->double_share) * single;
    grade->score = fmin(grade->coverage.fiber_share, fibers / (1.0 + PIECE_LOSS * (l->fragments - 1.0)));
    grade->faults = (explains(&grade->coverage) ? 0U : GRADE_UNEXPLAINED) |
                    (l->particle_share > GRADE_MOST_PARTICLES ? GRADE_PARTICLES : 0U) |
                    (grade->double_share > GRADE_MOST_DOUBLED ? GRADE_DOUBLED : 0U) |
                    (l->fragments > GRADE_MOST_FRAGMENTS ? GRADE_PIECES : 0U) |
                    (has_yarns(&grade->section) ? GRADE_SEVERAL : 0U);
    return STATUS_OK;
}
