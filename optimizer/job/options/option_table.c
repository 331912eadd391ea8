#include "optimizer/job/options/option_table.h"
#include "optimizer/job/options/option_rows.h"

#include <string.h>

static const struct job_option *const part[] = {option_rows_cloth,   option_rows_described, option_rows_setup,
                                                option_rows_camera,  option_rows_profile,   option_rows_fit,
                                                option_rows_pictures};

const struct job_option *job_option_part(size_t i) { return i < sizeof part / sizeof part[0] ? part[i] : NULL; }

const struct job_option *job_option_at(size_t i)
{
    JOB_OPTION_EACH(row) if (i-- == 0) return row;
    return NULL;
}

const struct job_option *job_option_find(const char *path)
{
    JOB_OPTION_EACH(row) if (strcmp(row->path, path) == 0) return row;
    return NULL;
}

const char *job_option_key_in(const struct job_option *row, const char *section)
{
    size_t n = strlen(section);
    const char *key = row->path;
    if (n > 0) {
        if (strncmp(key, section, n) != 0 || key[n] != '.') return NULL;
        key += n + 1;
    }
    return key[0] == '\0' || strpbrk(key, ".[") != NULL ? NULL : key;
}

const char *job_option_choice(const struct job_option *row, size_t i)
{
    if (row->choice_at != NULL) return row->choice_at(i);
    return row->choice != NULL ? row->choice[i] : NULL;
}
