#include "tests/support/ranks/two_ranks.h"

#include "renderer/estimate/rank_helper.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

static int helper_main(int fd, size_t n_thread)
{
    struct rank_team *team = NULL;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    if (thread_pool_new(n_thread, &pool, &err) != STATUS_OK) return 1;
    if (rank_team_open(fd, 1, 2, &team, &err) != STATUS_OK) return 1;
    thread_pool_join_team(pool, team);
    status s = rank_helper_serve(team, pool, "the test", &err);
    if (s != STATUS_OK) fprintf(stderr, "helper: %s\n", err.text);
    rank_team_close(team);
    thread_pool_free(pool);
    return s != STATUS_OK;
}

void two_ranks_start(struct two_ranks *r, size_t n_thread)
{
    int end[2];
    struct error err = {0};
    memset(r, 0, sizeof *r);
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, end), 0);
    r->helper = fork();
    if (r->helper == 0) {
        close(end[0]);
        _exit(helper_main(end[1], n_thread));
    }
    close(end[1]);
    assert_int_equal(rank_team_open(end[0], 0, 2, &r->team, &err), STATUS_OK);
    rank_team_accompany(r->team, &r->cloth);
    assert_int_equal(thread_pool_new(n_thread, &r->pool, &err), STATUS_OK);
    thread_pool_join_team(r->pool, r->team);
}

int two_ranks_end(struct two_ranks *r)
{
    int how = 0;
    rank_team_close(r->team);
    thread_pool_free(r->pool);
    shared_cloth_release(&r->cloth);
    waitpid(r->helper, &how, 0);
    return how;
}
