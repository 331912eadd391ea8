/* Names of files that look the same and are written in different bytes.
 *
 * "ö" is one character (composed) or an "o" and a mark above it (decomposed). Programs for macOS decompose the names of
 * files, most others do not, so a document and a copied folder may disagree. Names of files stay as they are; messages
 * about a file that is missing say so. */
#ifndef SELVEDGE_BASE_ALIKE_NAME_H
#define SELVEDGE_BASE_ALIKE_NAME_H

#include <stdbool.h>
#include <stddef.h>

/* Returns whether two different names of UTF-8 are equal once the letters of Latin-1 are decomposed (Unicode Standard
 * Annex 15). */
bool names_alike(const char *a, const char *b);
/* Writes " (the folder has a file whose name looks the same ...)" if the folder has such a file, else "". */
void alike_name_hint(const char *folder, const char *name, char *out, size_t n_out);

#endif
