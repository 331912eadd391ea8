#include "optimizer/photographs/reader/png_raw_profile.h"

#include "optimizer/photographs/reader/exif.h"
#include "optimizer/photographs/reader/xmp.h"

#include <ctype.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static int digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    const int letter = tolower((unsigned char)c);
    return letter >= 'a' && letter <= 'f' ? letter - 'a' + 10 : -1;
}

/* Returns the number of bytes that the digits stand for; blanks lie between lines. byte: room for n_text / 2. */
static size_t decode(const char *text, size_t n_text, uint8_t *byte)
{
    size_t n = 0;
    int high = -1;
    for (size_t i = 0; i < n_text; i++) {
        const int d = digit(text[i]);
        if (d < 0 && isspace((unsigned char)text[i])) continue;
        if (d < 0) break;
        if (high < 0) {
            high = d;
        } else {
            byte[n++] = (uint8_t)(high << 4 | d);
            high = -1;
        }
    }
    return n;
}

/* Returns the text behind its first two lines, which are a name and the number of bytes; NULL when it is shorter. */
static const char *behind_head(const char *text, const char *end)
{
    while (text < end && isspace((unsigned char)*text)) text++;
    for (int line = 0; line < 2 && text != NULL; line++) {
        text = memchr(text, '\n', (size_t)(end - text));
        if (text != NULL) text++;
    }
    return text;
}

static void take(const char *name, const uint8_t *byte, size_t n, struct photograph_info *info)
{
    static const char xmp_mark[] = "http://ns.adobe.com/xap/1.0/";
    if (strcmp(name, "xmp") == 0)
        xmp_read((const char *)byte, n, info);
    else if (n > sizeof xmp_mark && memcmp(byte, xmp_mark, sizeof xmp_mark) == 0)
        xmp_read((const char *)byte + sizeof xmp_mark, n - sizeof xmp_mark, info);
    else
        exif_read_bytes(byte, n, info);
}

void png_raw_profile_read(const char *key, const char *text, size_t n_text, struct photograph_info *info)
{
    static const char head[] = "Raw profile type ";
    if (strncmp(key, head, sizeof head - 1) != 0) return;
    const char *name = key + sizeof head - 1;
    if (strcmp(name, "exif") != 0 && strcmp(name, "APP1") != 0 && strcmp(name, "xmp") != 0) {
        file_ledger_add(&info->ledger, "text profile", "only exif, APP1 and xmp are read", "%s", name);
        return;
    }
    const char *digits = behind_head(text, text + n_text);
    uint8_t *byte = malloc(n_text / 2 + 1);
    if (digits != NULL && byte != NULL) {
        const size_t n = decode(digits, (size_t)(text + n_text - digits), byte);
        if (n > 0) take(name, byte, n, info);
    }
    free(byte);
}
