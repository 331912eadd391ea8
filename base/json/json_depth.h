/* How deep JSON texts may be nested. Code that reads, copies, compares and frees JSON documents calls itself for each
 * level, so the depth of every document of a client is bounded before it is parsed. */
#ifndef SELVEDGE_JSON_DEPTH_H
#define SELVEDGE_JSON_DEPTH_H

#include "base/status.h"

#include <stddef.h>

/* Most levels of objects and lists inside each other. A job document has 6. */
enum { JSON_DEPTH_MOST = 32 };

/* Checks a text before it is parsed; the text need not be JSON. what: names it in the sentence, such as "the body".
 * STATUS_INVALID: it has more than JSON_DEPTH_MOST levels. */
status json_depth_check(const char *text, size_t n_bytes, const char *what, struct error *err);

#endif
