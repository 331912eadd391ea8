#include "optimizer/job/document/job_file_name.h"
#include "optimizer/job/job_parse.h"
#include "tests/fuzz/fuzz_input.h"

#include <stdlib.h>
#include <string.h>

static void name_is_safe(void *context, const char *name, const char *role)
{
    (void)context;
    (void)role;
    if (!job_file_name_valid(name)) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct job_document *doc = NULL;
    struct error err = {0};
    status s = job_document_parse((const char *)data, size, &doc, &err);
    fuzz_check_error(s, &err);
    if (s != STATUS_OK) return 0;
    const struct job_sections section = job_document_sections(doc);
    job_sections_visit_files(&section, name_is_safe, NULL);
    job_document_free(doc);
    return 0;
}
