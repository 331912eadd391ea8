/* Rig files. */
#include "optimizer/photographs/camera/rig.h"
#include "tests/fuzz/fuzz_input.h"

#include <stdio.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct job_photograph photograph = {.file = "a.exr", .view = "v"};
    struct job_document doc = {
        .rows.n_photograph = 1, .rows.photograph = &photograph, .setup.black_sheet = size % 2 == 1};
    struct lens lens;
    struct marker_board board;
    struct error err = {0};
    fuzz_check_error(rig_apply(fuzz_file_as(".json", data, size), &doc, &lens, &board, &err), &err);
    return 0;
}
