#include "server/http/http_listen.h"
#include "server/http/http_tls.h"

#include <arpa/inet.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

enum { LISTEN_BACKLOG = 1024, BIND_TRIES = 40, BIND_PAUSE_US = 50000 };

/* The part of server.public_origin after "https://", or NULL if it is not set. */
static const char *public_host(const struct settings *s)
{
    const char *after = strstr(s->public_origin, "://");
    return after == NULL ? NULL : after + 3;
}

static status check_origin(const struct settings *s, struct error *err)
{
    const char *host = public_host(s);
    bool known = strncmp(s->public_origin, "https://", 8) == 0 || strncmp(s->public_origin, "http://", 7) == 0;
    if (s->public_origin[0] == '\0' || (known && host[0] != '\0' && strpbrk(host, "/?#@ \t\"\\") == NULL))
        return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "server.public_origin",
                           "'%s' is not an origin such as https://selvedge.example.org, without a path",
                           s->public_origin);
}

/* A process that a killed daemon was starting may hold its socket for a moment. */
static int bind_patiently(int fd, const struct sockaddr *address, socklen_t n)
{
    int result = bind(fd, address, n);
    for (int i = 0; result != 0 && errno == EADDRINUSE && i < BIND_TRIES; i++) {
        usleep(BIND_PAUSE_US);
        result = bind(fd, address, n);
    }
    return result;
}

static status open_unix(const struct settings *s, int fd, char url[LISTEN_URL_BYTES], struct error *err)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const struct sockaddr *generic = (const struct sockaddr *)(const void *)&address;
    struct stat st;
    const char *path = s->unix_socket;
    if (strlen(path) >= sizeof address.sun_path)
        return error_set_field(err, STATUS_INVALID, "server.unix_socket", "path '%s' is longer than %zu bytes", path,
                               sizeof address.sun_path - 1);
    memcpy(address.sun_path, path, strlen(path) + 1);
    if (lstat(path, &st) == 0 && S_ISSOCK(st.st_mode)) {
        if (connect(fd, generic, sizeof address) == 0 || errno != ECONNREFUSED)
            return error_set(err, STATUS_CONFLICT, "cannot listen on '%s': another process does", path);
        unlink(path);
    }
    /* the file is made by bind() with the mode that umask leaves, so at no moment can another user connect */
    mode_t before = umask(0177);
    int result = bind(fd, generic, sizeof address);
    umask(before);
    if (result != 0 || listen(fd, LISTEN_BACKLOG) != 0) return error_set_errno(err, "cannot listen on '%s'", path);
    snprintf(url, LISTEN_URL_BYTES, "unix:%s", path);
    return STATUS_OK;
}

