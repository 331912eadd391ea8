#include "geometry/volume/format/nifti_header.h"
#include "base/option_id.h"

#include <math.h>
#include <string.h>

/* Places of the fields in bytes. A whole number of NIfTI-1 has 2 bytes in `dim` and in the codes; see `field`. */
struct places {
    size_t datatype, dim, dim_bytes, pixdim, real_bytes, vox_offset, offset_is_real, scl_slope, scl_inter, cal_max,
        cal_min, slice_duration, toffset, slice_code, code_bytes, xyzt_units, intent_code, qform_code, sform_code,
        form_bytes, quatern, qoffset, srow, descrip, aux_file, intent_name;
};

static const struct places nifti_1 = {70,  40, 2,   76, 4,   108, 1, 112, 116, 124, 128, 132, 136,
                                      122, 1,  123, 68, 252, 254, 2, 256, 268, 280, 148, 228, 328};
static const struct places nifti_2 = {12,  16, 8,   104, 8,   168, 0, 176, 184, 192, 200, 208, 216,
                                      496, 4,  500, 504, 344, 348, 4, 352, 376, 400, 240, 320, 508};

/* The n bytes of a number as those of a whole number. */
static uint64_t bits(const uint8_t *byte, size_t n, bool big)
{
    uint64_t v = 0;
    for (size_t i = 0; i < n; i++) v |= (uint64_t)byte[i] << 8 * (big ? n - 1 - i : i);
    return v;
}

static int64_t whole(const uint8_t *byte, size_t n, bool big)
{
    const uint64_t v = bits(byte, n, big);
    return n == 8 ? (int64_t)v : n == 4 ? (int64_t)(int32_t)v : n == 2 ? (int64_t)(int16_t)v : (int64_t)v;
}

static double real(const uint8_t *byte, size_t n, bool big)
{
    const uint64_t v = bits(byte, n, big);
    const uint32_t narrow = (uint32_t)v;
    double wide;
    float single;
    memcpy(&wide, &v, sizeof wide);
    memcpy(&single, &narrow, sizeof single);
    return n == 8 ? wide : (double)single;
}

static status refuse(const struct volume_header *h, const char *text, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': %s", h->name, text);
}

static status parse_size(const uint8_t *byte, const struct places *p, bool big, const struct volume_header *h,
                         struct nifti_header *header, struct error *err)
{
    const int64_t n = whole(byte + p->dim, p->dim_bytes, big);
    if (n < 3 || n > 7) return refuse(h, "its header does not state 3 to 7 dimensions", err);
    header->n = (size_t)n;
    for (size_t a = 0; a < header->n; a++) {
        const int64_t edge = whole(byte + p->dim + (a + 1) * p->dim_bytes, p->dim_bytes, big);
        if (edge < 1 || edge > VOXEL_STREAM_MAX_EDGE)
            return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES,
                                   "cannot read volume '%s': an impossible size, %lld along dimension %zu", h->name,
                                   (long long)edge, a + 1);
        header->size[a] = (size_t)edge;
    }
    return STATUS_OK;
}

static void parse_numbers(const uint8_t *byte, const struct places *p, bool big, struct nifti_header *header)
{
    const size_t r = p->real_bytes;
    header->datatype = (int)whole(byte + p->datatype, 2, big);
    header->vox_offset =
        p->offset_is_real ? real(byte + p->vox_offset, 4, big) : (double)whole(byte + p->vox_offset, 8, big);
    header->scl_slope = real(byte + p->scl_slope, r, big);
    header->scl_inter = real(byte + p->scl_inter, r, big);
    header->cal_max = real(byte + p->cal_max, r, big);
    header->cal_min = real(byte + p->cal_min, r, big);
    header->slice_duration = real(byte + p->slice_duration, r, big);
    header->toffset = real(byte + p->toffset, r, big);
    header->slice_code = (int)whole(byte + p->slice_code, p->code_bytes, big);
    header->xyzt_units = (int)whole(byte + p->xyzt_units, p->code_bytes, big);
    header->intent_code = (int)whole(byte + p->intent_code, p->form_bytes, big);
    header->qform_code = (int)whole(byte + p->qform_code, p->form_bytes, big);
    header->sform_code = (int)whole(byte + p->sform_code, p->form_bytes, big);
    for (size_t a = 0; a < 8; a++) header->pixdim[a] = real(byte + p->pixdim + a * r, r, big);
    for (size_t a = 0; a < 3; a++) {
        header->quatern[a] = real(byte + p->quatern + a * r, r, big);
        header->qoffset[a] = real(byte + p->qoffset + a * r, r, big);
        for (size_t c = 0; c < 4; c++) header->srow[a][c] = real(byte + p->srow + (4 * a + c) * r, r, big);
    }
    memcpy(header->descrip, byte + p->descrip, 80);
    memcpy(header->aux_file, byte + p->aux_file, 24);
    memcpy(header->intent_name, byte + p->intent_name, 16);
}

