#include "server/settings/letterhead.h"
#include "base/files/durable.h"

#include <jansson.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>

/* The page has the logo in itself; it is a few centimetres wide. */
enum { LOGO_MOST_BYTES = 256 << 10, SVG_HEAD_BYTES = 4096 };

static bool is_png(const char *bytes, size_t n)
{
    static const char begin[] = "\x89PNG\r\n\x1a\n", end[] = "IEND\xae\x42\x60\x82";
    return n > 16 && memcmp(bytes, begin, 8) == 0 && memcmp(bytes + n - 8, end, 8) == 0;
}

/* Text with the element <svg> near its beginning and the end of that element behind it. */
static bool is_svg(const char *text, size_t n)
{
    const char *svg = memmem(text, n < SVG_HEAD_BYTES ? n : SVG_HEAD_BYTES, "<svg", 4);
    return svg != NULL && memchr(text, '\0', n) == NULL && memmem(svg, n - (size_t)(svg - text), "</svg>", 6) != NULL;
}

static status read_logo(const char *path, json_t *head, struct error *err)
{
    char *bytes = NULL;
    size_t n = 0;
    status s = file_read_all(path, LOGO_MOST_BYTES, &bytes, &n, err);
    if (s != STATUS_OK) return error_prefix(err, s, "report.logo");
    const char *type = is_png(bytes, n) ? "png" : is_svg(bytes, n) ? "svg+xml" : NULL;
    const size_t n_text = sodium_base64_ENCODED_LEN(n, sodium_base64_VARIANT_ORIGINAL);
    char *text = malloc(n_text);
    if (type == NULL)
        s = error_set_field(err, STATUS_INVALID, "report.logo", "report.logo '%s' is neither a PNG nor an SVG file",
                            path);
    else if (text == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot read '%s': out of memory", path);
    else {
        sodium_bin2base64(text, n_text, (const unsigned char *)bytes, n, sodium_base64_VARIANT_ORIGINAL);
        json_object_set_new(head, "logo", json_sprintf("data:image/%s;base64,%s", type, text));
    }
    free(text);
    free(bytes);
    return s;
}

status letterhead_read(const struct settings *s, char **text, struct error *err)
{
    json_t *head = json_pack("{s:s, s:s}", "laboratory", s->report_laboratory, "paper", s->report_paper);
    status r = head != NULL ? STATUS_OK
                            : error_set_field(err, STATUS_INVALID, "report.laboratory",
                                              "report.laboratory is not a text in UTF-8");
    if (r == STATUS_OK && s->report_logo[0] != '\0') r = read_logo(s->report_logo, head, err);
    *text = r == STATUS_OK ? json_dumps(head, JSON_COMPACT) : NULL;
    if (r == STATUS_OK && *text == NULL) r = error_set(err, STATUS_NO_MEMORY, "cannot start: out of memory");
    json_decref(head);
    return r;
}
