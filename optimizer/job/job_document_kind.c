/* What a job does, by what its document has. */
#include "optimizer/job/job_document.h"

bool job_document_has_rows(const struct job_document *doc)
{
    return doc->n_photograph > 0 || doc->measurement_file[0] != '\0';
}

bool job_document_geometry_only(const struct job_document *doc)
{
    return !job_document_has_rows(doc) && doc->n_surface_picture == 0 && !job_document_of_profile(doc);
}

bool job_document_of_profile(const struct job_document *doc) { return doc->profile_file[0] != '\0' || doc->bowl.given; }

const char *job_document_profile_name(const struct job_document *doc)
{
    return doc->bowl.given ? doc->bowl.photograph[0].picture.file : doc->profile_file;
}

bool job_document_pictures_only(const struct job_document *doc)
{
    return !job_document_has_rows(doc) && doc->n_surface_picture > 0;
}
