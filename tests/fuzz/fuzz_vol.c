/* Reads Mitsuba grids as a scan and as directions. */
#include "geometry/volume/format/vol_file.h"
#include "tests/fuzz/fuzz_input.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_volume(&vol_reader, data, size);
    struct vol_header header;
    struct error err = {0};
    float *direction;
    fuzz_check_error(vol_read_direction(fuzz_file(data, size), &header, &direction, &err), &err);
    free(direction);
    return 0;
}
