#include "server/workers/console.h"

#include "base/utf8.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

/* Reads at most n bytes up to the end of a file of this size; returns their number. */
static size_t read_end(int fd, off_t size, char *out, size_t n)
{
    off_t from = size > (off_t)n ? size - (off_t)n : 0;
    size_t got = 0;
    while (got < n) {
        ssize_t k = pread(fd, out + got, n - got, from + (off_t)got);
        if (k < 0 && errno == EINTR) continue;
        if (k <= 0) break;
        got += (size_t)k;
    }
    return got;
}

void console_trim(const char *path)
{
    struct stat st;
    if (lstat(path, &st) != 0 || !S_ISREG(st.st_mode) || st.st_size <= CONSOLE_MOST_BYTES) return;
    int fd = open(path, O_RDWR | O_APPEND | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    char *end = fd >= 0 ? malloc(CONSOLE_KEEP_BYTES) : NULL;
    if (end != NULL && fstat(fd, &st) == 0) {
        size_t n = read_end(fd, st.st_size, end, CONSOLE_KEEP_BYTES);
        if (ftruncate(fd, 0) == 0 && write(fd, end, n) < 0) {
            /* the disk is full, and only the console was lost */
        }
    }
    free(end);
    if (fd >= 0) close(fd);
}

void console_tail(const char *path, char *out, size_t n_out)
{
    struct stat st;
    size_t n = 0;
    char last[4096];
    int fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd >= 0 && fstat(fd, &st) == 0 && S_ISREG(st.st_mode)) n = read_end(fd, st.st_size, last, sizeof last);
    if (fd >= 0) close(fd);
    while (n > 0 && (last[n - 1] == '\n' || last[n - 1] == ' ')) n--;
    size_t first = n < n_out - 1 ? 0 : n - (n_out - 1);
    while (first < n && ((unsigned char)last[first] & 0xc0) == 0x80) first++; /* of a character that was cut */
    for (size_t i = first; i < n; i++) {
        const unsigned char c = (unsigned char)last[i], next = i + 1 < n ? (unsigned char)last[i + 1] : 0;
        const bool c1 = c == 0xc2 && next >= 0x80 && next < 0xa0; /* control characters of 8 bits */
        if (c < 32 || c == 127 || c1) last[i] = ' ';
        if (c1) last[i + 1] = ' ';
    }
    memcpy(out, last + first, n - first);
    out[n - first] = '\0';
    utf8_repair(out);
}
