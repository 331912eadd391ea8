#include "optimizer/fit/descent/estimate_journal.h"
#include "base/clock.h"
#include "base/files/durable.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

static const char magic[8] = {'S', 'E', 'L', 'V', 'J', 'N', 'L', '2'};

enum { FILE_HEADER_BYTES = 16, RECORD_HEADER_BYTES = 8 };

struct estimate_journal {
    int fd;
    char path[4096];
    const struct estimator *live;
    status (*may_write)(void *context, struct error *err);
    void *may_write_context;
    bool replaying;
    size_t n_replayed;
    off_t end;      /* after the last record in use */
    size_t n_bytes; /* of a payload: the same for every call of one fit */
    uint8_t *payload, *record;
    uint8_t *asked; /* call part of the payload expected next */
};

struct call_header {
    uint32_t iteration, replica, want_jacobian, n_configuration, n_param, padding;
    double wall_s;
};

static size_t call_bytes(const struct estimator *e)
{
    return sizeof(struct call_header) + e->n_param * sizeof(double) + e->n_configuration * sizeof(uint64_t);
}

static size_t payload_bytes(const struct estimator *e)
{
    size_t per_estimate = (6 + 6 * e->n_param) * sizeof(double) + 2 * sizeof(uint64_t) + sizeof(uint32_t) +
                          ESTIMATE_MAX_PARTNER * sizeof(struct estimate_partner);
    return call_bytes(e) + e->n_configuration * per_estimate;
}

static void put(uint8_t **p, const void *data, size_t n)
{
    memcpy(*p, data, n);
    *p += n;
}

static void get(const uint8_t **p, void *data, size_t n)
{
    memcpy(data, *p, n);
    *p += n;
}

/* Writes the call part of a payload to a buffer and returns the place after it. */
static uint8_t *put_call(const struct estimate_journal *j, const struct estimator_call *call, double wall_s,
                         uint8_t *to)
{
    const struct estimator *e = j->live;
    struct call_header h = {
        call->iteration, call->replica, call->want_jacobian, (uint32_t)e->n_configuration, (uint32_t)e->n_param, 0,
        wall_s};
    put(&to, &h, sizeof h);
    put(&to, call->param, e->n_param * sizeof(double));
    for (size_t i = 0; i < e->n_configuration; i++) {
        uint64_t n_path = call->n_path[i];
        put(&to, &n_path, sizeof n_path);
    }
    return to;
}

static void put_estimates(const struct estimate_journal *j, const struct estimate *out, uint8_t *to)
{
    size_t n_jac = 3 * j->live->n_param * sizeof(double);
    for (size_t i = 0; i < j->live->n_configuration; i++) {
        put(&to, out[i].mean, sizeof out[i].mean);
        put(&to, out[i].var, sizeof out[i].var);
        put(&to, out[i].jac, n_jac);
        put(&to, out[i].jac_var, n_jac);
        put(&to, &out[i].n_path, sizeof out[i].n_path);
        put(&to, &out[i].n_bounce, sizeof out[i].n_bounce);
        put(&to, &out[i].n_partner, sizeof out[i].n_partner);
        put(&to, out[i].partner, sizeof out[i].partner);
    }
}

static void get_estimates(const struct estimate_journal *j, const uint8_t *from, struct estimate *out)
{
    size_t n_jac = 3 * j->live->n_param * sizeof(double);
    for (size_t i = 0; i < j->live->n_configuration; i++) {
        memset(&out[i], 0, sizeof out[i]);
        get(&from, out[i].mean, sizeof out[i].mean);
        get(&from, out[i].var, sizeof out[i].var);
        get(&from, out[i].jac, n_jac);
        get(&from, out[i].jac_var, n_jac);
        get(&from, &out[i].n_path, sizeof out[i].n_path);
        get(&from, &out[i].n_bounce, sizeof out[i].n_bounce);
        get(&from, &out[i].n_partner, sizeof out[i].n_partner);
        get(&from, out[i].partner, sizeof out[i].partner);
    }
}

static bool read_exactly(int fd, void *to, size_t n, off_t at)
{
    uint8_t *p = to;
    while (n > 0) {
        ssize_t got = pread(fd, p, n, at);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        p += got;
        at += got;
        n -= (size_t)got;
    }
    return true;
}

static status write_exactly(const struct estimate_journal *j, const void *from, size_t n, off_t at, struct error *err)
{
    const uint8_t *p = from;
    while (n > 0) {
        ssize_t put_n = pwrite(j->fd, p, n, at);
        if (put_n < 0 && errno == EINTR) continue;
        if (put_n <= 0) return error_set_errno(err, "cannot write checkpoint '%s'", j->path);
        p += put_n;
        at += put_n;
        n -= (size_t)put_n;
    }
    if (fdatasync(j->fd) != 0) return error_set_errno(err, "cannot write checkpoint '%s'", j->path);
    return STATUS_OK;
}

