/* Checks of the films of a described cloth. */
#ifndef SELVEDGE_BASE_CLOTH_FILMS_H
#define SELVEDGE_BASE_CLOTH_FILMS_H

#include "base/catalogue/cloth_description.h"

/* Widest section of a film over its thickness. */
#define CLOTH_FILM_MOST_RATIO 200.0

/* STATUS_INVALID with the field as cloth_description_check has it: a film of a felt or a pile, a width that its
 * thickness does not permit, a kind without fibers before one with fibers. */
status cloth_films_check(const struct cloth_description *d, struct error *err);

#endif
