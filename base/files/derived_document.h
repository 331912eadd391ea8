/* The document of a job that shows the result of a finished job without a new fit: pictures on surfaces, the twin for a
 * browser, files for other programs. It has the fibers of the finished job as a file, its parameters as fixed ones, and
 * its result, from which exports have their rows. */
#ifndef SELVEDGE_BASE_DERIVED_DOCUMENT_H
#define SELVEDGE_BASE_DERIVED_DOCUMENT_H

#include "base/status.h"

#include <jansson.h>
#include <stdbool.h>

#define DERIVED_FIBERS "fibers.hair"
#define DERIVED_RESULT "result.json"
#define DERIVED_REPORT "report.html"

/* The files of the new job that come from the finished one. */
struct derived_files {
    const char *result; /* of the inputs of the finished job, borrowed from its document; NULL: DERIVED_RESULT of its
                                results */
    const char *environment; /* of its inputs, borrowed; NULL: none */
    bool report;             /* DERIVED_REPORT of its results, from which a PDF is made */
};

/* Makes the document. document, result: of the finished job. wanted: an object with `pictures`, `twin` and `export` as
 * in a job document, at least one of them, and optionally `sample`, `lamp`, `environment`, `camera` and `black_sheet`,
 * which otherwise are those of the finished job. The caller releases *out; it still has to be checked as every other
 * document. files: the files that the new job needs, besides DERIVED_FIBERS of the results. STATUS_INVALID: the job has
 * no parameters, or `wanted` (whose key is err->field) has no or other members. */
status derived_document_make(const json_t *document, const json_t *result, const json_t *wanted, json_t **out,
                             struct derived_files *files, struct error *err);

#endif
