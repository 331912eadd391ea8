#include "server/endpoints/endpoint_table.h"
#include "server/endpoints/handlers.h"

#include <stdio.h>
#include <string.h>

#define BODY_NONE(name) HTTP_BODY_NONE, handle_##name, NULL, NULL
#define BODY_JSON(name) HTTP_BODY_JSON, handle_##name, NULL, NULL
#define BODY_BATCH(name) HTTP_BODY_BATCH, handle_##name, NULL, NULL
#define BODY_UPLOAD(name) HTTP_BODY_UPLOAD, handle_##name, handle_##name##_begin, handle_##name##_abandoned

static const struct http_route route[] = {
#define ENDPOINT(method, path, name, body, scope, query) {method, path, scope, query, BODY_##body(name)},
#include "server/endpoints/endpoints.def"
#undef ENDPOINT
    /* the dashboard, which is no part of the API */
    {"GET", "/", ACCESS_OPEN, NULL, BODY_NONE(static)},
    {"GET", "/{path...}", ACCESS_OPEN, NULL, BODY_NONE(static)},
};

static bool match(const char *pattern, const char *url, char param[HTTP_N_PARAM][HTTP_PARAM_BYTES])
{
    size_t i_param = 0;
    while (*pattern != '\0') {
        if (*pattern != '{') {
            if (*pattern++ != *url++) return false;
            continue;
        }
        const char *end = strchr(pattern, '}');
        bool rest = strncmp(end - 3, "...", 3) == 0;
        size_t n = rest ? strlen(url) : strcspn(url, "/");
        if (n == 0 || n >= HTTP_PARAM_BYTES || i_param == HTTP_N_PARAM) return false;
        memcpy(param[i_param], url, n);
        param[i_param++][n] = '\0';
        url += n;
        pattern = end + 1;
    }
    return *url == '\0';
}

const struct http_route *endpoint_find(const char *method, const char *url, char param[HTTP_N_PARAM][HTTP_PARAM_BYTES],
                                       char *allow, size_t n_allow)
{
    size_t n = 0;
    allow[0] = '\0';
    bool head = strcmp(method, "HEAD") == 0;
    for (size_t i = 0; i < sizeof route / sizeof route[0]; i++) {
        const struct http_route *r = &route[i];
        if (r->handle == handle_static && strncmp(url, "/v1/", 4) == 0) continue;
        if (!match(r->path, url, param)) continue;
        if (strcmp(r->method, method) == 0 || (head && strcmp(r->method, "GET") == 0)) return r;
        if (n < n_allow) n += (size_t)snprintf(allow + n, n_allow - n, "%s%s", n > 0 ? ", " : "", r->method);
    }
    return NULL;
}
