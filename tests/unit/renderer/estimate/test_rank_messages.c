/* Messages between ranks that are cut short, altered or sent without being asked for: an error, and nothing is read or
 * written beyond what there is. */
#include "base/ranks/byte_pack.h"
#include "base/ranks/rank_link.h"
#include "base/ranks/rank_team_data.h"
#include "base/rng.h"
#include "renderer/estimate/rank_orders.h"
#include "renderer/scene/scene_pack.h"
#include "renderer/transport/volume/volume_scene.h"
#include "tests/support/tracer/environment/painted_environment.h"
#include "tests/support/tracer/estimate_fixture.h"

#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

/* ---- assignments ---- */

enum { N_TASK = 16, MOST_SPAN = 40 }; /* of two ranks: rank 1 has tasks 4 to 7 beforehand, and 8 to 15 are common */

/* What a root sends that is not one: so many assignments at once, then one whenever it is asked. */
struct false_root {
    int fd;
    size_t n_at_once, n_span;
    uint64_t span[MOST_SPAN][2];
    size_t n_result; /* tasks whose results it has got */
    bool done;       /* the helper has said that it is */
};

static void assign(struct false_root *r, size_t i)
{
    const struct rank_frame f = {.n_bytes = sizeof r->span[i], .kind = RANK_ASSIGN};
    if (i < r->n_span) rank_link_send(r->fd, &f, r->span[i], NULL);
}

static void *root_main(void *context)
{
    struct false_root *r = context;
    struct rank_frame f;
    bool got = true;
    char *buffer = malloc(RANK_MESSAGE_MOST);
    for (size_t i = 0; i < r->n_at_once; i++) assign(r, i);
    for (size_t i = r->n_at_once; rank_link_receive(r->fd, -1, &got, &f, buffer, NULL) == STATUS_OK;) {
        r->n_result += f.n_bytes / (2 * sizeof(uint32_t)); /* a result is a head without a body */
        if (f.kind == RANK_REQUEST) assign(r, i++);
        r->done |= f.kind == RANK_DONE;
    }
    free(buffer);
    return NULL;
}

static void count_run(void *context, size_t i_task, size_t i_thread)
{
    size_t *n_run = context;
    (void)i_thread;
    assert_in_range(i_task, 0, N_TASK - 1);
    n_run[i_task]++;
}

static size_t pack_nothing(void *context, size_t i_task, void *to)
{
    (void)context;
    (void)i_task;
    (void)to;
    return 0;
}

static status share_as_helper(struct false_root *r, size_t n_run[N_TASK], struct error *err)
{
    int end[2];
    pthread_t root;
    struct rank_team *team = NULL;
    struct thread_pool *pool = NULL;
    const struct rank_work work = {.n_task = N_TASK, .run = count_run, .pack = pack_nothing, .context = n_run};
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, end), 0);
    r->fd = end[0];
    assert_int_equal(rank_team_open(end[1], 1, 2, &team, err), STATUS_OK);
    assert_int_equal(thread_pool_new(1, &pool, err), STATUS_OK);
    assert_int_equal(pthread_create(&root, NULL, root_main, r), 0);
    status s = rank_team_share(team, &work, pool, NULL, err);
    rank_team_close(team);
    thread_pool_free(pool);
    pthread_join(root, NULL);
    close(end[0]);
    return s;
}

static void only_tasks_that_were_asked_for_are_run(void **state)
{
    (void)state;
    struct false_root root[] = {
        {.n_span = 3, .span = {{8, 4}, {14, 2}, {16, 0}}}, /* as a root does */
        {.n_span = MOST_SPAN, .n_at_once = MOST_SPAN},     /* unasked, all tasks each time: filled in below */
        {.n_span = 2, .span = {{0, 16}, {16, 0}}},         /* those of others, and its own again */
        {.n_span = 3, .span = {{8, 8}, {8, 8}, {16, 0}}},  /* the same ones again */
        {.n_span = 2, .span = {{8, 9}, {16, 0}}},          /* more than there are */
        {.n_span = 2, .span = {{UINT64_MAX, 2}, {16, 0}}}};
    for (size_t i = 0; i < MOST_SPAN; i++) root[1].span[i][1] = N_TASK;
    for (size_t i = 0; i < sizeof root / sizeof *root; i++) {
        size_t n_run[N_TASK] = {0};
        struct error err = {0};
        const bool good = i == 0;
        assert_int_equal(share_as_helper(&root[i], n_run, &err), good ? STATUS_OK : STATUS_FORMAT);
        for (size_t t = 0; t < N_TASK; t++) assert_in_range(n_run[t], 0, 1);
        assert_true(root[i].done == good); /* otherwise its caller refuses, and the root learns why */
        if (good) assert_int_equal(root[i].n_result, 4 + 4 + 2);
        if (!good) assert_non_null(strstr(err.text, "assigns no tasks of rank 1"));
    }
}

