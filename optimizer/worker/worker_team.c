#include "optimizer/worker/worker_team.h"

#include "optimizer/job/job_folder.h"
#include "optimizer/report/result/result_json.h"
#include "optimizer/stages/run/worker_folder.h"
#include "renderer/estimate/rank_helper.h"
#include "renderer/estimate/rank_orders.h"
#include "renderer/scene/scene_pack.h"

#include <fcntl.h>
#include <gnu/libc-version.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { TEXT_BYTES = 160, PATH_BYTES_MOST = 4096 };

bool worker_team_parse(const char *text, struct worker_team_place *p)
{
    *p = (struct worker_team_place){.given = true, .fd = -1, .n_rank = 1};
    if (strcmp(text, "none") == 0) return true;
    if (sscanf(text, "%d,%zu,%zu", &p->fd, &p->rank, &p->n_rank) != 3) return false;
    return p->fd > STDERR_FILENO && p->n_rank > 1 && p->n_rank <= RANK_TEAM_MOST && p->rank < p->n_rank;
}

bool worker_team_is_started(void)
{
    /* Open MPI, MPICH and its kin, a step of srun */
    static const char *const size[] = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"};
    static const char *const rank[] = {"OMPI_COMM_WORLD_RANK", "PMI_RANK", "SLURM_PROCID"};
    for (size_t i = 0; i < sizeof size / sizeof *size; i++) {
        const char *n = getenv(size[i]);
        if (n != NULL && getenv(rank[i]) != NULL && strtol(n, NULL, 10) > 1) return true;
    }
    return false;
}

status worker_team_program(char *path, size_t n_bytes, struct error *err)
{
    static const char name[] = "selvedge-mpi";
    ssize_t n = readlink("/proc/self/exe", path, n_bytes - sizeof name - 1);
    if (n <= 0) return error_set_errno(err, "cannot find this program");
    path[n] = '\0';
    char *slash = strrchr(path, '/');
    memcpy(slash != NULL ? slash + 1 : path, name, sizeof name);
    return access(path, X_OK) == 0
               ? STATUS_OK
               : error_set(err, STATUS_NOT_FOUND,
                           "cannot run a job with several ranks: '%s' is not there; it is built where libopenmpi-dev "
                           "is installed",
                           path);
}

status worker_team_join(char **argv, struct error *err)
{
    char program[PATH_BYTES_MOST], own[PATH_BYTES_MOST];
    status s = worker_team_program(program, sizeof program, err);
    if (s != STATUS_OK) return s;
    size_t n = 0;
    while (argv[n] != NULL) n++;
    char **again = calloc(n + 2, sizeof *again);
    ssize_t n_own = readlink("/proc/self/exe", own, sizeof own - 1);
    if (again == NULL || n_own <= 0) {
        free(again);
        return error_set(err, STATUS_NO_MEMORY, "cannot join the other ranks: out of memory");
    }
    own[n_own] = '\0';
    again[0] = program;
    again[1] = own;
    memcpy(again + 2, argv + 1, (n - 1) * sizeof *again);
    execv(program, again);
    free(again);
    return error_set_errno(err, "cannot execute '%s'", program);
}

/* Values that must be equal in all ranks for equal paths, bit by bit. */
static void describe_self(char text[TEXT_BYTES])
{
    const char *processor = "other";
#ifdef __x86_64__
    processor = __builtin_cpu_supports("avx512f") ? "AVX-512" : "AVX2";
#endif
    snprintf(text, TEXT_BYTES, "%s, build %08llx, Embree %u, libc %s, processor with %s", RESULT_PROGRAM,
             (unsigned long long)document_fingerprint("", 0), scene_engine_version(), gnu_get_libc_version(),
             processor);
}

status worker_team_open(struct worker_team *t, const struct worker_team_place *place, struct thread_pool *pool,
                        struct error *err)
{
    char mine[TEXT_BYTES];
    if (place->fd < 0) return STATUS_OK;
    fcntl(place->fd, F_SETFD, FD_CLOEXEC);
    status s = rank_team_open(place->fd, place->rank, place->n_rank, &t->team, err);
    if (s != STATUS_OK) return s;
    rank_team_accompany(t->team, &t->cloth);
    describe_self(mine);
    s = rank_orders_agree(t->team, mine, err);
    if (s == STATUS_OK) thread_pool_join_team(pool, t->team);
    return s;
}

bool worker_team_lost(const struct worker_team *t) { return t->team != NULL && rank_team_broken(t->team); }

void worker_team_close(struct worker_team *t, struct thread_pool *pool, struct log *log)
{
    if (t->team == NULL) return;
    if (rank_team_broken(t->team))
        log_error(log, "another rank is lost: the job goes on from its checkpoint when it runs again");
    if (pool != NULL) thread_pool_join_team(pool, NULL);
    rank_team_close(t->team);
    shared_cloth_release(&t->cloth);
    t->team = NULL;
}

void worker_team_begin_stage(struct thread_pool *pool, struct rank_traffic *before)
{
    const struct rank_team *team = thread_pool_team(pool);
    if (team != NULL) *before = rank_team_traffic(team);
}

void worker_team_end_stage(struct thread_pool *pool, const struct rank_traffic *before, const char *stage,
                           struct log *log)
{
    const struct rank_team *team = thread_pool_team(pool);
    if (team == NULL) return;
    const struct rank_traffic r = rank_team_traffic(team);
    if (r.n_share == before->n_share) return;
    log_info(log,
             "stage %s: %zu ranks shared work %zu times (%zu tasks, %.2f s): %zu orders of %llu bytes, %llu "
             "bytes of results in %zu messages; rank 0 waited %.3f s for others, and ran %zu tasks in %.3f s of "
             "processor time, of %.3f s for shared work and %.3f s in all",
             stage, rank_team_n_rank(team), r.n_share - before->n_share, r.n_task - before->n_task,
             r.share_s - before->share_s, r.n_order - before->n_order,
             (unsigned long long)(r.order_bytes - before->order_bytes),
             (unsigned long long)(r.result_bytes - before->result_bytes), r.n_message - before->n_message,
             r.wait_s - before->wait_s, r.n_own - before->n_own, r.own_cpu_s - before->own_cpu_s,
             r.share_cpu_s - before->share_cpu_s, r.cpu_s - before->cpu_s);
}

int worker_team_help(const struct worker_team_place *place, size_t n_thread)
{
    struct rank_team *team = NULL;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    char mine[TEXT_BYTES];
    signal(SIGTERM, SIG_IGN); /* rank 0 decides when the job ends */
    signal(SIGINT, SIG_IGN);
    signal(SIGPIPE, SIG_IGN);
    fcntl(place->fd, F_SETFD, FD_CLOEXEC);
    describe_self(mine);
    status s = thread_pool_new(n_thread, &pool, &err);
    if (s == STATUS_OK) s = rank_team_open(place->fd, place->rank, place->n_rank, &team, &err);
    if (s == STATUS_OK) {
        thread_pool_join_team(pool, team);
        s = rank_helper_serve(team, pool, mine, &err);
    }
    if (s != STATUS_OK) fprintf(stderr, "selvedge-worker: rank %zu: %s\n", place->rank, err.text);
    thread_pool_free(pool);
    rank_team_close(team);
    return s == STATUS_OK ? WORKER_SUCCEEDED : WORKER_FAILED;
}
