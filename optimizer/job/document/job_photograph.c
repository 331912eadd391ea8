#include "optimizer/job/document/job_photograph.h"

#include <stdio.h>
#include <string.h>

enum { LONGEST_STEM = 100 };

void job_photograph_name(const struct job_photograph *p, char name[JOB_MAX_NAME_BYTES])
{
    const char *dot = strrchr(p->file, '.');
    const int n_stem = (int)(dot != NULL ? (size_t)(dot - p->file) : strlen(p->file));
    if (p->column.number == 0)
        snprintf(name, JOB_MAX_NAME_BYTES, "%s", p->file);
    else
        snprintf(name, JOB_MAX_NAME_BYTES, "%.*s-c%02zu%.16s", n_stem < LONGEST_STEM ? n_stem : LONGEST_STEM, p->file,
                 p->column.number, dot != NULL ? dot : "");
}
