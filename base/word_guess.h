/* Which word somebody meant that mistyped one. */
#ifndef SELVEDGE_BASE_WORD_GUESS_H
#define SELVEDGE_BASE_WORD_GUESS_H

#include <stddef.h>

/* Letters to change, add or leave out until one word is the other (Levenshtein 1966); words of 32 characters and more
 * have 99. */
size_t word_distance(const char *a, const char *b);
/* The word of a list, which ends with NULL, that is nearest to `word`: the same in letters of the other case, or at
 * most 2 letters away, and at most a third of its letters. Also a word that begins with `word`, or that `word` begins
 * with, if it is the only one and the shorter has 3 letters. NULL: none is near. */
const char *word_guess(const char *word, const char *const *list);

#endif
