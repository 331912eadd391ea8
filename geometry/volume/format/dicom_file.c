#include "geometry/volume/format/dicom_file.h"
#include "base/option_id.h"
#include "geometry/volume/format/voxel_stream.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { PREAMBLE = 128, MAX_DEPTH = 8, MAX_ELEMENTS = 1 << 20, MAX_FRAMES = 1 << 20, TEXT = 256 };
#define UNDEFINED 0xffffffffu

struct reader {
    FILE *file;
    struct dicom_file *f;
    const char *name;
    bool big, is_implicit, is_done; /* of the elements that come; the samples were met */
    size_t n_element;
    uint64_t file_bytes;
};

struct element {
    uint32_t tag, length;
    char vr[3];
};

static status refuse(const struct reader *r, const char *text, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': %s", r->name, text);
}

static uint32_t number(const uint8_t *b, size_t n, bool big)
{
    uint32_t v = 0;
    for (size_t i = 0; i < n; i++) v |= (uint32_t)b[i] << 8 * (big ? n - 1 - i : i);
    return v;
}

static bool has_long_length(const char *vr)
{
    static const char list[] = "OB OD OF OL OV OW SQ UC UN UR UT SV UV";
    return strstr(list, vr) != NULL;
}

/* Returns false at the end of the file. */
static bool read_element(struct reader *r, struct element *e)
{
    uint8_t b[8], more[4];
    if (fread(b, 1, 8, r->file) != 8) return false;
    e->tag = number(b, 2, r->big) << 16 | number(b + 2, 2, r->big);
    const bool is_bare = e->tag >> 16 == 0xfffe || (r->is_implicit && e->tag >> 16 != 2);
    memcpy(e->vr, is_bare ? "??" : (const char *)b + 4, 2);
    e->vr[2] = '\0';
    e->length = is_bare ? number(b + 4, 4, r->big) : number(b + 6, 2, r->big);
    if (is_bare || !has_long_length(e->vr)) return true;
    if (fread(more, 1, 4, r->file) != 4) return false;
    e->length = number(more, 4, r->big);
    return true;
}

/* ---- values ---- */

static void to_numbers(const char *text, size_t n, double *out)
{
    for (size_t i = 0; i < n; i++) {
        char *end;
        const double v = strtod(text, &end);
        if (end == text || !isfinite(v)) return;
        out[i] = v;
        text = end + strspn(end, " ");
        if (*text++ != '\\') return;
    }
}

static void copy_text(char *out, size_t n, const char *text)
{
    snprintf(out, n, "%s", text);
    for (size_t k = strlen(out); k > 0 && out[k - 1] == ' '; k--) out[k - 1] = '\0';
}

