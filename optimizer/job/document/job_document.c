#include "optimizer/job/document/job_document.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/job_setup.h"

#include <stdlib.h>

static void release_sections(struct job_document *doc)
{
    free(doc->scan);
    free(doc->cloth);
    free(doc->setup);
    free(doc->rows);
    free(doc->profile);
    free(doc->fit);
    free(doc->results);
}

struct job_document *job_document_new(void)
{
    struct job_document *doc = calloc(1, sizeof *doc);
    if (doc == NULL) return NULL;
    doc->scan = calloc(1, sizeof *doc->scan);
    doc->cloth = calloc(1, sizeof *doc->cloth);
    doc->setup = calloc(1, sizeof *doc->setup);
    doc->rows = calloc(1, sizeof *doc->rows);
    doc->profile = calloc(1, sizeof *doc->profile);
    doc->fit = calloc(1, sizeof *doc->fit);
    doc->results = calloc(1, sizeof *doc->results);
    if (doc->scan != NULL && doc->cloth != NULL && doc->setup != NULL && doc->rows != NULL && doc->profile != NULL &&
        doc->fit != NULL && doc->results != NULL)
        return doc;
    release_sections(doc);
    free(doc);
    return NULL;
}

void job_document_free(struct job_document *doc)
{
    if (doc == NULL) return;
    free(doc->scan->file);
    free(doc->cloth->yarn);
    free(doc->cloth->description);
    for (size_t i = 0; i < doc->rows->n_photograph; i++) free(doc->rows->photograph[i].exposure);
    free(doc->rows->photograph);
    for (size_t i = 0; i < doc->profile->bowl.n_photograph; i++)
        free(doc->profile->bowl.photograph[i].picture.exposure);
    free(doc->profile->bowl.photograph);
    free(doc->profile->bowl.mark);
    free(doc->rows->measured_row);
    free(doc->setup->dark_frame);
    free(doc->fit->candidate);
    free(doc->results->surface_picture);
    release_sections(doc);
    free(doc);
}

struct job_sections job_document_sections(const struct job_document *doc)
{
    return (struct job_sections){.scan = doc->scan,
                                 .cloth = doc->cloth,
                                 .setup = doc->setup,
                                 .rows = doc->rows,
                                 .profile = doc->profile,
                                 .fit = doc->fit,
                                 .results = doc->results};
}
