#include "server/http/static_files.h"
#include "base/process.h"

#include <dirent.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_FILE = 512, MAX_DEPTH = 3 };

struct static_files {
    size_t n;
    struct static_file file[MAX_FILE];
};

static const struct {
    const char *url, *path[2];
} vendor[] = {
    {"/vendor/dygraph.min.js",
     {"/usr/share/javascript/dygraphs/dygraph.min.js", "/usr/share/javascript/dygraphs/dist/dygraph.min.js"}},
    {"/vendor/dygraph.js",
     {"/usr/share/javascript/dygraphs/dygraph.js", "/usr/share/javascript/dygraphs/dist/dygraph.js"}},
    {"/vendor/dygraph.min.css",
     {"/usr/share/javascript/dygraphs/dygraph.min.css", "/usr/share/javascript/dygraphs/dist/dygraph.min.css"}},
    {"/vendor/dygraph.css",
     {"/usr/share/javascript/dygraphs/dygraph.css", "/usr/share/javascript/dygraphs/dist/dygraph.css"}},
    {"/vendor/three.min.js",
     {"/usr/share/javascript/three/three.min.js", "/usr/share/nodejs/three/build/three.min.js"}},
    {"/vendor/three.js", {"/usr/share/javascript/three/three.js", "/usr/share/nodejs/three/build/three.js"}},
    {"/vendor/three.module.js",
     {"/usr/share/javascript/three/three.module.js", "/usr/share/nodejs/three/build/three.module.js"}},
};

static void add(struct static_files *f, const char *url, const char *path)
{
    if (f->n == MAX_FILE || strlen(url) >= sizeof f->file[0].url || strlen(path) >= sizeof f->file[0].path) return;
    struct static_file *x = &f->file[f->n++];
    snprintf(x->url, sizeof x->url, "%s", url);
    snprintf(x->path, sizeof x->path, "%s", path);
}

static bool served_kind(const char *name)
{
    static const char *const ending[] = {".html", ".css", ".js",  ".mjs", ".json",
                                         ".svg",  ".png", ".jpg", ".ico", ".woff2"};
    const char *dot = strrchr(name, '.');
    for (size_t i = 0; dot != NULL && i < sizeof ending / sizeof ending[0]; i++)
        if (strcmp(dot, ending[i]) == 0) return true;
    return false;
}

static void add_folder(struct static_files *f, const char *folder, const char *url, int depth)
{
    DIR *d = opendir(folder);
    if (d == NULL) return;
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        char path[1024], address[256];
        struct stat st;
        if (e->d_name[0] == '.') continue;
        int n = snprintf(path, sizeof path, "%s/%s", folder, e->d_name),
            m = snprintf(address, sizeof address, "%s/%s", url, e->d_name);
        if (n >= (int)sizeof path || m >= (int)sizeof address || lstat(path, &st) != 0) continue;
        if (S_ISDIR(st.st_mode) && depth + 1 < MAX_DEPTH) add_folder(f, path, address, depth + 1);
        if (S_ISREG(st.st_mode) && served_kind(e->d_name)) add(f, address, path);
    }
    closedir(d);
}

/* Finds a file of the installation or of the source tree, relative to the folder of this program. The installation
 * comes first: above its folder there may be others' files. Returns false if there is none. */
static bool find_beside(const char *in_tree, const char *installed, char out[1024])
{
    char program[800];
    if (!program_folder(program, sizeof program)) return false;
    snprintf(out, 1024, "%s/../share/selvedge/%s", program, installed);
    if (access(out, R_OK) == 0) return true;
    static const char *const up[] = {"../..", "../../.."};
    for (size_t i = 0; i < 2; i++) {
        snprintf(out, 1024, "%s/%s/%s", program, up[i], in_tree);
        if (access(out, R_OK) == 0) return true;
    }
    return false;
}

static status add_dashboard(struct static_files *f, const char *web, struct log *log, struct error *err)
{
    char folder[1024], index[1100];
    if (*web != '\0')
        snprintf(folder, sizeof folder, "%s", web);
    else if (!find_beside("clients/dashboard", "dashboard", folder)) {
        log_warning(log, "the dashboard was not found; only the API is served");
        return STATUS_OK;
    }
    if (*web != '\0' && access(folder, R_OK | X_OK) != 0)
        return error_set_errno(err, "cannot read the dashboard's folder '%s'", folder);
    add_folder(f, folder, "", 0);
    snprintf(index, sizeof index, "%s/index.html", folder);
    if (access(index, R_OK) == 0)
        add(f, "/", index);
    else
        log_warning(log, "the dashboard's folder has no index.html; only the API is served");
    return STATUS_OK;
}

status static_files_new(const char *web, const char *openapi, struct log *log, struct static_files **out,
                        struct error *err)
{
    char path[1024];
    struct static_files *f = calloc(1, sizeof *f);
    if (f == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list the dashboard: out of memory");
    status s = add_dashboard(f, web, log, err);
    if (s != STATUS_OK) {
        free(f);
        return s;
    }
    for (size_t i = 0; i < sizeof vendor / sizeof vendor[0]; i++)
        for (size_t k = 0; k < 2; k++)
            if (access(vendor[i].path[k], R_OK) == 0) {
                add(f, vendor[i].url, vendor[i].path[k]);
                break;
            }
    if (*openapi != '\0')
        add(f, "/v1/openapi.json", openapi);
    else if (find_beside("config/openapi.json", "openapi.json", path))
        add(f, "/v1/openapi.json", path);
    else
        log_warning(log, "openapi.json was not found, so /v1/openapi.json is not served");
    if (find_beside("docs/glossary.md", "glossary.md", path)) add(f, "/glossary.md", path);
    *out = f;
    return STATUS_OK;
}

void static_files_free(struct static_files *files) { free(files); }

const struct static_file *static_files_find(const struct static_files *f, const char *url)
{
    for (size_t i = 0; i < f->n; i++)
        if (strcmp(f->file[i].url, url) == 0) return &f->file[i];
    return NULL;
}
