#include "base/utf8.h"

#include <stdbool.h>

size_t utf8_sequence_bytes(const char *p)
{
    const unsigned char *b = (const unsigned char *)p;
    size_t n = b[0] < 0x80 ? 1 : b[0] < 0xc2 ? 0 : b[0] < 0xe0 ? 2 : b[0] < 0xf0 ? 3 : b[0] < 0xf5 ? 4 : 0;
    for (size_t i = 1; i < n; i++)
        if ((b[i] & 0xc0) != 0x80) return 0; /* a NUL ends here as well, so nothing after it is read */
    bool overlong = (b[0] == 0xe0 && b[1] < 0xa0) || (b[0] == 0xf0 && b[1] < 0x90);
    bool surrogate = b[0] == 0xed && b[1] >= 0xa0, too_large = b[0] == 0xf4 && b[1] >= 0x90;
    return n > 1 && (overlong || surrogate || too_large) ? 0 : n;
}

void utf8_repair(char *text)
{
    for (char *p = text; *p != '\0';) {
        size_t n = utf8_sequence_bytes(p);
        if (n == 0) *p = '?';
        p += n > 0 ? n : 1;
    }
}
