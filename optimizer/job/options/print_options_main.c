/* print-options: the option table as JSON on standard output, for config/generate_options.py. */
#include "optimizer/job/options/option_json.h"

#include <stdio.h>

int main(void)
{
    json_t *options = job_options_json();
    int failed = options == NULL || json_dumpf(options, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(12)) != 0;
    json_decref(options);
    return failed;
}
