#include "base/ranks/rank_team.h"
#include "base/clock.h"
#include "base/ranks/rank_team_data.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct order_head {
    uint64_t n_bytes;
    uint32_t kind;
    uint32_t to; /* the one rank that the order is for; 0: all helpers */
};

status rank_team_open(int fd, size_t rank, size_t n_rank, struct rank_team **team, struct error *err)
{
    struct rank_team *t = calloc(1, sizeof *t);
    if (t != NULL) t->buffer = malloc(RANK_MESSAGE_MOST);
    if (t == NULL || t->buffer == NULL) {
        free(t);
        return error_set(err, STATUS_NO_MEMORY, "cannot join the other ranks: out of memory");
    }
    t->fd = fd;
    t->rank = rank;
    t->n_rank = n_rank;
    *team = t;
    return STATUS_OK;
}

void rank_team_close(struct rank_team *t)
{
    if (t == NULL) return;
    if (t->rank == 0 && !t->broken) rank_team_order(t, RANK_ORDER_END, NULL, 0, NULL);
    close(t->fd);
    free(t->buffer);
    free(t);
}

size_t rank_team_rank(const struct rank_team *t) { return t->rank; }
size_t rank_team_n_rank(const struct rank_team *t) { return t->n_rank; }
bool rank_team_broken(const struct rank_team *t) { return t->broken; }
void rank_team_accompany(struct rank_team *t, void *companion) { t->companion = companion; }
void *rank_team_companion(const struct rank_team *t) { return t->companion; }

struct rank_traffic rank_team_traffic(const struct rank_team *t)
{
    struct rank_traffic traffic = t->traffic;
    traffic.cpu_s = clock_process_s();
    return traffic;
}

const atomic_bool *rank_team_cancel(const struct rank_team *t) { return &t->cancel; }

status rank_team_send(struct rank_team *t, size_t peer, enum rank_message kind, const void *data, size_t n_bytes,
                      struct error *err)
{
    const struct rank_frame frame = {
        .n_bytes = (uint32_t)n_bytes, .peer = (uint32_t)peer, .kind = (uint32_t)kind, .serial = t->serial};
    status s =
        t->broken ? error_set(err, STATUS_IO, "the other ranks are gone") : rank_link_send(t->fd, &frame, data, err);
    if (s != STATUS_OK) t->broken = true;
    return s;
}

status rank_team_receive(struct rank_team *t, int wait_ms, bool *got, struct rank_frame *frame, struct error *err)
{
    *got = false;
    if (t->broken) return error_set(err, STATUS_IO, "the other ranks are gone");
    status s = rank_link_receive(t->fd, wait_ms, got, frame, t->buffer, err);
    if (s != STATUS_OK) t->broken = true;
    if (!*got) return s;
    t->traffic.n_message++;
    if (frame->kind == RANK_CANCEL && frame->serial > t->cancelled) t->cancelled = frame->serial;
    if (frame->kind == RANK_CANCEL && frame->serial == t->serial) atomic_store(&t->cancel, true);
    *got = frame->kind == RANK_ORDER || frame->kind == RANK_PIECE ||
           (frame->kind != RANK_CANCEL && frame->serial == t->serial);
    return s;
}

/* Sends to the children of this rank in the binomial tree: to those whose number without its highest bit is its own.
 * An order for one rank takes its way along the tree, too, whose ranks keep the order of messages: sent straight, it
 * would overtake those for all that are on their way. */
static status send_on(struct rank_team *t, size_t to, enum rank_message kind, const void *data, size_t n_bytes,
                      struct error *err)
{
    status s = STATUS_OK;
    size_t bit = 1;
    while (bit <= t->rank) bit <<= 1;
    for (; t->rank + bit < t->n_rank && s == STATUS_OK; bit <<= 1)
        if (to == 0 || (to & (2 * bit - 1)) == t->rank + bit)
            s = rank_team_send(t, t->rank + bit, kind, data, n_bytes, err);
    return s;
}

static status send_order(struct rank_team *t, const struct order_head *head, const void *data, struct error *err)
{
    t->serial++;
    t->traffic.n_order++;
    t->traffic.order_bytes += head->n_bytes;
    status s = send_on(t, head->to, RANK_ORDER, head, sizeof *head, err);
    for (size_t done = 0; done < head->n_bytes && s == STATUS_OK;) {
        size_t n = head->n_bytes - done < RANK_MESSAGE_MOST ? head->n_bytes - done : RANK_MESSAGE_MOST;
        s = send_on(t, head->to, RANK_PIECE, (const char *)data + done, n, err);
        done += n;
    }
    return s;
}

status rank_team_order(struct rank_team *t, uint32_t kind, const void *data, size_t n_bytes, struct error *err)
{
    return send_order(t, &(struct order_head){.n_bytes = n_bytes, .kind = kind}, data, err);
}

status rank_team_order_to(struct rank_team *t, size_t rank, uint32_t kind, const void *data, size_t n_bytes,
                          struct error *err)
{
    return send_order(t, &(struct order_head){.n_bytes = n_bytes, .kind = kind, .to = (uint32_t)rank}, data, err);
}

