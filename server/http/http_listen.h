/* The socket that the server listens on, and the addresses under which browsers know it. By default TCP on a loopback
 * address, on others only with access tokens and TLS; with server.unix_socket a unix socket that only this user can
 * open; with server.public_origin a proxy on this machine publishes the service under that address. */
#ifndef SELVEDGE_SERVER_HTTP_LISTEN_H
#define SELVEDGE_SERVER_HTTP_LISTEN_H

#include "server/settings/settings.h"

#include <stdbool.h>

enum { LISTEN_URL_BYTES = 640 };

/* Opens the socket and writes its address, "http://127.0.0.1:7878" or "unix:/run/selvedge.sock". A socket file that no
 * process listens on any more is replaced. STATUS_INVALID (server.listen, server.unix_socket, server.public_origin),
 * guarded: access tokens are required; only then, and with TLS, it may listen on other addresses than loopback.
 * STATUS_CONFLICT (another process listens on the unix socket), STATUS_IO. */
status http_listen(const struct settings *settings, bool guarded, int *fd, char url[LISTEN_URL_BYTES],
                   struct error *err);
/* Removes the socket file, if there is one. */
void http_listen_end(const struct settings *settings);
/* Whether a Host header names this service. On an address that is not loopback, any name may: there every request needs
 * a token, which a page of another site that rebinds its name does not have. */
bool http_host_known(const struct settings *settings, const char *host);
/* Returns whether the Host header (or NULL) names server.public_origin, and this is an https address. */
bool http_host_public(const struct settings *settings, const char *host);
/* Whether a page with this Origin, which reached us with this Host, is one of this service. */
bool http_origin_known(const struct settings *settings, const char *origin, const char *host);

#endif
