#include "server/http/library_refusal.h"
#include "server/jobs/problem_code.h"

#include <gnutls/gnutls.h>
#include <microhttpd.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>

enum { ANSWER_BYTES = 1024 };

static const struct {
    unsigned status_code;
    const char *reason, *code, *detail;
} table[] = {
    {400, "Bad Request", "malformed", "the first line, a header or the Content-Length cannot be understood"},
    {413, "Content Too Large", "too_large", "the Content-Length is larger than any body that is accepted"},
    {414, "URI Too Long", "address_too_long", "the address is longer than any that is known here"},
    {431, "Request Header Fields Too Large", "head_too_large", "the head of the request has more than 256 KiB"},
    {505, "HTTP Version Not Supported", "http_version", "the first line names no version of HTTP that is known here"},
};
enum { N_KIND = sizeof table / sizeof table[0] };

unsigned library_refusal_of(const char *format, va_list args)
{
    static const char announced[] = "Error processing request (HTTP response code is %u";
    va_list copy;
    if (strncmp(format, announced, sizeof announced - 1) != 0) return 0;
    va_copy(copy, args);
    unsigned status_code = va_arg(copy, unsigned);
    va_end(copy);
    return status_code;
}

static size_t write_answer(size_t kind, char answer[ANSWER_BYTES])
{
    char body[ANSWER_BYTES / 2];
    int n_body = snprintf(body, sizeof body,
                          "{\"type\":\"urn:selvedge:problem:%s\",\"title\":\"%s\",\"status\":%u,\"code\":\"%s\","
                          "\"detail\":\"%s\"}",
                          table[kind].code, http_problem_of_code(table[kind].code)->title, table[kind].status_code,
                          table[kind].code, table[kind].detail);
    int n = snprintf(answer, ANSWER_BYTES,
                     "HTTP/1.1 %u %s\r\nContent-Type: application/problem+json\r\nX-Content-Type-Options: nosniff\r\n"
                     "Connection: close\r\nContent-Length: %d\r\n\r\n%s",
                     table[kind].status_code, table[kind].reason, n_body, body);
    return (size_t)n;
}

void library_refusal_answer(struct connection_table *connections, bool tls, unsigned status_code)
{
    char answer[ANSWER_BYTES];
    void *connection = NULL;
    size_t kind = 0;
    while (kind < N_KIND && table[kind].status_code != status_code) kind++;
    int fd = kind < N_KIND ? connection_of_thread(connections, &connection) : -1;
    if (fd < 0 || (tls && connection == NULL)) return;
    size_t n = write_answer(kind, answer);
    const union MHD_ConnectionInfo *info =
        tls ? MHD_get_connection_info(connection, MHD_CONNECTION_INFO_GNUTLS_SESSION) : NULL;
    /* the connection ends whether or not the answer arrives */
    if (info != NULL && info->tls_session != NULL)
        (void)!gnutls_record_send(info->tls_session, answer, n);
    else if (!tls)
        (void)!send(fd, answer, n, MSG_DONTWAIT | MSG_NOSIGNAL);
    shutdown(fd, SHUT_RDWR);
}
