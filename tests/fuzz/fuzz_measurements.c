#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/rows/measurement_table.h"
#include "tests/fuzz/fuzz_input.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct job_setup setup = {
        .black_sheet = true, .lamp_side_cm = 10, .lamp_distance_cm = 61, .camera_distance_cm = 100, .crop_cm = 1};
    struct observation_set o;
    struct error err = {0};
    char *text = malloc(size + 1);
    if (text == NULL) abort();
    memcpy(text, data, size);
    text[size] = '\0';
    observation_set_init(&o);
    fuzz_check_error(measurement_table_parse(text, size, "table.csv", &setup, &o, &err), &err);
    observation_set_release(&o);
    free(text);
    return 0;
}
