/* Rig files. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/camera/rig.h"
#include "tests/fuzz/fuzz_input.h"

#include <stdio.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct job_photograph photograph = {.file = "a.exr", .view = "v"};
    struct job_setup setup = {.black_sheet = size % 2 == 1};
    struct job_rows rows = {.n_photograph = 1, .photograph = &photograph};
    struct lens lens;
    struct marker_board board;
    struct error err = {0};
    fuzz_check_error(rig_apply(fuzz_file_as(".json", data, size), &setup, &rows, &lens, &board, &err), &err);
    return 0;
}
