#include "optimizer/photographs/rows/tensor_file.h"

#include "base/files/durable.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_BYTES = 1 << 30, MAGIC_BYTES = 12 };

struct cursor {
    const char *at;
    size_t left;
};

/* Takes n bytes as a little-endian number; false at the end of the file. */
static bool take(struct cursor *c, size_t n, uint64_t *value)
{
    if (c->left < n) return false;
    *value = 0;
    for (size_t i = 0; i < n; i++) *value |= (uint64_t)(unsigned char)c->at[i] << (8 * i);
    c->at += n;
    c->left -= n;
    return true;
}

static size_t type_bytes(unsigned type) { return type == TENSOR_UINT8 ? 1 : type == TENSOR_FLOAT32 ? 4 : 0; }

/* Reads the header of a field. Returns the fault as text, or NULL. */
static const char *take_field(struct cursor *c, const char *bytes, size_t n_bytes, struct tensor_field *f)
{
    static const char *const ends = "it ends in its list of fields";
    uint64_t n_name, n_dim, type, offset;
    if (!take(c, 2, &n_name) || n_name > c->left) return ends;
    if (n_name >= sizeof f->name) return "a name of a field is too long";
    memcpy(f->name, c->at, n_name);
    f->name[n_name] = '\0';
    c->at += n_name;
    c->left -= n_name;
    if (!take(c, 2, &n_dim) || !take(c, 1, &type) || !take(c, 8, &offset)) return ends;
    if (n_dim > TENSOR_MAX_DIM) return "a field has more than 6 dimensions";
    f->n_dim = n_dim;
    f->type = (unsigned)type;
    f->n = 1;
    for (size_t i = 0; i < n_dim; i++) {
        uint64_t edge;
        if (!take(c, 8, &edge)) return ends;
        if (edge == 0 || edge > MAX_BYTES || f->n > MAX_BYTES / edge) return "a field is empty or too large";
        f->shape[i] = edge;
        f->n *= edge;
    }
    size_t each = type_bytes(f->type);
    if (offset > n_bytes || (each > 0 && f->n > (n_bytes - offset) / each))
        return "the data of a field lie beyond its end";
    f->data = bytes + offset;
    return NULL;
}

static const char *parse(struct tensor_file *t, size_t n_bytes)
{
    struct cursor c = {t->bytes, n_bytes};
    uint64_t version, n_field;
    if (n_bytes < MAGIC_BYTES || memcmp(t->bytes, "tensor_file", MAGIC_BYTES) != 0)
        return "it does not begin as an RGL file does";
    c.at += MAGIC_BYTES;
    c.left -= MAGIC_BYTES;
    if (!take(&c, 2, &version) || !take(&c, 4, &n_field)) return "it ends in its header";
    if (version != 1) return "it has another version than 1.0";
    if (n_field > TENSOR_MAX_FIELD) return "it has more than 32 fields";
    for (size_t i = 0; i < n_field; i++) {
        const char *fault = take_field(&c, t->bytes, n_bytes, &t->field[i]);
        if (fault != NULL) return fault;
        t->n_field++;
    }
    return NULL;
}

status tensor_file_read(const char *path, struct tensor_file *t, struct error *err)
{
    size_t n_bytes = 0;
    *t = (struct tensor_file){0};
    status s = file_read_all(path, MAX_BYTES, &t->bytes, &n_bytes, err);
    if (s != STATUS_OK) return s;
    const char *fault = parse(t, n_bytes);
    if (fault == NULL) return STATUS_OK;
    tensor_file_release(t);
    return error_set(err, STATUS_FORMAT, "cannot read measured BRDF '%s': %s", path_file_name(path), fault);
}

void tensor_file_release(struct tensor_file *t)
{
    free(t->bytes);
    *t = (struct tensor_file){0};
}

const struct tensor_field *tensor_file_find(const struct tensor_file *t, const char *name, unsigned type, size_t n_dim)
{
    for (size_t i = 0; i < t->n_field; i++)
        if (strcmp(t->field[i].name, name) == 0)
            return t->field[i].type == type && t->field[i].n_dim == n_dim ? &t->field[i] : NULL;
    return NULL;
}

double tensor_field_float(const struct tensor_field *f, size_t i)
{
    float value;
    memcpy(&value, f->data + 4 * i, sizeof value);
    return (double)value;
}
