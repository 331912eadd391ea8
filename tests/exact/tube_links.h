/* Which fibers of a set are one tube: a fiber that ends where another one begins, in its own tile or in the next, goes
 * on in it. A twisted yarn goes on over the face of a tile in the next fiber but one of its own fibers.
 */
#ifndef SELVEDGE_TESTS_TUBE_LINKS_H
#define SELVEDGE_TESTS_TUBE_LINKS_H

#include "geometry/fibers/fiber_set.h"

#include <stdbool.h>

struct tube_links {
    uint32_t *chain;  /* of each fiber: the number of the fiber that its chain is walked from */
    int (*place)[2];  /* of each fiber: the tile in which it continues the tube of that one */
    int (*period)[2]; /* of each chain: the tiles after which it comes back to its first fiber; 0, 0: never */
};

/* A tube: chain, and in which copy of it. */
struct tube {
    uint32_t chain;
    int copy[2];
};

/* False: out of memory. Release in any case. */
bool tube_links_find(struct tube_links *l, const struct fiber_set *f);
void tube_links_release(struct tube_links *l);
/* The tube of a fiber's copy that is shifted by whole tiles. */
struct tube tube_of(const struct tube_links *l, uint32_t i_fiber, const int shift[2]);

#endif