static status add_position(struct reader *r, const char *text, struct error *err)
{
    struct dicom_file *f = r->f;
    double at[3] = {NAN, NAN, NAN};
    to_numbers(text, 3, at);
    if (isnan(at[2]) || f->n_position == MAX_FRAMES) return refuse(r, "a position of a frame is no three numbers", err);
    if ((f->n_position & (f->n_position - 1)) == 0) {
        void *more = realloc(f->position, (f->n_position > 0 ? 2 * f->n_position : 1) * sizeof *f->position);
        if (more == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
        f->position = more;
    }
    memcpy(f->position[f->n_position++], at, sizeof at);
    return STATUS_OK;
}

/* Takes numbers that are the same for all frames of a file. */
static status take_once(const struct reader *r, const char *text, size_t n, double *out, struct error *err)
{
    double stated[6] = {NAN, NAN, NAN, NAN, NAN, NAN};
    to_numbers(text, n, stated);
    for (size_t i = 0; i < n; i++) {
        if (!isnan(out[i]) && out[i] != stated[i])
            return refuse(r, "its frames have different scales, directions or spacings: save them apart", err);
        out[i] = stated[i];
    }
    return STATUS_OK;
}

/* Takes a value of the group 0028, which is about samples. */
static status take_of_samples(struct reader *r, uint32_t tag, const char *text, uint32_t u, struct error *err)
{
    struct dicom_file *f = r->f;
    const struct {
        uint32_t tag;
        size_t *to;
    } whole[] = {{0x00280002, &f->samples_per_pixel}, {0x00280010, &f->rows},        {0x00280011, &f->columns},
                 {0x00280100, &f->bits_allocated},    {0x00280101, &f->bits_stored}, {0x00280102, &f->high_bit}};
    for (size_t i = 0; i < sizeof whole / sizeof *whole; i++)
        if (tag == whole[i].tag) *whole[i].to = u;
    if (tag == 0x00280004) copy_text(f->photometric, sizeof f->photometric, text);
    if (tag == 0x00280008) f->n_frame = strtoul(text, NULL, 10);
    if (tag == 0x00280103) f->is_signed = u == 1;
    if (tag == 0x00280009) { /* FrameTime, FrameTimeVector */
        const uint32_t by = number((const uint8_t *)text + 2, 2, r->big);
        f->has_times = number((const uint8_t *)text, 2, r->big) == 0x0018 && (by == 0x1063 || by == 0x1065);
    }
    if (tag == 0x00280120) f->padding = f->is_signed ? (double)(int16_t)u : (double)u;
    if (tag == 0x00280121) f->padding_limit = f->is_signed ? (double)(int16_t)u : (double)u;
    if (tag == 0x00281050) to_numbers(text, 1, &f->window_center);
    if (tag == 0x00281051) to_numbers(text, 1, &f->window_width);
    if (tag == 0x00282110) f->is_lossy = strncmp(text, "01", 2) == 0;
    if (tag == 0x00280030) return take_once(r, text, 2, f->spacing_mm, err);
    if (tag == 0x00281052) return take_once(r, text, 1, &f->inter, err);
    return tag == 0x00281053 ? take_once(r, text, 1, &f->slope, err) : STATUS_OK;
}

/* Takes a short value: text that ends in NUL, or whole numbers. */
static status take(struct reader *r, uint32_t tag, const char *text, size_t n, struct error *err)
{
    struct dicom_file *f = r->f;
    if (tag >> 16 == 0x0028)
        return take_of_samples(r, tag, text, number((const uint8_t *)text, n < 4 ? 2 : 4, r->big), err);
    if (tag == 0x00020010) copy_text(f->syntax, sizeof f->syntax, text);
    if (tag == 0x00080060) copy_text(f->modality, sizeof f->modality, text);
    if (tag == 0x0008103e) copy_text(f->description, sizeof f->description, text);
    if (tag == 0x00180050) to_numbers(text, 1, &f->thickness_mm);
    if (tag == 0x00180088) to_numbers(text, 1, &f->between_slices_mm);
    if (tag == 0x00181164) to_numbers(text, 2, f->detector_mm);
    if (tag == 0x0020000e) copy_text(f->series, sizeof f->series, text);
    if (tag == 0x00200013) to_numbers(text, 1, &f->instance);
    if (tag == 0x00200037) return take_once(r, text, 6, f->direction, err);
    return tag == 0x00200032 ? add_position(r, text, err) : STATUS_OK;
}

/* ---- the structure ---- */

static status read_elements(struct reader *r, int depth, uint64_t end, bool is_used, struct error *err);

/* The functional groups of files with several frames, and what lies in them. */
static bool is_group(uint32_t tag) { return tag == 0x52009229 || tag == 0x52009230; }

static status read_value(struct reader *r, const struct element *e, struct error *err)
{
    char text[TEXT + 1] = "";
    if (e->length > TEXT)
        return fseeko(r->file, e->length, SEEK_CUR) == 0 ? STATUS_OK : refuse(r, "it is cut off", err);
    if (fread(text, 1, e->length, r->file) != e->length) return refuse(r, "it is cut off", err);
    return take(r, e->tag, text, e->length, err);
}

/* Reads the element, whose header is read. Elements of other sequences than functional groups are passed over. */
static status read_content(struct reader *r, const struct element *e, int depth, bool is_used, struct error *err)
{
    const uint64_t here = (uint64_t)ftello(r->file);
    const bool is_nested =
        strcmp(e->vr, "SQ") == 0 || e->length == UNDEFINED || e->tag == 0xfffee000 || is_group(e->tag);
    if (e->tag == 0x7fe00010 && depth == 0) {
        r->is_done = true;
        r->f->pixel_offset = (long long)here;
        r->f->pixel_bytes = e->length;
        return e->length == UNDEFINED ? refuse(r, "its samples are compressed", err) : STATUS_OK;
    }
    if (e->tag == 0x00283000 && depth == 0) r->f->has_table = true;
    if (e->length != UNDEFINED && here + e->length > r->file_bytes) return refuse(r, "it is cut off", err);
    if (!is_nested && is_used) return read_value(r, e, err);
    if (!is_nested) return fseeko(r->file, e->length, SEEK_CUR) == 0 ? STATUS_OK : refuse(r, "it is cut off", err);
    if (depth == MAX_DEPTH) return refuse(r, "its sequences are too deep", err);
    const bool inside = depth == 0 ? is_group(e->tag) : is_used;
    return read_elements(r, depth + 1, e->length == UNDEFINED ? 0 : here + e->length, inside, err);
}

static status check_syntax(struct reader *r, struct error *err)
{
    const char *uid = r->f->syntax;
    r->is_implicit = r->f->is_implicit = strcmp(uid, "1.2.840.10008.1.2") == 0;
    r->big = r->f->big = strcmp(uid, "1.2.840.10008.1.2.2") == 0;
    if (r->big || r->is_implicit || strcmp(uid, "1.2.840.10008.1.2.1") == 0) return STATUS_OK;
    const char *what = strncmp(uid, "1.2.840.10008.1.2.4.9", 21) == 0   ? "JPEG 2000"
                       : strncmp(uid, "1.2.840.10008.1.2.4.8", 21) == 0 ? "JPEG-LS"
                       : strncmp(uid, "1.2.840.10008.1.2.4", 19) == 0   ? "JPEG"
                       : strcmp(uid, "1.2.840.10008.1.2.5") == 0        ? "RLE"
                       : strcmp(uid, "1.2.840.10008.1.2.1.99") == 0     ? "deflate"
                                                                        : "an unknown method";
    return error_set_field(err, STATUS_UNSUPPORTED, OPTION_SCAN_FILES,
                           "cannot read volume '%s': it is compressed by %s (transfer syntax '%s'): save it without "
                           "compression, as `gdcmconv --raw` does",
                           r->name, what, uid);
}

/* Reads elements up to `end` bytes of the file; 0: up to the end of an item or a sequence, or of the file. */
static status read_elements(struct reader *r, int depth, uint64_t end, bool is_used, struct error *err)
{
    struct element e;
    bool is_meta = depth == 0;
    while (!r->is_done && (end == 0 || (uint64_t)ftello(r->file) < end)) {
        const off_t start = ftello(r->file);
        if (!read_element(r, &e)) return depth == 0 ? STATUS_OK : refuse(r, "it is cut off", err);
        if (is_meta && e.tag >> 16 != 2) { /* the data set begins, in the byte order of its syntax */
            status s = check_syntax(r, err);
            if (s != STATUS_OK) return s;
            is_meta = false;
            if (fseeko(r->file, start, SEEK_SET) != 0) return refuse(r, "it is cut off", err);
            continue;
        }
        if (depth > 0 && (e.tag == 0xfffee00d || e.tag == 0xfffee0dd)) return STATUS_OK;
        if (++r->n_element > MAX_ELEMENTS) return refuse(r, "it has too many elements", err);
        status s = read_content(r, &e, depth, is_used, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

/* ---- the file ---- */

static status check_frames(const struct reader *r, struct error *err)
{
    const struct dicom_file *f = r->f;
    const size_t bits = f->bits_allocated;
    const bool is_grey = strcmp(f->photometric, "MONOCHROME2") == 0 || strcmp(f->photometric, "MONOCHROME1") == 0;
    if (f->pixel_offset == 0) return refuse(r, "it has no samples (or is no DICOM)", err);
    if (f->samples_per_pixel != 1 || !is_grey)
        return error_set_field(
            err, STATUS_FORMAT, OPTION_SCAN_FILES,
            "cannot read volume '%s': it has colors ('%s', %zu samples a pixel): save its densities as "
            "one grey value a voxel",
            r->name, f->photometric, f->samples_per_pixel);
    if ((bits != 8 && bits != 16 && bits != 32) || f->bits_stored < 1 || f->bits_stored > bits ||
        f->high_bit + 1 != f->bits_stored)
        return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                               "cannot read volume '%s': %zu bits stored in %zu, the highest of which is %zu, are not "
                               "read",
                               r->name, f->bits_stored, bits, f->high_bit);
    if (f->has_table) return refuse(r, "a table gives its values (ModalityLUTSequence): save the values", err);
    if (f->has_times) return refuse(r, "its frames are times of one slice: a scan has slices", err);
    if (f->rows < 1 || f->rows > VOXEL_STREAM_MAX_EDGE || f->columns < 1 || f->columns > VOXEL_STREAM_MAX_EDGE ||
        f->n_frame < 1 || f->n_frame > MAX_FRAMES || (uint64_t)f->rows * f->columns * (bits / 8) > UINT32_MAX)
        return refuse(r, "it states an impossible size", err);
    const uint64_t row = (uint64_t)f->columns * (bits / 8), want = row * f->rows * f->n_frame;
    if (want > f->pixel_bytes || (uint64_t)f->pixel_offset + want > r->file_bytes)
        return refuse(r, "it is too short for its frames", err);
    if (f->pixel_bytes > want + 1 && f->pixel_bytes >= want + row)
        return refuse(r, "its samples are longer than its frames", err);
    return STATUS_OK;
}

bool dicom_file_begins(const uint8_t b[16], const char *path)
{
    char magic[4] = "";
    if (memcmp(b, "\2\0\0\0UL\4", 8) == 0) return true;
    FILE *file = fopen(path, "rbe");
    const bool found = file != NULL && fseeko(file, PREAMBLE, SEEK_SET) == 0 && fread(magic, 1, 4, file) == 4 &&
                       memcmp(magic, "DICM", 4) == 0;
    if (file != NULL) fclose(file);
    return found;
}

status dicom_file_read(struct dicom_file *f, const char *path, const char *name, struct error *err)
{
    struct reader r = {.f = f, .name = name};
    struct stat st;
    char magic[4] = "";
    *f = (struct dicom_file){.n_frame = 1,
                             .samples_per_pixel = 1,
                             .spacing_mm = {NAN, NAN},
                             .between_slices_mm = NAN,
                             .thickness_mm = NAN,
                             .slope = NAN,
                             .inter = NAN,
                             .padding = NAN,
                             .padding_limit = NAN,
                             .detector_mm = {NAN, NAN},
                             .window_center = NAN,
                             .window_width = NAN,
                             .instance = NAN,
                             .direction = {NAN, NAN, NAN, NAN, NAN, NAN}};
    r.file = fopen(path, "rbe");
    if (r.file == NULL || fstat(fileno(r.file), &st) != 0) {
        status s = error_set_errno_at(err, __func__, OPTION_SCAN_FILES, "cannot read volume '%s'", name);
        if (r.file != NULL) fclose(r.file);
        return s;
    }
    r.file_bytes = (uint64_t)st.st_size;
    const bool has_preamble =
        fseeko(r.file, PREAMBLE, SEEK_SET) == 0 && fread(magic, 1, 4, r.file) == 4 && memcmp(magic, "DICM", 4) == 0;
    if (!has_preamble) rewind(r.file);
    status s = read_elements(&r, 0, 0, true, err);
    if (s == STATUS_OK) s = check_frames(&r, err);
    fclose(r.file);
    return s;
}

void dicom_file_release(struct dicom_file *f)
{
    free(f->position);
    *f = (struct dicom_file){0};
}
