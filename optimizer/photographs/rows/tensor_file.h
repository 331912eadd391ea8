/* The container of RGL's measured BRDFs (Dupuy and Jakob 2018): "tensor_file", a zero byte, version 1.0 in two bytes,
 * the number of fields (32 bits), then for each field the length of its name (16 bits), the name, its number of
 * dimensions (16 bits), its type (8 bits), the place of its data in the file (64 bits) and its shape (64 bits each).
 * Little-endian, row-major. */
#ifndef SELVEDGE_OPTIMIZER_TENSOR_FILE_H
#define SELVEDGE_OPTIMIZER_TENSOR_FILE_H

#include "base/status.h"

#include <stdint.h>

enum { TENSOR_MAX_FIELD = 32, TENSOR_MAX_DIM = 6, TENSOR_UINT8 = 1, TENSOR_FLOAT32 = 10 };

struct tensor_field {
    char name[32];
    unsigned type;                          /* TENSOR_UINT8, TENSOR_FLOAT32, or another one that is not used here */
    size_t n_dim, shape[TENSOR_MAX_DIM], n; /* n: product of the shape */
    const char *data;                       /* not aligned */
};

struct tensor_file {
    char *bytes; /* the whole file */
    size_t n_field;
    struct tensor_field field[TENSOR_MAX_FIELD];
};

/* Reads a file of at most a gibibyte; the data of every field of the two types above lies inside it. STATUS_FORMAT with
 * the fault in words, and the errors of file_read_all. On failure there is nothing to release. */
status tensor_file_read(const char *path, struct tensor_file *t, struct error *err);
void tensor_file_release(struct tensor_file *t);
/* A field by name; NULL when there is none of this type and number of dimensions. */
const struct tensor_field *tensor_file_find(const struct tensor_file *t, const char *name, unsigned type, size_t n_dim);
/* Element i of a field of 32-bit floats. */
double tensor_field_float(const struct tensor_field *f, size_t i);

#endif
