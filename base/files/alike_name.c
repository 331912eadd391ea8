#include "base/files/alike_name.h"

#include <dirent.h>
#include <stdio.h>
#include <string.h>

/* Letter and mark of the characters U+00C0 to U+00FF; a blank where there is none. Marks are named by the letters of
 * `mark`. */
static const char letter[] = "AAAAAA CEEEEIIII NOOOOO  UUUUY  aaaaaa ceeeeiiii nooooo  uuuuy y";
static const char mark_of[] = "gactdr ,gacdgacd tgactd  gacda  gactdr ,gacdgacd tgactd  gacda d";
static const struct {
    char name, bytes[3];
} mark[] = {{'g', "\xcc\x80"}, {'a', "\xcc\x81"}, {'c', "\xcc\x82"}, {'t', "\xcc\x83"},
            {'d', "\xcc\x88"}, {'r', "\xcc\x8a"}, {',', "\xcc\xa7"}};

enum { NAME_BYTES = 1024 };

static void decompose(const char *name, char out[NAME_BYTES])
{
    size_t n = 0;
    for (const char *p = name; *p != '\0' && n + 4 < NAME_BYTES; p++) {
        const unsigned char c = (unsigned char)*p, next = (unsigned char)p[1];
        const size_t at = c == 0xc3 && next >= 0x80 && next <= 0xbf ? next - 0x80u : sizeof letter - 1;
        if (at == sizeof letter - 1 || letter[at] == ' ') {
            out[n++] = *p;
            continue;
        }
        out[n++] = letter[at];
        for (size_t m = 0; m < sizeof mark / sizeof *mark; m++)
            if (mark[m].name == mark_of[at]) {
                memcpy(out + n, mark[m].bytes, 2);
                n += 2;
            }
        p++;
    }
    out[n] = '\0';
}

bool names_alike(const char *a, const char *b)
{
    char of_a[NAME_BYTES], of_b[NAME_BYTES];
    decompose(a, of_a);
    decompose(b, of_b);
    return strcmp(a, b) != 0 && strcmp(of_a, of_b) == 0;
}

void alike_name_hint(const char *folder, const char *name, char *out, size_t n_out)
{
    DIR *d = opendir(folder);
    out[0] = '\0';
    for (struct dirent *e; d != NULL && out[0] == '\0' && (e = readdir(d)) != NULL;)
        if (names_alike(name, e->d_name))
            snprintf(out, n_out,
                     " (the folder has '%.200s', which looks the same and has other bytes, as macOS writes umlauts: "
                     "rename it)",
                     e->d_name);
    if (d != NULL) closedir(d);
}
