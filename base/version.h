/* The version that every program, GET /v1/about and result.json state. tests/api/test_version.py compares the copy in
 * clients/python/selvedge/version.py with it. */
#ifndef SELVEDGE_BASE_VERSION_H
#define SELVEDGE_BASE_VERSION_H

#define SELVEDGE_VERSION "0.2.0"

#endif
