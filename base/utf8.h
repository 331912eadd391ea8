/* Texts that go into JSON must be UTF-8; what they quote (tables, file names) may be anything. No state.
 */
#ifndef SELVEDGE_BASE_UTF8_H
#define SELVEDGE_BASE_UTF8_H

#include <stddef.h>

/* Bytes of the UTF-8 sequence at p (NUL-terminated): 1 to 4, or 0 when there is none (RFC 3629: no overlong forms, no
 * surrogates, nothing above U+10FFFF). The NUL counts as a sequence of 1. */
size_t utf8_sequence_bytes(const char *p);

/* Puts '?' in place of every byte that belongs to no sequence, also where a text was cut inside of one. */
void utf8_repair(char *text);

#endif
