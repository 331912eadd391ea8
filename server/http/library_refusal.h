/* Answers to requests that libmicrohttpd refuses before any handler is called: a first line or a Content-Length that it
 * cannot read, a head that is too large. Version 0.9.75 answers them as HTML, and some with the head of the answer
 * twice. It has no function for such answers, but it tells each refusal to its log first, in the thread of the
 * connection: there a problem document is sent, and the socket is shut down before the library's own answer. */
#ifndef SELVEDGE_SERVER_LIBRARY_REFUSAL_H
#define SELVEDGE_SERVER_LIBRARY_REFUSAL_H

#include "server/http/connection_table.h"

#include <stdarg.h>

/* Returns the status code of the answer that a line of the library's log announces; 0: it announces none. */
unsigned library_refusal_of(const char *format, va_list args);
/* Answers on the connection of the calling thread. Where it is not known (connection_of_thread), and for the first line
 * under TLS, the library's own answer is sent, which has its head once. */
void library_refusal_answer(struct connection_table *table, bool tls, unsigned status_code);

#endif