static status start_file(struct estimate_journal *j, uint64_t fingerprint, struct error *err)
{
    uint8_t want[FILE_HEADER_BYTES], have[FILE_HEADER_BYTES];
    memcpy(want, magic, sizeof magic);
    memcpy(want + 8, &fingerprint, sizeof fingerprint);
    j->end = FILE_HEADER_BYTES;
    j->replaying = read_exactly(j->fd, have, sizeof have, 0) && memcmp(want, have, sizeof want) == 0;
    if (j->replaying) return STATUS_OK;
    if (ftruncate(j->fd, 0) != 0) return error_set_errno(err, "cannot start checkpoint '%s'", j->path);
    status s = write_exactly(j, want, sizeof want, 0, err);
    return s == STATUS_OK ? durable_sync_folder_of(j->path, err) : s;
}

status estimate_journal_open(const char *path, uint64_t fingerprint, const struct estimator *live,
                             status (*may_write)(void *context, struct error *err), void *may_write_context,
                             struct estimate_journal **journal, struct error *err)
{
    struct estimate_journal *j = calloc(1, sizeof *j);
    if (j == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot open checkpoint '%s': out of memory", path);
    status s = STATUS_OK;
    j->live = live;
    j->may_write = may_write;
    j->may_write_context = may_write_context;
    j->n_bytes = payload_bytes(live);
    j->record = malloc(RECORD_HEADER_BYTES + j->n_bytes);
    j->payload = j->record != NULL ? j->record + RECORD_HEADER_BYTES : NULL;
    j->asked = malloc(call_bytes(live));
    size_t n_path = strlen(path);
    j->fd = -1;
    if (j->record == NULL || j->asked == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot open checkpoint '%s': out of memory", path);
        goto out;
    }
    if (n_path >= sizeof j->path) {
        s = error_set(err, STATUS_INVALID, "cannot open checkpoint '%.200s...': its path is too long", path);
        goto out;
    }
    memcpy(j->path, path, n_path + 1);
    j->fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (j->fd < 0) {
        s = error_set_errno(err, "cannot open checkpoint '%s'", path);
        goto out;
    }
    s = start_file(j, fingerprint, err);
    if (s != STATUS_OK) goto out;
    *journal = j;
    j = NULL;
out:
    estimate_journal_close(j);
    return s;
}

void estimate_journal_close(struct estimate_journal *j)
{
    if (j == NULL) return;
    if (j->fd >= 0) close(j->fd);
    free(j->record);
    free(j->asked);
    free(j);
}

/* Answers a call from the file. Returns false, which ends the replay, when the next record is absent, damaged or of
 * another call. */
static bool replay(struct estimate_journal *j, const struct estimator_call *call, struct estimate *out, double *wall_s)
{
    uint32_t head[2];
    struct call_header h;
    if (!read_exactly(j->fd, j->record, RECORD_HEADER_BYTES + j->n_bytes, j->end)) return false;
    memcpy(head, j->record, sizeof head);
    if (head[0] != j->n_bytes || head[1] != crc32(0, j->payload, (unsigned)j->n_bytes)) return false;
    memcpy(&h, j->payload, sizeof h);
    size_t n_call = call_bytes(j->live);
    put_call(j, call, h.wall_s, j->asked);
    if (memcmp(j->asked, j->payload, n_call) != 0) return false;
    get_estimates(j, j->payload + n_call, out);
    *wall_s = h.wall_s;
    j->end += (off_t)(RECORD_HEADER_BYTES + j->n_bytes);
    j->n_replayed++;
    return true;
}

static status append(struct estimate_journal *j, const struct estimator_call *call, const struct estimate *out,
                     double wall_s, struct error *err)
{
    status s = j->may_write != NULL ? j->may_write(j->may_write_context, err) : STATUS_OK;
    if (s != STATUS_OK) return s;
    put_estimates(j, out, put_call(j, call, wall_s, j->payload));
    uint32_t head[2] = {(uint32_t)j->n_bytes, (uint32_t)crc32(0, j->payload, (unsigned)j->n_bytes)};
    memcpy(j->record, head, sizeof head);
    s = write_exactly(j, j->record, RECORD_HEADER_BYTES + j->n_bytes, j->end, err);
    if (s == STATUS_OK) j->end += (off_t)(RECORD_HEADER_BYTES + j->n_bytes);
    return s;
}

static status run(void *context, const struct estimator_call *call, const struct progress *progress,
                  struct estimate *out, double *wall_s, struct error *err)
{
    struct estimate_journal *j = context;
    if (j->replaying) {
        if (replay(j, call, out, wall_s)) return STATUS_OK;
        j->replaying = false;
        if (ftruncate(j->fd, j->end) != 0) return error_set_errno(err, "cannot cut checkpoint '%s'", j->path);
    }
    status s = j->live->run(j->live->context, call, progress, out, wall_s, err);
    return s == STATUS_OK ? append(j, call, out, *wall_s, err) : s;
}

struct estimator estimate_journal_estimator(struct estimate_journal *j)
{
    return (struct estimator){
        .context = j, .n_configuration = j->live->n_configuration, .n_param = j->live->n_param, .run = run};
}

bool estimate_journal_replaying(const struct estimate_journal *j) { return j->replaying; }
size_t estimate_journal_n_replayed(const struct estimate_journal *j) { return j->n_replayed; }
