#include "optimizer/worker/check/input_check.h"
#include "optimizer/job/options/option_key.h"

#include <stdio.h>
#include <sys/stat.h>

void input_check_fault(struct input_check *c, const struct error *fault)
{
    struct error named = *fault;
    job_option_name_field(named.code, &named);
    job_faults_add(c->fault, &named);
}

void input_check_warn(void *context, const char *option, const char *text)
{
    struct input_check *c = context;
    char key[64];
    job_option_resolve(option, key, sizeof key);
    json_array_append_new(c->warnings, json_pack("{s:s, s:s}", "field", key, "detail", text));
}

bool input_check_has(const struct input_check *c, const char *name)
{
    char path[INPUT_PATH_BYTES];
    struct stat file;
    input_check_path(c, name, path);
    return name[0] != '\0' && stat(path, &file) == 0 && S_ISREG(file.st_mode) && file.st_size > 0;
}

void input_check_path(const struct input_check *c, const char *name, char path[INPUT_PATH_BYTES])
{
    snprintf(path, INPUT_PATH_BYTES, "%s/%s", c->folder, name);
}