/* ---- orders ---- */

enum { N_TREE = 12, ORDER_KIND = 7 };

/* A rank of the tree, whose messages the test carries. */
struct carried_rank {
    struct rank_team *team;
    int fd; /* the other end of its socket */
};

static struct carried_rank join(size_t rank)
{
    int end[2];
    struct carried_rank r = {.team = NULL};
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, end), 0);
    assert_int_equal(rank_team_open(end[1], rank, N_TREE, &r.team, NULL), STATUS_OK);
    r.fd = end[0];
    return r;
}

/* Hands what a rank has sent to the rank that it is for, after which nothing more comes, and returns which one. */
static size_t carry(const struct carried_rank *from, struct carried_rank *to)
{
    struct rank_frame f;
    size_t peer = 0;
    bool got = true;
    char *buffer = malloc(RANK_MESSAGE_MOST);
    while (rank_link_receive(from->fd, 0, &got, &f, buffer, NULL) == STATUS_OK && got) {
        if (peer == 0) *to = join(f.peer);
        if (peer > 0) assert_int_equal(f.peer, peer);
        peer = f.peer;
        assert_int_equal(rank_link_send(to->fd, &f, buffer, NULL), STATUS_OK);
    }
    assert_in_range(peer, 1, N_TREE - 1);
    shutdown(to->fd, SHUT_WR);
    free(buffer);
    return peer;
}

static void leave(struct carried_rank *r)
{
    rank_team_close(r->team);
    close(r->fd);
}

/* A rank gets all orders from its parent in the tree, whose number is its own without the highest bit: with two ways to
 * a rank, one order could overtake another. Ranks on the way pass the order on and do not follow it. */
static void an_order_for_one_rank_takes_the_way_of_all(void **state)
{
    (void)state;
    for (size_t to = 1; to < N_TREE; to++) {
        size_t parent = 0, rank = 0, before = 0;
        struct rank_order order;
        struct carried_rank from = join(0), next;
        for (size_t bit = 1; bit <= to; bit *= 2) parent = to % bit;
        assert_int_equal(rank_team_order_to(from.team, to, ORDER_KIND, "rows", 4, NULL), STATUS_OK);
        for (; rank != to; from = next) {
            before = rank;
            rank = carry(&from, &next);
            leave(&from);
            assert_int_equal(rank_team_wait(next.team, &order, NULL), rank == to ? STATUS_OK : STATUS_IO);
        }
        assert_int_equal(before, parent);
        assert_int_equal(order.kind, ORDER_KIND);
        assert_int_equal(order.n_bytes, 4);
        assert_memory_equal(order.data, "rows", 4);
        rank_order_release(&order);
        leave(&from);
    }
}

/* ---- cloths ---- */

static status unpack_volume(const struct byte_pack *p, size_t n_bytes)
{
    struct volume_scene got;
    struct byte_view v = {.data = p->data, .n = n_bytes};
    status s = volume_scene_unpack(&v, &got, NULL);
    if (s != STATUS_OK) return s;
    uint32_t sum = 0; /* of all voxels: the sanitizers see where one is read that is not there */
    for (size_t k = 0; k < got.n[2]; k++)
        for (size_t j = 0; j < got.n[1]; j++)
            for (size_t i = 0; i < got.n[0]; i++) sum += volume_scene_voxel(&got, i, j, k);
    volume_scene_release(&got);
    return sum > 0 ? STATUS_OK : STATUS_NUMERIC;
}

static status unpack_scene(const struct byte_pack *p, size_t n_bytes)
{
    struct scene *got = NULL;
    struct byte_view v = {.data = p->data, .n = n_bytes};
    status s = scene_unpack(&v, &got, NULL);
    if (s == STATUS_OK) scene_free(got);
    return s;
}

static status unpack_environment(const struct byte_pack *p, size_t n_bytes)
{
    struct environment *got = NULL;
    struct byte_view v = {.data = p->data, .n = n_bytes};
    status s = environment_unpack(&v, &got, NULL);
    environment_free(got);
    return s;
}

