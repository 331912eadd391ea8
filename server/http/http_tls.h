/* The certificate and key of the server's TCP port, from the PEM files that the settings name. GnuTLS, through
 * libmicrohttpd, does the rest: TLS 1.2 and later. */
#ifndef SELVEDGE_SERVER_HTTP_TLS_H
#define SELVEDGE_SERVER_HTTP_TLS_H

#include "server/settings/settings.h"

#include <stdbool.h>

struct http_tls {
    char *certificate, *key; /* PEM texts; NULL without TLS */
};

/* Whether the settings ask for TLS. A unix socket has none. */
bool http_tls_wanted(const struct settings *settings);
/* Reads both files. STATUS_INVALID (one of the two settings is missing, or other users may read the key), STATUS_IO,
 * STATUS_NOT_FOUND. The caller calls http_tls_release in any case. */
status http_tls_read(const struct settings *settings, struct http_tls *tls, struct error *err);
/* Clears the key in memory. */
void http_tls_release(struct http_tls *tls);

#endif
