/* The verdict on a result: whether it can be used, and for what, in words and as a code
 * (base/catalogue/verdict_code.h). It is about the fit, and has nothing to do with the state of the job: a job that has
 * succeeded may have fitted a cloth that does not describe the photographs.
 *
 * The error that the measurements allow: the root mean square, over the judged rows and channels, of their relative
 * standard errors (in the unit of the relative RMS error, objective.h) and of VERDICT_LEAST_ERROR together. The error
 * of the fit is counted in multiples of the allowed error. The worst line that holds decides:
 *
 *   does not describe this cloth   above VERDICT_FAR multiples; or above the error of one color for all rows; or above
 *                                  twice the error of a plain BRDF, unless below VERDICT_NEAR multiples
 *   usable for pictures only       above VERDICT_NEAR multiples; above the error of a plain BRDF; judged by fitted rows
 *                                  alone; not converged; wrong derivatives; several solutions; a scan that does not
 *                                  show single fibers, or faults of its lines; warnings about the input. Pictures may
 *                                  be right with such a result, but its parameters are not to be quoted
 *   good but undetermined          some parameters are not determined, or lie at a bound; the others can be quoted
 *   good                           otherwise
 *
 * Two standard errors are subtracted from the error first, so noise of the rendering condemns nothing; only the
 * comparison with the plain BRDF is without them, so a fit that loses to it is never good. The rows that are judged are
 * not fitted where there are held-out rows, and nothing here is chosen by them.
 *
 * A fiber's profile has no held-out rows and no plain BRDF: its residual over all values is judged, by the allowed
 * error and by the stated errors alone; above VERDICT_NEAR of these it is usable for pictures only, unless the residual
 * is below VERDICT_LEAST_ERROR. Without a fit the grade of the scan decides: it does not describe the cloth if single
 * fibers are unresolved or its score is below GRADE_LEAST_SCORE, and is good if they are resolved and have no faults
 * (scan_grade.h). A job that renders given parameters is usable for pictures only at best, because nothing was
 * measured. */
#ifndef SELVEDGE_OPTIMIZER_VERDICT_H
#define SELVEDGE_OPTIMIZER_VERDICT_H

#include "base/catalogue/verdict_code.h"
#include "geometry/grade/scan_grade.h"
#include "optimizer/photographs/rows/observation.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

/* Relative error below which no photograph and no table is taken to be right as a whole, whatever errors it states:
 * certificates of reflectance standards alone state 1 to 2 %. */
#define VERDICT_LEAST_ERROR 0.02
/* Three standard errors are the usual limit of an explanation by noise. At ten, no choice of the assumed errors
 * matters. */
#define VERDICT_NEAR 3.0
#define VERDICT_FAR 10.0
#define VERDICT_PLAIN_BRDF_FACTOR 2.0

/* Whose result is judged: a fit to rows of a cloth, a fit to the profile of a fiber, the traced geometry alone, or
 * pictures of given parameters. */
enum verdict_kind { VERDICT_OF_FIT, VERDICT_OF_PROFILE, VERDICT_OF_GEOMETRY, VERDICT_OF_PICTURES };
enum verdict_rows { VERDICT_HELD_OUT, VERDICT_LEFT_OUT, VERDICT_FITTED }; /* rows that the error is about */
enum verdict_scan { VERDICT_NO_SCAN, VERDICT_SCAN_RESOLVED, VERDICT_SCAN_PARTLY, VERDICT_SCAN_UNRESOLVED };

enum { VERDICT_MAX_RESERVATION = 16, VERDICT_TEXT_BYTES = 480, VERDICT_WORDS_BYTES = 64 };

/* The facts behind a verdict. Texts are lists of names, "a, b, c", or "". */
struct verdict_facts {
    enum verdict_kind kind;  /* without a fit: all but scan, grade and n_input_warning is left out */
    enum verdict_rows rows;  /* of a fit to rows */
    double error, error_se;  /* relative RMS error over these rows */
    double allowed;          /* verdict_allowed_error */
    double one_color_error;  /* of one color for all rows; NaN: not known */
    double plain_brdf_error; /* over the same rows, left out in the same way; NaN: not known */
    double stated_multiple;  /* of a profile: residual over the stated errors, root mean square; NaN: none are stated */
    bool converged, derivatives_right, several_solutions;
    const char *not_determined, *at_bound;
    size_t n_undetermined; /* parameters and numbers that are in one of these lists, or both */
    const char *undetermined;
    enum verdict_scan scan;
    double scan_safe_share;
    const struct scan_grade *grade; /* faults of the lines; NULL: none are known */
    size_t n_input_warning;         /* warnings about the input and its geometry */
};

struct verdict_reservation {
    const char *code; /* a constant, "not_converged" */
    char text[VERDICT_TEXT_BYTES];
};

struct verdict {
    enum verdict_code code;
    enum verdict_kind kind;
    char words[VERDICT_WORDS_BYTES]; /* "good, but 2 parameters are undetermined" */
    char text[VERDICT_TEXT_BYTES];   /* one sentence */
    enum verdict_rows rows;
    double error, error_se, allowed, one_color_error, plain_brdf_error; /* as in the facts; NaN without a fit */
    size_t n_reservation;
    struct verdict_reservation reservation[VERDICT_MAX_RESERVATION];
};

void verdict_reach(const struct verdict_facts *facts, struct verdict *v);

/* "held_out", "cross_validation", "fitted". */
const char *verdict_rows_id(enum verdict_rows rows);

/* Returns the error that the measurements of the rows of one set allow, as above. NaN without rows. */
double verdict_allowed_error(const struct observation_set *o, enum job_set set);
/* Relative RMS error over the rows of `judged` of the one color that describes the rows of the set "fit" best. NaN
 * without rows. */
double verdict_one_color_error(const struct observation_set *o, enum job_set judged);

/* Returns the verdict as JSON, for the key "verdict" of result.json, status.json and the API's jobs:
 * {"code", "words", "text", "judged_by", "rel_rms", "rel_rms_se", "allowed_rel_rms", "one_color_rel_rms",
 * "plain_brdf_rel_rms", "reservations": [{"code", "text"}]}. The numbers are null without a fit; null as a whole when
 * there is nothing to judge. The caller owns it. */
json_t *verdict_json(const struct verdict *v);

#endif
