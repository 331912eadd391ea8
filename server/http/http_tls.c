#include "server/http/http_tls.h"
#include "base/files/durable.h"
#include "server/settings/secret_file.h"

#include <sodium.h>
#include <stdlib.h>
#include <string.h>

enum { PEM_MOST_BYTES = 1 << 20 };

bool http_tls_wanted(const struct settings *s)
{
    return s->unix_socket[0] == '\0' && (s->tls_certificate[0] != '\0' || s->tls_key[0] != '\0');
}

status http_tls_read(const struct settings *s, struct http_tls *tls, struct error *err)
{
    *tls = (struct http_tls){0};
    if (!http_tls_wanted(s)) return STATUS_OK;
    if (s->tls_certificate[0] == '\0' || s->tls_key[0] == '\0')
        return error_set_field(err, STATUS_INVALID, "server.tls_key",
                               "TLS needs both server.tls_certificate and server.tls_key");
    status r = file_read_all(s->tls_certificate, PEM_MOST_BYTES, &tls->certificate, NULL, err);
    if (r == STATUS_OK) r = secret_file_read(s->tls_key, "server.tls_key", PEM_MOST_BYTES, &tls->key, NULL, err);
    return r == STATUS_OK ? r : error_prefix(err, r, "cannot prepare TLS");
}

void http_tls_release(struct http_tls *tls)
{
    if (tls->key != NULL) sodium_memzero(tls->key, strlen(tls->key));
    free(tls->key);
    free(tls->certificate);
    *tls = (struct http_tls){0};
}