bool nifti_header_begins(const uint8_t b[16])
{
    const uint64_t little = bits(b, 4, false), big = bits(b, 4, true);
    return little == NIFTI_1_BYTES || big == NIFTI_1_BYTES || little == NIFTI_2_BYTES || big == NIFTI_2_BYTES;
}

status nifti_header_parse(const uint8_t *byte, size_t n, const struct volume_header *h, struct nifti_header *header,
                          struct error *err)
{
    uint8_t begin[16] = {0};
    memcpy(begin, byte, n < sizeof begin ? n : sizeof begin);
    const bool big = begin[0] == 0;
    const bool is_2 = bits(begin, 4, big) == NIFTI_2_BYTES;
    const size_t length = is_2 ? NIFTI_2_BYTES : NIFTI_1_BYTES;
    if (!nifti_header_begins(begin)) return refuse(h, "it does not begin as NIfTI does", err);
    if (n < length) return refuse(h, "it ends within the header of NIfTI", err);
    const char *magic = (const char *)byte + (is_2 ? 4 : 344);
    if (magic[0] != 'n' || (magic[1] != '+' && magic[1] != 'i') || magic[2] != (is_2 ? '2' : '1') || magic[3] != '\0')
        return refuse(h,
                      "it is not NIfTI but perhaps Analyze 7.5, which does not say where its axes point: save it as "
                      "NIfTI",
                      err);
    *header = (struct nifti_header){.is_single_file = magic[1] == '+', .header_bytes = length};
    header->has_extension = n > length && byte[length] != 0;
    header->swap = big != (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__);
    parse_numbers(byte, is_2 ? &nifti_2 : &nifti_1, big, header);
    return parse_size(byte, is_2 ? &nifti_2 : &nifti_1, big, h, header, err);
}

/* The rotation of a unit quaternion with a = sqrt(1 - b^2 - c^2 - d^2); a negative pixdim[0] mirrors the third axis. */
static void rotation(const struct nifti_header *header, double direction[3][3])
{
    double b = header->quatern[0], c = header->quatern[1], d = header->quatern[2];
    double square = 1.0 - (b * b + c * c + d * d), a = square > 1e-7 ? sqrt(square) : 0.0;
    if (a == 0.0) { /* rounding: a turn by half a circle */
        const double length = sqrt(b * b + c * c + d * d);
        b /= length, c /= length, d /= length;
    }
    const double third = header->pixdim[0] < 0.0 ? -1.0 : 1.0;
    const double column[3][3] = {{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)},
                                 {2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)},
                                 {2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c}};
    for (int i = 0; i < 3; i++)
        for (int w = 0; w < 3; w++)
            direction[i][w] = column[i][w] * fabs(header->pixdim[i + 1]) * (i == 2 ? third : 1.0);
}

const char *nifti_header_directions(const struct nifti_header *header, double direction[3][3])
{
    if (header->sform_code > 0)
        for (int a = 0; a < 3; a++)
            for (int w = 0; w < 3; w++) direction[a][w] = header->srow[w][a];
    else if (header->qform_code > 0)
        rotation(header, direction);
    return header->sform_code > 0 ? "sform" : header->qform_code > 0 ? "qform" : NULL;
}
