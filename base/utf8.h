/* Checks and repairs UTF-8: text that goes into JSON must be UTF-8, but the tables and file names that it quotes may
 * hold any bytes. */
#ifndef SELVEDGE_BASE_UTF8_H
#define SELVEDGE_BASE_UTF8_H

#include <stddef.h>

/* Returns the length of the UTF-8 sequence at p (NUL-terminated): 1 to 4 bytes, or 0 if there is no valid one (RFC
 * 3629: no overlong forms, no surrogates, nothing above U+10FFFF). The NUL counts as a sequence of 1. */
size_t utf8_sequence_bytes(const char *p);

/* Replaces every byte that is not part of a valid sequence by '?', also at the end of a text that was cut inside a
 * sequence. */
void utf8_repair(char *text);

#endif
