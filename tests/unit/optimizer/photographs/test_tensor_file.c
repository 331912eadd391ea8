/* Files of tensors, as RGL's measured reflectances are, byte by byte: their fields, and each fault of their headers. */
#include "optimizer/photographs/rows/tensor_file.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct bytes {
    char at[4096];
    size_t n;
};

static void put(struct bytes *b, uint64_t value, size_t n)
{
    for (size_t i = 0; i < n; i++) b->at[b->n++] = (char)(value >> (8 * i) & 0xff);
}

static void put_head(struct bytes *b, uint64_t version, uint64_t n_field)
{
    b->n = 0;
    memcpy(b->at, "tensor_file", 12);
    b->n = 12;
    put(b, version, 2);
    put(b, n_field, 4);
}

/* shape ends with 0. */
static void put_field(struct bytes *b, const char *name, unsigned type, uint64_t offset, const uint64_t *shape)
{
    uint64_t n_dim = 0;
    while (shape[n_dim] != 0) n_dim++;
    put(b, strlen(name), 2);
    memcpy(b->at + b->n, name, strlen(name));
    b->n += strlen(name);
    put(b, n_dim, 2);
    put(b, type, 1);
    put(b, offset, 8);
    for (size_t i = 0; i < n_dim; i++) put(b, shape[i], 8);
}

#define SHAPE(...) ((const uint64_t[]){__VA_ARGS__, 0})

static void refuse(void **state, const struct bytes *b, size_t n, const char *why)
{
    struct tensor_file t;
    struct error err = {0};
    const char *path = scratch_path(state, "bad.bsdf");
    scratch_write(path, b->at, n);
    assert_int_equal(tensor_file_read(path, &t, &err), STATUS_FORMAT);
    if (strstr(err.text, "bad.bsdf") == NULL || strstr(err.text, why) == NULL)
        fail_msg("'%s' lacks '%s'", err.text, why);
}

static void test_fields(void **state)
{
    struct bytes b;
    struct tensor_file t;
    const float value[6] = {1, -2, 3.5f, 4, 5, 6};
    const char *path = scratch_path(state, "good.bsdf");
    put_head(&b, 1, 3);
    put_field(&b, "values", TENSOR_FLOAT32, 200, SHAPE(2, 3));
    put_field(&b, "text", TENSOR_UINT8, 224, SHAPE(5));
    put_field(&b, "other", 3, 229, SHAPE(9, 9)); /* a type that nobody reads */
    memcpy(b.at + 200, value, sizeof value);
    memcpy(b.at + 224, "hello", 5);
    scratch_write(path, b.at, 229);
    assert_int_equal(tensor_file_read(path, &t, NULL), STATUS_OK);
    assert_int_equal(t.n_field, 3);
    const struct tensor_field *f = tensor_file_find(&t, "values", TENSOR_FLOAT32, 2);
    assert_true(f != NULL && f->n == 6 && f->shape[0] == 2 && f->shape[1] == 3);
    for (size_t i = 0; i < 6; i++) assert_true(tensor_field_float(f, i) == (double)value[i]);
    const struct tensor_field *text = tensor_file_find(&t, "text", TENSOR_UINT8, 1);
    assert_true(text != NULL && text->n == 5 && memcmp(text->data, "hello", 5) == 0);
    assert_null(tensor_file_find(&t, "values", TENSOR_UINT8, 2));
    assert_null(tensor_file_find(&t, "values", TENSOR_FLOAT32, 1));
    assert_null(tensor_file_find(&t, "value", TENSOR_FLOAT32, 2));
    tensor_file_release(&t);
    assert_true(t.bytes == NULL && t.n_field == 0);
    for (size_t n = 12; n < 100; n++) /* cut in its list of fields */
        if (n < b.n) refuse(state, &b, n, n < 18 ? "it ends in its header" : "");
    refuse(state, &b, 228, "the data of a field lie beyond its end");
    refuse(state, &b, 223, "the data of a field lie beyond its end");
}

static void test_faults(void **state)
{
    static const struct {
        uint64_t shape[9], offset;
        const char *why;
    } check[] = {
        {{1, 0}, 1024, "beyond its end"},
        {{1, 0}, 1021, "beyond its end"},
        {{256, 0}, 1, "beyond its end"},
        {{16, 17, 0}, 0, "beyond its end"},
        {{1ULL << 62, 0}, 0, "empty or too large"},
        {{1ULL << 28, 1ULL << 28, 1ULL << 28, 0}, 0, "empty or too large"},
        {{1, 1, 1, 1, 1, 1, 1, 0}, 0, "more than 6 dimensions"},
        {{1, 0}, UINT64_MAX, "beyond its end"},
    };
    struct bytes b = {.n = 0};
    for (size_t i = 0; i < sizeof check / sizeof *check; i++) {
        put_head(&b, 1, 1);
        put_field(&b, "f", TENSOR_FLOAT32, check[i].offset, check[i].shape);
        refuse(state, &b, 1024, check[i].why);
    }
    put_head(&b, 1, 1);
    put_field(&b, "f", TENSOR_FLOAT32, 0, SHAPE(3, 1));
    memset(b.at + b.n - 8, 0, 8); /* an edge of 0 */
    refuse(state, &b, 1024, "empty or too large");
    put_head(&b, 2, 0);
    refuse(state, &b, 100, "another version");
    put_head(&b, 1, 33);
    refuse(state, &b, 1024, "more than 32 fields");
    put_head(&b, 1, 1);
    b.at[3] = 'x';
    refuse(state, &b, 1024, "does not begin as an RGL file");
    refuse(state, &b, 11, "does not begin as an RGL file");
    put_head(&b, 1, 1);
    char name[3000];
    memset(name, 'n', sizeof name - 1);
    name[sizeof name - 1] = '\0';
    put_field(&b, name, TENSOR_FLOAT32, 0, SHAPE(1));
    refuse(state, &b, 4096, "a name of a field is too long");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_fields), cmocka_unit_test(test_faults)};
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
