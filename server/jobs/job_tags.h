/* Tags of a job: words by which users find it again. A tag has 1 to 40 bytes without spaces, commas and control
 * characters; a job has at most 16, in the order in which they were given. */
#ifndef SELVEDGE_SERVER_JOB_TAGS_H
#define SELVEDGE_SERVER_JOB_TAGS_H

#include "server/jobs/job_service.h"

/* list: a JSON array of tags, or NULL for none. field: its name in error texts. STATUS_INVALID. */
status job_tags_check(const json_t *list, const char *field, struct error *err);
/* The array of a row's tags; the caller owns it. */
json_t *job_tags_json(const struct job_row *row);

/* Removes tags and adds others. replace: removes all that are not added. The lists are checked. *changed: false if the
 * job had just these tags. STATUS_NOT_FOUND, STATUS_INVALID (too many). */
struct tag_edit {
    const json_t *add, *remove; /* NULL: none */
    bool replace;
};
status job_edit_tags(struct job_service *v, const char *id, const struct tag_edit *edit, bool *changed,
                     struct error *err);

#endif
