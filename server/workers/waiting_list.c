#include "server/workers/waiting_list.h"

#include <stdio.h>
#include <string.h>

struct waiting *waiting_list_find(struct waiting_list *list, const char *job_id, bool make)
{
    struct waiting *oldest = &list->job[0];
    for (size_t i = 0; i < WAITING_LIST_MAX; i++) {
        if (strcmp(list->job[i].job_id, job_id) == 0) return &list->job[i];
        if (list->job[i].until_s < oldest->until_s) oldest = &list->job[i];
    }
    if (!make) return NULL;
    *oldest = (struct waiting){0};
    snprintf(oldest->job_id, sizeof oldest->job_id, "%s", job_id);
    return oldest;
}

bool waiting_list_holds(struct waiting_list *list, const char *job_id, double now_s)
{
    const struct waiting *w = waiting_list_find(list, job_id, false);
    return w != NULL && w->until_s > now_s;
}

size_t waiting_list_count(const struct waiting_list *list, double now_s)
{
    size_t n = 0;
    for (size_t i = 0; i < WAITING_LIST_MAX; i++) n += list->job[i].until_s > now_s;
    return n;
}
