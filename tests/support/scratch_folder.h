/* A folder for the files of one test. It is removed with its content at the end of the test. */
#ifndef SELVEDGE_TESTS_SCRATCH_FOLDER_H
#define SELVEDGE_TESTS_SCRATCH_FOLDER_H

#include <stddef.h>

/* cmocka set-up and tear-down: *state becomes the path of the folder (char *). */
int scratch_folder_setup(void **state);
int scratch_folder_teardown(void **state);
/* Returns folder/name in one of four buffers of the calling thread, used in turn. */
const char *scratch_path(void **state, const char *name);
/* Write bytes to a file and read them back; a failure fails the test. The caller frees what scratch_read returns. */
void scratch_write(const char *path, const void *data, size_t n_bytes);
char *scratch_read(const char *path, size_t *n_bytes);
size_t scratch_count_entries(const char *folder);

#endif
