#include "renderer/mesh/mesh.h"
#include "tests/fuzz/fuzz_input.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct mesh m;
    struct error err = {0};
    fuzz_check_error(mesh_read_obj(fuzz_file(data, size), 1.0, &m, &err), &err);
    mesh_release(&m);
    return 0;
}
