/* TIFF stacks of known values in a temporary folder, for the tests of the reader. */
#ifndef SELVEDGE_TESTS_TIFF_STACK_H
#define SELVEDGE_TESTS_TIFF_STACK_H

#include "geometry/volume/format/volume_source.h"
#include "tests/support/scan/scan_files.h"

enum { STACK_WIDTH = 37, STACK_HEIGHT = 23, STACK_PAGES = 4 };

/* cmocka set-up of a group of tests: makes the folder. */
int stack_folder_setup(void **state);
/* Path of a file in it. */
void stack_path(char path[128], const char *name);
/* Samples of one page: whole numbers of 8 or 16 bits, or floating point of 32 bits. The caller frees them. */
void *stack_pixels(size_t page, uint16_t bits);
/* Writes the first n_page pages as one file. */
void stack_write(const char *path, uint16_t bits, size_t n_page, uint16_t compression, enum test_tiff_layout layout);
/* Fails the test unless the files together are the whole stack. */
void stack_check(const char *const *path, size_t n_path, uint16_t bits);
/* Fails the test unless opening the file fails with this code, a text that contains `text`, and the field
 * OPTION_SCAN_FILES. */
void stack_expect_open_error(const char *path, status code, const char *text);
/* Reads a file of fewer than `room` bytes into data. Returns the number of bytes. */
size_t tiff_read_bytes(const char *path, uint8_t *data, size_t room);
/* Changes the value of a tag of the first page. */
void tiff_patch_tag(uint8_t *data, uint16_t tag, uint32_t value);

#endif
