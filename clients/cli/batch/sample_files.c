#include "clients/cli/batch/sample_files.h"
#include "base/natural_order.h"
#include "base/utf8.h"
#include "clients/cli/commands/cli_job_files.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <fnmatch.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_ROOM = 4096 };

/* A name must be UTF-8, or no document could hold it. */
static bool is_utf8(const char *name)
{
    size_t n;
    for (; *name != '\0'; name += n)
        if ((n = utf8_sequence_bytes(name)) == 0) return false;
    return true;
}

static status add_name(struct sample_files *f, const char *name, struct error *err)
{
    if (!is_utf8(name))
        return error_set(err, STATUS_INVALID, "the name of the file '%s' is not UTF-8: rename it", name);
    char **more = realloc(f->name, (f->n + 1) * sizeof *more);
    if (more != NULL) f->name = more;
    char *copy = more == NULL ? NULL : strdup(name);
    if (copy == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot list a sample: out of memory");
    f->name[f->n++] = copy;
    return STATUS_OK;
}

static status make_fingerprint(const char *folder, struct sample_files *f, struct error *err)
{
    unsigned char digest[crypto_hash_sha256_BYTES];
    crypto_hash_sha256_state hash;
    crypto_hash_sha256_init(&hash);
    f->fingerprint[0] = '\0';
    for (size_t i = 0; i < f->n; i++) {
        char path[PATH_ROOM], line[PATH_ROOM];
        struct stat st;
        snprintf(path, sizeof path, "%s/%s", folder, f->name[i]);
        if (lstat(path, &st) != 0) return error_set_errno(err, "cannot examine '%s'", path);
        int n = snprintf(line, sizeof line, "%s/%lld/%lld.%09ld\n", f->name[i], (long long)st.st_size,
                         (long long)st.st_mtim.tv_sec, st.st_mtim.tv_nsec);
        crypto_hash_sha256_update(&hash, (const unsigned char *)line, (unsigned long long)n);
    }
    crypto_hash_sha256_final(&hash, digest);
    if (f->n > 0) sodium_bin2hex(f->fingerprint, sizeof f->fingerprint, digest, sizeof digest);
    return STATUS_OK;
}

status sample_files_list(const char *folder, const char *marker, struct sample_files *f, struct error *err)
{
    *f = (struct sample_files){0};
    DIR *d = opendir(folder);
    if (d == NULL) return error_set_errno(err, "cannot read the folder '%s'", folder);
    status s = STATUS_OK;
    for (struct dirent *e; s == STATUS_OK && (e = readdir(d)) != NULL;) {
        struct stat st;
        if (strcmp(e->d_name, marker) == 0)
            f->marked = true;
        else if (e->d_name[0] != '.' && fstatat(dirfd(d), e->d_name, &st, AT_SYMLINK_NOFOLLOW) == 0 &&
                 S_ISREG(st.st_mode))
            s = add_name(f, e->d_name, err);
    }
    closedir(d);
    if (f->n > 0) qsort(f->name, f->n, sizeof *f->name, natural_compare_names);
    if (s == STATUS_OK) s = make_fingerprint(folder, f, err);
    if (s != STATUS_OK) sample_files_release(f);
    return s;
}

void sample_files_release(struct sample_files *f)
{
    for (size_t i = 0; i < f->n; i++) free(f->name[i]);
    free(f->name);
    *f = (struct sample_files){0};
}

bool sample_files_have(const struct sample_files *f, const char *name)
{
    return f->n > 0 && bsearch(&name, f->name, f->n, sizeof *f->name, natural_compare_names) != NULL;
}

/* ---- templates ---- */

static bool is_pattern(const json_t *value)
{
    return json_is_string(value) && strchr(json_string_value(value), '*') != NULL;
}

static void append_matches(const struct sample_files *f, const char *pattern, json_t *list)
{
    for (size_t i = 0; i < f->n; i++)
        if (strcmp(f->name[i], SAMPLE_DOCUMENT) != 0 && fnmatch(pattern, f->name[i], 0) == 0)
            json_array_append_new(list, json_string(f->name[i]));
}

/* Replaces a pattern outside of a list by the one file that it matches. */
static status one_match(const struct sample_files *f, const char *key, const char *pattern, json_t **out,
                        struct error *err)
{
    json_t *found = json_array();
    append_matches(f, pattern, found);
    size_t n = json_array_size(found);
    *out = n == 1 ? json_incref(json_array_get(found, 0)) : NULL;
    json_decref(found);
    if (n == 1) return STATUS_OK;
    return error_set_field(err, n == 0 ? STATUS_NOT_FOUND : STATUS_INVALID, key,
                           "'%s' of the template must match one file, but %zu files match it", pattern, n);
}

static status fill(json_t *value, const struct sample_files *f, struct error *err)
{
    status s = STATUS_OK;
    if (json_is_object(value)) {
        const char *key;
        void *next;
        json_t *member;
        json_object_foreach_safe(value, next, key, member)
        {
            json_t *file = NULL;
            if (is_pattern(member) && (s = one_match(f, key, json_string_value(member), &file, err)) == STATUS_OK)
                json_object_set_new(value, key, file);
            else if (s == STATUS_OK)
                s = fill(member, f, err);
            if (s != STATUS_OK) return s;
        }
    } else if (json_is_array(value)) {
        json_t *filled = json_array(), *item;
        size_t i;
        json_array_foreach(value, i, item)
        {
            if (is_pattern(item))
                append_matches(f, json_string_value(item), filled);
            else if ((s = fill(item, f, err)) == STATUS_OK)
                json_array_append(filled, item);
        }
        json_array_clear(value);
        json_array_extend(value, filled);
        json_decref(filled);
    }
    return s;
}

static status from_template(const char *name, const struct sample_files *f, const json_t *template, json_t **out,
                            struct error *err)
{
    json_t *document = json_deep_copy(template), *text = json_string(name);
    if (text == NULL) {
        json_decref(document);
        return error_set(err, STATUS_INVALID, "the name of the sample folder is not UTF-8");
    }
    json_object_del(document, "sample"); /* in which a '*' has no meaning */
    status s = fill(document, f, err);
    json_object_set_new(document, "sample", text);
    if (s == STATUS_OK)
        *out = document;
    else
        json_decref(document);
    return s;
}

static status own_document(const char *folder, json_t **out, struct error *err)
{
    char path[PATH_ROOM];
    json_error_t where;
    snprintf(path, sizeof path, "%s/" SAMPLE_DOCUMENT, folder);
    char name[] = SAMPLE_DOCUMENT;
    const struct cli_file file = {.name = name, .path = path, .no_links = true};
    int fd = cli_file_open(&file);
    if (fd < 0) return error_set_errno(err, "cannot read " SAMPLE_DOCUMENT);
    *out = json_loadfd(fd, JSON_REJECT_DUPLICATES, &where);
    close(fd);
    if (json_is_object(*out)) return STATUS_OK;
    json_decref(*out);
    *out = NULL;
    if (where.line <= 0) return error_set(err, STATUS_IO, "cannot read " SAMPLE_DOCUMENT ": %s", where.text);
    return error_set(err, STATUS_INVALID, SAMPLE_DOCUMENT " is not a JSON object: line %d, column %d: %s", where.line,
                     where.column, where.text);
}

static status check_files(const json_t *document, const char *folder, const struct sample_files *f, struct error *err)
{
    struct cli_file_list list;
    status s = cli_job_files_list(document, folder, &list, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; s == STATUS_OK && i < list.n_file; i++)
        if (!sample_files_have(f, list.file[i].name))
            s = error_set(err, STATUS_NOT_FOUND, "the job document names '%s', which is not in the folder",
                          list.file[i].name);
    cli_job_files_release(&list);
    return s;
}

status sample_document(const char *folder, const char *name, const struct sample_files *f, const json_t *template,
                       json_t **out, struct error *err)
{
    status s;
    if (sample_files_have(f, SAMPLE_DOCUMENT))
        s = own_document(folder, out, err);
    else if (template != NULL)
        s = from_template(name, f, template, out, err);
    else
        return error_set(err, STATUS_NOT_FOUND,
                         "the folder has no " SAMPLE_DOCUMENT ", and no template is given (--template)");
    if (s != STATUS_OK) return s;
    s = check_files(*out, folder, f, err);
    if (s != STATUS_OK) {
        json_decref(*out);
        *out = NULL;
    }
    return s;
}
