/* Checksum of the two things that a checkpoint depends on besides the input files: the text of the job document, and
 * the program. */
#ifndef SELVEDGE_OPTIMIZER_DOCUMENT_FINGERPRINT_H
#define SELVEDGE_OPTIMIZER_DOCUMENT_FINGERPRINT_H

#include <stddef.h>
#include <stdint.h>

/* Checksum of a document's text and this build of the program. */
uint64_t document_fingerprint(const char *document, size_t n_bytes);

#endif
