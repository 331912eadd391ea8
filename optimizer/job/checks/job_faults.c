#include "optimizer/job/checks/job_faults.h"

#include <stdio.h>
#include <string.h>

void job_faults_add(struct job_fault_list *list, const struct error *fault)
{
    for (size_t i = 0; i < list->n; i++)
        if (strcmp(list->fault[i].field, fault->field) == 0 && strcmp(list->fault[i].text, fault->text) == 0) return;
    if (list->n == JOB_MAX_FAULT)
        list->n_more++;
    else
        list->fault[list->n++] = *fault;
}

json_t *job_faults_json(const struct job_fault_list *list)
{
    json_t *json = json_array();
    char text[64];
    for (size_t i = 0; i < list->n; i++)
        json_array_append_new(json, json_pack("{s:s, s:s, s:s}", "code", status_name(list->fault[i].code), "field",
                                              list->fault[i].field, "detail", list->fault[i].text));
    snprintf(text, sizeof text, "%zu more faults are not listed", list->n_more);
    if (list->n_more > 0)
        json_array_append_new(json, json_pack("{s:s, s:s, s:s}", "code", "too_large", "field", "", "detail", text));
    return json;
}
