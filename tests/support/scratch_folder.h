/* A folder for the files of one test, removed with everything in it. */
#ifndef SELVEDGE_TESTS_SCRATCH_FOLDER_H
#define SELVEDGE_TESTS_SCRATCH_FOLDER_H

#include <stddef.h>

/* cmocka set-up and tear-down: *state becomes the folder's path (char *). */
int scratch_folder_setup(void **state);
int scratch_folder_teardown(void **state);
/* folder/name in one of four buffers of the calling thread, used in turn. */
const char *scratch_path(void **state, const char *name);
/* Bytes to a file and back; fail the test when that does not work. The caller frees. */
void scratch_write(const char *path, const void *data, size_t n_bytes);
char *scratch_read(const char *path, size_t *n_bytes);
size_t scratch_count_entries(const char *folder);

#endif