static bool is_loopback(const char *address)
{
    struct in_addr v4;
    struct in6_addr v6;
    if (inet_pton(AF_INET, address, &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
    return inet_pton(AF_INET6, address, &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

/* Other machines may reach the service only with tokens, and tokens may travel only under TLS. */
static status check_reach(const struct settings *s, bool guarded, struct error *err)
{
    if (is_loopback(s->listen)) return STATUS_OK;
    if (!guarded)
        return error_set_field(
            err, STATUS_INVALID, "server.listen",
            "cannot listen on '%s': without access tokens only loopback addresses (127.0.0.1, ::1) are allowed; make "
            "a first token with: selvedged --data '%s' --make-token NAME",
            s->listen, s->data);
    if (!http_tls_wanted(s))
        return error_set_field(
            err, STATUS_INVALID, "server.listen",
            "cannot listen on '%s' without TLS, because access tokens would cross the network in the clear; set "
            "server.tls_certificate and server.tls_key, or let a proxy on this machine do it (config/nginx.conf)",
            s->listen);
    return STATUS_OK;
}

static status open_tcp(const struct settings *s, int *out, char url[LISTEN_URL_BYTES], struct error *err)
{
    struct sockaddr_storage address = {0};
    struct sockaddr_in *v4 = (struct sockaddr_in *)(void *)&address;
    struct sockaddr_in6 *v6 = (struct sockaddr_in6 *)(void *)&address;
    socklen_t n = sizeof *v4;
    if (inet_pton(AF_INET, s->listen, &v4->sin_addr) == 1) {
        address.ss_family = AF_INET;
        v4->sin_port = htons((uint16_t)s->port);
    } else if (inet_pton(AF_INET6, s->listen, &v6->sin6_addr) == 1) {
        address.ss_family = AF_INET6;
        v6->sin6_port = htons((uint16_t)s->port);
        n = sizeof *v6;
    } else
        return error_set_field(err, STATUS_INVALID, "server.listen", "cannot listen on '%s': not an IP address",
                               s->listen);
    int on = 1, fd = socket(address.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0) return error_set_errno(err, "cannot open a socket");
    *out = fd;
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind_patiently(fd, (struct sockaddr *)&address, n) != 0 || listen(fd, LISTEN_BACKLOG) != 0 ||
        getsockname(fd, (struct sockaddr *)&address, &n) != 0)
        return error_set_errno(err, "cannot listen on '%s', port %lld", s->listen, (long long)s->port);
    bool is_v4 = address.ss_family == AF_INET;
    snprintf(url, LISTEN_URL_BYTES, "%s://%s%s%s:%u", http_tls_wanted(s) ? "https" : "http", is_v4 ? "" : "[",
             s->listen, is_v4 ? "" : "]", ntohs(is_v4 ? v4->sin_port : v6->sin6_port));
    return STATUS_OK;
}

status http_listen(const struct settings *s, bool guarded, int *out, char url[LISTEN_URL_BYTES], struct error *err)
{
    int fd = -1;
    status r = check_origin(s, err);
    if (r != STATUS_OK) return r;
    if (s->unix_socket[0] != '\0') {
        fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
        r = fd < 0 ? error_set_errno(err, "cannot open a socket") : open_unix(s, fd, url, err);
    } else {
        r = check_reach(s, guarded, err);
        if (r == STATUS_OK) r = open_tcp(s, &fd, url, err);
    }
    if (r == STATUS_OK)
        *out = fd;
    else if (fd >= 0)
        close(fd);
    return r;
}

void http_listen_end(const struct settings *s)
{
    if (s->unix_socket[0] != '\0') unlink(s->unix_socket);
}

bool http_host_known(const struct settings *s, const char *host)
{
    const char *const local[] = {"localhost", "127.0.0.1", "[::1]", s->listen};
    for (size_t i = 0; i < sizeof local / sizeof local[0]; i++) {
        size_t n = strlen(local[i]);
        if (strncasecmp(host, local[i], n) != 0) continue;
        const char *port = host + n;
        if (*port == '\0') return true;
        if (*port == ':' && strspn(port + 1, "0123456789") == strlen(port + 1)) return true;
    }
    if (s->unix_socket[0] == '\0' && !is_loopback(s->listen)) return true;
    return public_host(s) != NULL && strcasecmp(host, public_host(s)) == 0;
}

bool http_host_public(const struct settings *s, const char *host)
{
    return host != NULL && strncmp(s->public_origin, "https://", 8) == 0 && strcasecmp(host, public_host(s)) == 0;
}

bool http_origin_known(const struct settings *s, const char *origin, const char *host)
{
    if (public_host(s) != NULL && strcasecmp(origin, s->public_origin) == 0) return true;
    /* a page that came over http is none of a service that is published by https only */
    if (host == NULL || (public_host(s) != NULL && strcasecmp(host, public_host(s)) == 0)) return false;
    const char *scheme = http_tls_wanted(s) ? "https://" : "http://";
    return strncmp(origin, scheme, strlen(scheme)) == 0 && strcasecmp(origin + strlen(scheme), host) == 0;
}
