/* Job documents for tests of the parser: pieces of text, and what a document must give. Included after cmocka.h. */
#ifndef SELVEDGE_TESTS_JOB_DOCUMENT_TEXT_H
#define SELVEDGE_TESTS_JOB_DOCUMENT_TEXT_H

#include "optimizer/job/job_parse.h"

#define PHOTO                                                                                                          \
    "{\"file\":\"p0.exr\",\"set\":\"fit\",\"light_theta_deg\":20,\"light_phi_deg\":0,\"camera_theta_deg\":30,"         \
    "\"camera_phi_deg\":180}"
#define VOLUME "\"volume\":{\"files\":[\"scan.tif\"],\"voxel_size_um\":2}"
#define FIT_OF(fit) "{\"sample\":\"s\"," VOLUME ",\"photographs\":[" PHOTO "],\"fit\":" fit "}"
#define VOLUME_OF(extra)                                                                                               \
    "{\"sample\":\"s\",\"volume\":{\"files\":[\"scan.tif\"]," extra "},\"photographs\":[" PHOTO "]}"
/* A fiber file of the groups warp and weft. */
#define GROUPS_OF(fit)                                                                                                 \
    "{\"sample\":\"s\",\"fibers\":{\"file\":\"c.hair\",\"groups\":[\"warp\",\"weft\"]},\"photographs\":[" PHOTO        \
    "],\"fit\":" fit "}"
#define FIBERS_OF(extra) "{\"sample\":\"s\",\"fibers\":{\"file\":\"c.hair\"," extra "},\"photographs\":[" PHOTO "]}"
#define PHOTO_OF(extra)                                                                                                \
    "{\"sample\":\"s\"," VOLUME                                                                                        \
    ",\"photographs\":[{\"file\":\"p0.exr\",\"light_phi_deg\":0,\"camera_phi_deg\":180," extra "}]}"

/* The document is refused: the error has this field, and its text holds this part. */
static inline void job_document_check_error(const char *text, const char *field, const char *part)
{
    struct job_document *doc = NULL;
    struct error err = {0};
    assert_int_equal(job_document_parse(text, strlen(text), &doc, &err), STATUS_INVALID);
    assert_null(doc);
    assert_string_equal(err.field, field);
    if (strstr(err.text, part) == NULL) fail_msg("'%s' is not in '%s'", part, err.text);
}

/* The document is accepted; the caller frees it. */
static inline struct job_document *job_document_of_text(const char *text)
{
    struct job_document *doc = NULL;
    struct error err = {0};
    if (job_document_parse(text, strlen(text), &doc, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
    return doc;
}

#endif
