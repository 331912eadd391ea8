#include "server/store/job_journal.h"
#include "base/files/durable.h"
#include "base/files/foreign_file.h"
#include "base/files/foreign_json.h"
#include "optimizer/job/job_folder.h"

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <math.h>
#include <sodium.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Limits of reading a journal: bytes, files (more than a document can name) and damaged lines. */
enum { FOLDER_BYTES = 4096, MOST_BYTES = 256 << 20, MOST_FILES = 1 << 15, MOST_DAMAGED = 10000 };

/* A record names all files of a job that was made with them. */
static const struct foreign_bounds record_bounds = {
    .file_bytes = RECORD_MOST_BYTES, .held_bytes = 64 << 20, .depth = 8};

/* The columns of a job, by kind. */
struct text_column {
    const char *name;
    size_t offset, n_bytes;
};
#define TEXT(name)                                                                                                     \
    {                                                                                                                  \
#name, offsetof(struct job_row, name), sizeof((struct job_row *)0)->name                                       \
    }
static const struct text_column text_column[] = {TEXT(sample),      TEXT(owner),      TEXT(error_code),
                                                 TEXT(error_field), TEXT(error_text), TEXT(tags),
                                                 TEXT(verdict),     TEXT(batch),      TEXT(batch_name)};
#undef TEXT

struct column {
    const char *name;
    size_t offset;
};
#define COLUMN(name)                                                                                                   \
    {                                                                                                                  \
#name, offsetof(struct job_row, name)                                                                          \
    }
static const struct column flag_column[] = {COLUMN(cancel_requested), COLUMN(dirty), COLUMN(deleted)};
static const struct column number_column[] = {COLUMN(attempt),  COLUMN(lost_attempts),  COLUMN(generation),
                                              COLUMN(priority), COLUMN(peak_rss_bytes), COLUMN(batch_place)};
static const struct column time_column[] = {COLUMN(created_unix_s), COLUMN(updated_unix_s), COLUMN(queued_unix_s),
                                            COLUMN(started_unix_s), COLUMN(finished_unix_s)};
#undef COLUMN
#define N(table) (sizeof(table) / sizeof(table)[0])

static void *at(struct job_row *row, size_t offset) { return (char *)row + offset; }
static const void *look(const struct job_row *row, size_t offset) { return (const char *)row + offset; }

static json_t *job_json(const struct job_row *row)
{
    json_t *j = json_pack("{s:s,s:s}", "id", row->id, "state", job_state_name(row->state));
    for (size_t i = 0; i < N(text_column); i++)
        json_object_set_new(j, text_column[i].name, json_string(look(row, text_column[i].offset)));
    for (size_t i = 0; i < N(flag_column); i++)
        json_object_set_new(j, flag_column[i].name, json_boolean(*(const bool *)look(row, flag_column[i].offset)));
    for (size_t i = 0; i < N(number_column); i++)
        json_object_set_new(j, number_column[i].name,
                            json_integer(*(const int64_t *)look(row, number_column[i].offset)));
    for (size_t i = 0; i < N(time_column); i++)
        json_object_set_new(j, time_column[i].name, json_real(*(const double *)look(row, time_column[i].offset)));
    return j;
}

static json_t *files_json(const struct journal_entry *entry)
{
    json_t *list = json_array();
    for (size_t i = 0; i < entry->n_file; i++) {
        const struct file_row *f = &entry->file[i];
        json_array_append_new(list, json_pack("{s:s,s:s,s:s,s:I,s:s}", "id", f->id, "name", f->name, "role", f->role,
                                              "size_bytes", (json_int_t)f->size_bytes, "sha256", f->sha256));
    }
    return list;
}

static void hash_of(const char *text, char out[STORE_HASH_TEXT_BYTES])
{
    unsigned char sum[crypto_hash_sha256_BYTES];
    crypto_hash_sha256(sum, (const unsigned char *)text, strlen(text));
    sodium_bin2hex(out, STORE_HASH_TEXT_BYTES, sum, sizeof sum);
}

static char *entry_text(const struct journal_entry *entry)
{
    char hash[STORE_HASH_TEXT_BYTES];
    json_t *j = json_object();
    if (entry->job != NULL) json_object_set_new(j, "job", job_json(entry->job));
    if (entry->document) {
        hash_of(entry->job->document, hash);
        json_object_set_new(j, "document_sha256", json_string(hash));
    }
    if (entry->idempotency_key != NULL)
        json_object_set_new(j, "idempotency",
                            json_pack("{s:s,s:s}", "key", entry->idempotency_key, "body_sha256", entry->body_hash));
    if (entry->n_file > 0) json_object_set_new(j, "files", files_json(entry));
    if (entry->removed != NULL) json_object_set_new(j, "removed", json_string(entry->removed));
    char *text = json_dumps(j, JSON_COMPACT);
    json_decref(j);
    return text;
}

