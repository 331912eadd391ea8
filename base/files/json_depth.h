/* How deep JSON texts may be nested, and how many values they may have. Code that reads, copies, compares and frees
 * JSON documents calls itself for each level, so the depth of every document of a client is bounded before it is
 * parsed. A parsed value takes some 130 bytes of memory, and "[]," only 3 of a text. */
#ifndef SELVEDGE_JSON_DEPTH_H
#define SELVEDGE_JSON_DEPTH_H

#include "base/status.h"

#include <stddef.h>

/* Most levels of objects and lists inside each other, where a job document has 6; most values of a document, where a
 * table of 10,000 samples with 10 files each has 500,000. */
enum { JSON_DEPTH_MOST = 32, JSON_VALUES_MOST = 1000000 };

/* Checks a text before it is parsed; the text need not be JSON. The error names the text by the third argument, such as
 * "the body". STATUS_INVALID: it has more than JSON_DEPTH_MOST levels or JSON_VALUES_MOST values. */
status json_depth_check(const char *text, size_t n_bytes, const char *what, struct error *err);

#endif