/* Waits for a message of one kind. Besides it only an assignment can come, for a helper that was cancelled
 * meanwhile. */
static status expect(struct rank_team *t, enum rank_message kind, struct rank_frame *frame, struct error *err)
{
    bool got = false;
    status s = STATUS_OK;
    while ((!got || frame->kind == RANK_ASSIGN) && s == STATUS_OK) s = rank_team_receive(t, -1, &got, frame, err);
    if (s == STATUS_OK && frame->kind != (uint32_t)kind)
        s = error_set(err, STATUS_FORMAT, "rank %u sent message %u in place of an order", frame->peer, frame->kind);
    return s;
}

/* Waits for an order, and passes it on; order->data is NULL for one that is for another rank alone. */
static status take_order(struct rank_team *t, struct rank_order *order, struct error *err)
{
    struct rank_frame frame;
    struct order_head head;
    status s = expect(t, RANK_ORDER, &frame, err);
    if (s == STATUS_OK && frame.n_bytes != sizeof head)
        s = error_set(err, STATUS_FORMAT, "rank %u sent an order of %u bytes", frame.peer, frame.n_bytes);
    if (s != STATUS_OK) return s;
    memcpy(&head, t->buffer, sizeof head);
    t->serial = frame.serial;
    atomic_store(&t->cancel, t->cancelled == t->serial);
    *order = (struct rank_order){.kind = head.kind, .n_bytes = head.n_bytes};
    const bool mine = head.to == 0 || head.to == t->rank;
    if (mine) order->data = malloc(head.n_bytes > 0 ? head.n_bytes : 1);
    if (mine && order->data == NULL)
        return error_set(err, STATUS_NO_MEMORY, "rank %zu has no memory for an order of %llu bytes", t->rank,
                         (unsigned long long)head.n_bytes);
    s = send_on(t, head.to, RANK_ORDER, &head, sizeof head, err);
    for (size_t done = 0; done < head.n_bytes && s == STATUS_OK; done += frame.n_bytes) {
        s = expect(t, RANK_PIECE, &frame, err);
        if (s != STATUS_OK) break;
        if (frame.n_bytes == 0 || frame.n_bytes > head.n_bytes - done)
            return error_set(err, STATUS_FORMAT, "rank %u sent an order that is too long", frame.peer);
        if (mine) memcpy((char *)order->data + done, t->buffer, frame.n_bytes);
        s = send_on(t, head.to, RANK_PIECE, t->buffer, frame.n_bytes, err);
    }
    return s;
}

status rank_team_wait(struct rank_team *t, struct rank_order *order, struct error *err)
{
    status s = STATUS_OK;
    memset(order, 0, sizeof *order);
    while (!t->ended && order->data == NULL && s == STATUS_OK) s = take_order(t, order, err);
    return s;
}

void rank_team_heed(struct rank_team *t)
{
    struct rank_frame frame;
    bool got = true;
    while (got && !t->ended && rank_team_receive(t, 0, &got, &frame, NULL) == STATUS_OK)
        if (got && frame.kind == RANK_ORDER) rank_team_end_early(t);
    if (t->broken) atomic_store(&t->cancel, true);
}

void rank_team_end_early(struct rank_team *t)
{
    struct order_head head = {.kind = RANK_ORDER_END};
    t->ended = true;
    atomic_store(&t->cancel, true);
    send_on(t, 0, RANK_ORDER, &head, sizeof head, NULL);
}

void rank_order_release(struct rank_order *order)
{
    free(order->data);
    order->data = NULL;
}

void rank_team_refuse(struct rank_team *t, const struct error *why)
{
    struct rank_refusal r = {.code = (int32_t)why->code};
    if (t->answered == t->serial) return;
    t->answered = t->serial;
    snprintf(r.text, sizeof r.text, "%s", why->text);
    rank_team_send(t, 0, RANK_REFUSE, &r, sizeof r, NULL);
}

void rank_team_confirm(struct rank_team *t)
{
    t->answered = t->serial;
    rank_team_send(t, 0, RANK_DONE, NULL, 0, NULL);
}

status rank_team_refusal(const struct rank_team *t, const struct rank_frame *frame, struct error *err)
{
    struct rank_refusal r;
    if (frame->n_bytes != sizeof r)
        return error_set(err, STATUS_FORMAT, "rank %u sent a refusal of %u bytes", frame->peer, frame->n_bytes);
    memcpy(&r, t->buffer, sizeof r);
    r.text[sizeof r.text - 1] = '\0';
    return error_set(err, r.code > STATUS_OK ? (status)r.code : STATUS_INTERNAL, "rank %u: %s", frame->peer, r.text);
}

status rank_team_gather(struct rank_team *t, struct error *err)
{
    status s = STATUS_OK, refused = STATUS_OK;
    for (size_t n = 1; n < t->n_rank && s == STATUS_OK;) {
        struct rank_frame frame;
        bool got;
        s = rank_team_receive(t, -1, &got, &frame, err);
        if (!got || s != STATUS_OK) continue;
        if (frame.kind == RANK_REFUSE && refused == STATUS_OK) refused = rank_team_refusal(t, &frame, err);
        n++;
    }
    return s == STATUS_OK ? refused : s;
}