/* Ends an incomplete last line, which a power cut may leave, so that it does not swallow the next record. */
static void end_last_line(const char *path)
{
    char last;
    int fd = open(path, O_RDWR | O_APPEND | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    off_t size = fd < 0 ? 0 : lseek(fd, 0, SEEK_END);
    if (size > 0 && pread(fd, &last, 1, size - 1) == 1 && last != '\n' && write(fd, "\n", 1) != 1) {
        /* then the record that follows cannot be written either */
    }
    if (fd >= 0) close(fd);
}

static void journal_path(const char *folder, char out[FOLDER_BYTES])
{
    snprintf(out, FOLDER_BYTES, "%s/%s", folder, JOB_FILE_JOURNAL);
}

status job_journal_append(const struct journal_key *key, const char *folder, const struct journal_entry *entry,
                          bool sync, struct error *err)
{
    char path[FOLDER_BYTES];
    journal_path(folder, path);
    status s = foreign_file_clear(path, err); /* a worker, whose folder it is, could have put a pipe here */
    if (s != STATUS_OK) return s;
    char *plain = entry_text(entry), *text = plain == NULL ? NULL : journal_seal(key, plain);
    free(plain);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    end_last_line(path);
    s = record_append(path, text, sync, err);
    free(text);
    return s;
}

static void copy_text(const json_t *from, const char *key, char *out, size_t n_out)
{
    const char *text = json_string_value(json_object_get(from, key));
    if (text != NULL) snprintf(out, n_out, "%s", text);
}

static void read_job(const json_t *j, struct job_journal *out)
{
    struct job_row row = {0};
    const char *state = json_string_value(json_object_get(j, "state"));
    if (state == NULL || !job_state_parse(state, &row.state)) return;
    copy_text(j, "id", row.id, sizeof row.id);
    for (size_t i = 0; i < N(text_column); i++)
        copy_text(j, text_column[i].name, at(&row, text_column[i].offset), text_column[i].n_bytes);
    for (size_t i = 0; i < N(flag_column); i++)
        *(bool *)at(&row, flag_column[i].offset) = json_is_true(json_object_get(j, flag_column[i].name));
    for (size_t i = 0; i < N(number_column); i++) {
        json_int_t v = json_integer_value(json_object_get(j, number_column[i].name));
        *(int64_t *)at(&row, number_column[i].offset) = v;
    }
    if (row.attempt < 0 || row.lost_attempts < 0 || row.generation < 0) return;
    if (row.priority < -10 || row.priority > 10) row.priority = 0;
    for (size_t i = 0; i < N(time_column); i++) {
        double v = json_number_value(json_object_get(j, time_column[i].name));
        *(double *)at(&row, time_column[i].offset) = isfinite(v) && v > 0 ? v : 0;
    }
    out->job = row;
    out->has_job = true;
}

static size_t find(const struct job_journal *j, const char *name)
{
    size_t i = 0;
    while (i < j->n_file && strcmp(j->file[i].name, name) != 0) i++;
    return i;
}

static status read_files(const json_t *list, struct job_journal *out, struct error *err)
{
    size_t n = json_array_size(list);
    if (n > MOST_FILES - out->n_file) {
        n = MOST_FILES - out->n_file;
        out->n_damaged++;
    }
    if (n == 0) return STATUS_OK;
    struct file_row *more = realloc(out->file, (out->n_file + n) * sizeof *more);
    if (more == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read a journal: out of memory");
    out->file = more;
    for (size_t i = 0; i < n; i++) {
        const json_t *f = json_array_get(list, i);
        struct file_row row = {.size_bytes = json_integer_value(json_object_get(f, "size_bytes"))};
        copy_text(f, "id", row.id, sizeof row.id);
        copy_text(f, "name", row.name, sizeof row.name);
        copy_text(f, "role", row.role, sizeof row.role);
        copy_text(f, "sha256", row.sha256, sizeof row.sha256);
        size_t k = find(out, row.name);
        out->file[k] = row;
        if (k == out->n_file) out->n_file++;
    }
    return STATUS_OK;
}

struct reading {
    struct job_journal *journal;
    struct error *err;
    status s;
    size_t n_record;
};

static bool visit(void *context, const char *text, size_t n)
{
    struct reading *r = context;
    json_t *j = NULL;
    if (foreign_json_parse(text, n, &record_bounds, NULL, &j, NULL) != STATUS_OK || !json_is_object(j)) {
        r->journal->n_damaged++;
        json_decref(j);
        return true;
    }
    r->n_record++;
    const json_t *job = json_object_get(j, "job"), *once = json_object_get(j, "idempotency");
    if (job != NULL) read_job(job, r->journal);
    copy_text(j, "document_sha256", r->journal->document_hash, sizeof r->journal->document_hash);
    copy_text(once, "key", r->journal->key, sizeof r->journal->key);
    copy_text(once, "body_sha256", r->journal->body_hash, sizeof r->journal->body_hash);
    const char *removed = json_string_value(json_object_get(j, "removed"));
    size_t k = removed == NULL ? r->journal->n_file : find(r->journal, removed);
    if (k < r->journal->n_file) {
        memmove(&r->journal->file[k], &r->journal->file[k + 1],
                (r->journal->n_file - k - 1) * sizeof *r->journal->file);
        r->journal->n_file--;
    }
    r->s = read_files(json_object_get(j, "files"), r->journal, r->err);
    json_decref(j);
    return r->s == STATUS_OK;
}

/* Returns the offset behind the line that begins at `from`, or size if it does not end. */
static uint64_t behind_line(int fd, uint64_t from, uint64_t size)
{
    char piece[4096];
    while (from < size) {
        ssize_t n = pread(fd, piece, sizeof piece, (off_t)from);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) break;
        const char *newline = memchr(piece, '\n', (size_t)n);
        if (newline != NULL) return from + (uint64_t)(newline - piece) + 1;
        from += (uint64_t)n;
    }
    return size;
}

status job_journal_read(const char *folder, struct job_journal *journal, struct error *err)
{
    char path[FOLDER_BYTES];
    struct reading r = {journal, err, STATUS_OK, 0};
    uint64_t size = 0;
    int fd = -1;
    *journal = (struct job_journal){0};
    journal_path(folder, path);
    status s = foreign_file_open(folder, JOB_FILE_JOURNAL, &fd, &size, err);
    if (s != STATUS_OK) return s;
    if (size > MOST_BYTES) {
        size = MOST_BYTES;
        journal->n_damaged++;
    }
    for (uint64_t from = 0; s == STATUS_OK && from < size && journal->n_damaged < MOST_DAMAGED;) {
        s = record_read(path, from, visit, &r, &from, err);
        if (s == STATUS_OK) s = r.s;
        if (s != STATUS_OK || from >= size) break;
        journal->n_damaged++;
        from = behind_line(fd, from, size);
    }
    close(fd);
    if (s == STATUS_OK && r.n_record == 0)
        s = error_set(err, STATUS_FORMAT, "cannot read '%s': it has no whole record", path);
    return s;
}

void job_journal_release(struct job_journal *journal)
{
    free(journal->file);
    journal->file = NULL;
    journal->n_file = 0;
}

enum { TAIL_BYTES = 1 << 16, CHECKSUM_BYTES = 9 /* and a blank, before each record */ };

/* updated_unix_s of a record about the job, or 0. */
static double updated_of(const struct journal_key *key, const char *text, size_t n, const char *id)
{
    if (!journal_sealed(key, text, n)) return 0;
    json_t *j = json_loadb(text, n, 0, NULL);
    const json_t *job = json_object_get(j, "job");
    const char *found = json_string_value(json_object_get(job, "id"));
    double t = found != NULL && strcmp(found, id) == 0 ? json_number_value(json_object_get(job, "updated_unix_s")) : 0;
    json_decref(j);
    return t;
}

/* Reads the end of a regular file; returns its number of bytes, at most TAIL_BYTES. */
static size_t read_tail(const char *path, char tail[TAIL_BYTES])
{
    struct stat st;
    ssize_t n = 0;
    int fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (fd >= 0 && fstat(fd, &st) == 0 && S_ISREG(st.st_mode))
        n = pread(fd, tail, TAIL_BYTES, st.st_size > TAIL_BYTES ? st.st_size - TAIL_BYTES : 0);
    if (fd >= 0) close(fd);
    return n > 0 ? (size_t)n : 0;
}

double job_journal_sealed_unix_s(const struct journal_key *key, const char *folder, const char *id)
{
    char path[FOLDER_BYTES];
    double t = 0;
    char *tail = key->known ? malloc(TAIL_BYTES) : NULL;
    if (tail == NULL) return 0;
    journal_path(folder, path);
    size_t end = read_tail(path, tail);
    while (t <= 0 && end > 0) { /* line by line from the end */
        size_t begin = end - 1;
        while (begin > 0 && tail[begin - 1] != '\n') begin--;
        if (tail[end - 1] == '\n' && end - begin > CHECKSUM_BYTES + 1)
            t = updated_of(key, tail + begin + CHECKSUM_BYTES, end - begin - CHECKSUM_BYTES - 1, id);
        end = begin;
    }
    free(tail);
    return t;
}