typedef status unpack_function(const struct byte_pack *p, size_t n_bytes);

/* Whole it is taken, cut at any of 200 places it is not; altered in one byte it is taken or not. */
static void cut_and_alter(struct byte_pack *p, unpack_function *unpack)
{
    enum { N_CUT = 200, N_ALTER = 200, HEAD_BYTES = 120 };
    struct rng r;
    rng_start(&r, &(struct rng_key){.seed = 24}, 0, 0);
    assert_int_equal(unpack(p, p->n), STATUS_OK);
    for (size_t i = 0; i < N_CUT; i++) {
        status s = unpack(p, p->n * i / N_CUT);
        assert_true(s == STATUS_FORMAT || s == STATUS_NO_MEMORY);
    }
    for (size_t i = 0; i < N_ALTER; i++) { /* most of them in what describes the rest */
        const size_t room = i % 4 > 0 && p->n > HEAD_BYTES ? HEAD_BYTES : p->n;
        char *at = p->data + (size_t)(rng_double(&r) * (double)room), before = *at;
        *at = (char)(*at ^ (1 << (int)(rng_double(&r) * 8)));
        unpack(p, p->n);
        *at = before;
    }
    assert_int_equal(unpack(p, p->n), STATUS_OK);
}

static void fill(struct direction_volume *v)
{
    const size_t n[3] = {10, 9, 8};
    const float along[3] = {1, 0, 0};
    assert_int_equal(direction_volume_init(v, n, (const double[3]){1e-5, 1e-5, 1e-5}, NULL), STATUS_OK);
    for (size_t i = 0; i < 3 * n[0] * n[1]; i++) {
        v->density[i] = 200;
        direction_volume_set(v, i, along);
    }
}

static void a_volume_is_taken_only_whole(void **state)
{
    (void)state;
    struct direction_volume v;
    struct volume_scene scene;
    struct byte_pack p = {0};
    fill(&v);
    assert_int_equal(volume_scene_init(&scene, &v, &(struct volume_scene_option){false}, NULL), STATUS_OK);
    volume_scene_pack(&scene, &p);
    cut_and_alter(&p, unpack_volume);
    const struct {
        float low, high;
        int32_t brick;
    } wrong[] = {{0, 3, (int32_t)scene.n_stored}, {0, 3, -VOLUME_EMPTY_MAX - 1}, {0, 3, INT32_MIN},
                 {3, 0, scene.brick[0]},          {0, 9, scene.brick[0]},        {-1, 3, scene.brick[0]}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct volume_scene bad = scene;
        int32_t before = scene.brick[0];
        struct byte_pack q = {0};
        bad.low = wrong[i].low;
        bad.high = wrong[i].high;
        bad.brick[0] = wrong[i].brick;
        volume_scene_pack(&bad, &q);
        scene.brick[0] = before;
        assert_int_equal(unpack_volume(&q, q.n), STATUS_FORMAT);
        byte_pack_release(&q);
    }
    byte_pack_release(&p);
    volume_scene_release(&scene);
    direction_volume_release(&v);
}

static void fibers_are_taken_only_whole(void **state)
{
    (void)state;
    struct estimate_fixture x;
    struct byte_pack p = {0};
    assert_int_equal(estimate_fixture_init(&x), 0);
    scene_pack(x.scene, &p);
    cut_and_alter(&p, unpack_scene);
    byte_pack_release(&p);
    estimate_fixture_release(&x);
}

static void an_environment_is_taken_only_whole(void **state)
{
    (void)state;
    struct environment *sky = painted_environment(8, 4, paint_sky);
    struct byte_pack p = {0};
    environment_pack(sky, &p);
    cut_and_alter(&p, unpack_environment);
    byte_pack_release(&p);
    environment_free(sky);
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(only_tasks_that_were_asked_for_are_run),
        cmocka_unit_test(an_order_for_one_rank_takes_the_way_of_all), cmocka_unit_test(a_volume_is_taken_only_whole),
        cmocka_unit_test(fibers_are_taken_only_whole), cmocka_unit_test(an_environment_is_taken_only_whole)};
    signal(SIGPIPE, SIG_IGN);
    alarm(300); /* a helper that waits for what never comes ends the test */
    return cmocka_run_group_tests(test, NULL, NULL);
}
