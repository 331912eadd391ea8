/* selvedge-mpi PROGRAM ARGUMENTS...: one rank of a job. Starts the worker program with one end of a socket and carries
 * its messages (base/ranks/rank_link.h) to the other ranks by MPI. MPI thus stays out of the worker: its sandbox needs
 * no rights for transports, and machines without MPI need no library of it. The worker gets "--team FD,RANK,RANKS", or
 * "--team none" when it is alone.
 *
 * The loop sleeps while nothing happens, and wakes at once when the worker sends. Exit status: the worker's; EXIT_LOST
 * when another rank is lost, whereupon MPI ends all of them; EXIT_FORBIDDEN when a rank was lost because its sandbox
 * has ended it. */
#include "base/ranks/rank_link.h"
#include "base/version.h"

#include <errno.h>
#include <fcntl.h>
#include <mpi.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { EXIT_USAGE = 2, EXIT_LOST = 75, EXIT_CANNOT_EXECUTE = 127, EXIT_FORBIDDEN = 128 + SIGSYS };
enum { CLOSE_KIND = 1000, QUEUE_MOST_BYTES = 64 << 20 };

/* A message on its way. */
struct message {
    struct message *next;
    MPI_Request request;    /* of one to another rank */
    size_t n_bytes, n_done; /* with the frame; written to, or read from, the worker */
    struct rank_frame frame;
    char data[];
};

struct queue {
    struct message *first, **last;
    size_t n_bytes;
};

struct agent {
    int rank, n_rank, fd; /* fd: the worker's */
    pid_t worker;
    bool worker_ended, closing;
    int code;
    struct queue to_worker, to_rank;
    struct rank_frame head; /* of the message that the worker is sending */
    size_t n_head;
    struct message *reading;
};

static volatile sig_atomic_t stop_wanted;

static void want_stop(int signal_number)
{
    (void)signal_number;
    stop_wanted = 1;
}

static _Noreturn void lost(const struct agent *a, const char *what)
{
    const int code = a->code == EXIT_FORBIDDEN ? EXIT_FORBIDDEN : EXIT_LOST;
    fprintf(stderr, "selvedge-mpi: rank %d is lost: %s\n", a->rank, what);
    MPI_Abort(MPI_COMM_WORLD, code);
    _exit(code);
}

static struct message *message_new(const struct agent *a, const struct rank_frame *frame)
{
    struct message *m = calloc(1, sizeof *m + frame->n_bytes);
    if (m == NULL) lost(a, "out of memory");
    m->frame = *frame;
    m->n_bytes = sizeof m->frame + frame->n_bytes;
    return m;
}

static void append(struct queue *q, struct message *m)
{
    if (q->first == NULL) q->last = &q->first;
    *q->last = m;
    q->last = &m->next;
    q->n_bytes += m->n_bytes;
}

static void drop_first(struct queue *q)
{
    struct message *m = q->first;
    q->first = m->next;
    q->n_bytes -= m->n_bytes;
    free(m);
}

/* ---- the worker ---- */

/* In the child: waits for its place among the ranks, and becomes the worker. */
static _Noreturn void become_worker(int fd, pid_t parent, char **argv)
{
    int place[2];
    char team[64];
    size_t n = 0;
    ssize_t got;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    setpgid(0, 0); /* mpirun signals whole process groups, and means this program */
    signal(SIGUSR1, SIG_IGN);
    signal(SIGPIPE, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
    signal(SIGINT, SIG_DFL);
    if (getppid() != parent) _exit(EXIT_CANNOT_EXECUTE);
    do got = read(fd, place, sizeof place);
    while (got < 0 && errno == EINTR);
    if (got != (ssize_t)sizeof place) _exit(EXIT_CANNOT_EXECUTE);
    while (argv[n] != NULL) n++;
    char **again = calloc(n + 3, sizeof *again);
    if (again == NULL) _exit(EXIT_CANNOT_EXECUTE);
    if (place[1] == 1)
        snprintf(team, sizeof team, "none");
    else
        snprintf(team, sizeof team, "%d,%d,%d", fd, place[0], place[1]);
    again[0] = argv[0];
    again[1] = (char *)(uintptr_t) "--team";
    again[2] = team;
    memcpy(again + 3, argv + 1, (n - 1) * sizeof *again);
    execv(argv[0], again);
    fprintf(stderr, "selvedge-mpi: cannot execute '%s': %s\n", argv[0], strerror(errno));
    _exit(EXIT_CANNOT_EXECUTE);
}

/* The child is made before MPI starts threads and opens devices, because it must not have a copy of them. It blocks
 * SIGTERM and SIGINT, so that one that comes before the worker can take it is kept for it. */
static bool start_worker(struct agent *a, char **argv)
{
    int end[2];
    sigset_t stop, before;
    const pid_t self = getpid();
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, end) != 0) return false;
    sigemptyset(&stop);
    sigaddset(&stop, SIGTERM);
    sigaddset(&stop, SIGINT);
    sigprocmask(SIG_BLOCK, &stop, &before);
    a->worker = fork();
    if (a->worker == 0) {
        close(end[0]);
        become_worker(end[1], self, argv);
    }
    sigprocmask(SIG_SETMASK, &before, NULL);
    close(end[1]);
    a->fd = end[0];
    return a->worker > 0 && fcntl(a->fd, F_SETFD, FD_CLOEXEC) == 0;
}

static void send_to_rank(struct agent *a, struct message *m)
{
    const struct rank_frame *f = &m->frame;
    if (f->peer >= (uint32_t)a->n_rank || f->kind >= CLOSE_KIND) lost(a, "its worker sends nonsense");
    MPI_Isend(&m->frame, (int)m->n_bytes, MPI_BYTE, (int)f->peer, 0, MPI_COMM_WORLD, &m->request);
    append(&a->to_rank, m);
}

/* Reads the worker's messages. */
static bool read_worker(struct agent *a)
{
    bool any = false;
    while (a->to_rank.n_bytes < QUEUE_MOST_BYTES) {
        struct message *m = a->reading;
        char *to = m == NULL ? (char *)&a->head + a->n_head : m->data + m->n_done;
        size_t want = m == NULL ? sizeof a->head - a->n_head : m->frame.n_bytes - m->n_done;
        ssize_t got = want == 0 ? 0 : recv(a->fd, to, want, MSG_DONTWAIT);
        if (want > 0 && got <= 0) break;
        any = true;
        if (m == NULL) {
            a->n_head += (size_t)got;
            if (a->n_head < sizeof a->head) continue;
            if (a->head.n_bytes > RANK_MESSAGE_MOST) lost(a, "its worker sends a message that is too long");
            a->reading = message_new(a, &a->head);
            a->n_head = 0;
            continue;
        }
        m->n_done += (size_t)got;
        if (m->n_done < m->frame.n_bytes) continue;
        a->reading = NULL;
        send_to_rank(a, m);
    }
    return any;
}

static bool write_worker(struct agent *a)
{
    bool any = false;
    while (a->to_worker.first != NULL) {
        struct message *m = a->to_worker.first;
        ssize_t put =
            send(a->fd, (const char *)&m->frame + m->n_done, m->n_bytes - m->n_done, MSG_DONTWAIT | MSG_NOSIGNAL);
        if (put <= 0) break;
        any = true;
        m->n_done += (size_t)put;
        if (m->n_done == m->n_bytes) drop_first(&a->to_worker);
    }
    if (a->closing && a->to_worker.first == NULL) shutdown(a->fd, SHUT_WR);
    return any;
}

/* ---- the other ranks ---- */

static bool finish_sends(struct agent *a)
{
    bool any = false;
    while (a->to_rank.first != NULL) {
        int done = 0;
        MPI_Test(&a->to_rank.first->request, &done, MPI_STATUS_IGNORE);
        if (!done) break;
        drop_first(&a->to_rank);
        any = true;
    }
    return any;
}

static bool receive(struct agent *a)
{
    bool any = false;
    while (a->to_worker.n_bytes < QUEUE_MOST_BYTES) {
        int there = 0, n = 0;
        MPI_Message handle;
        MPI_Status from;
        MPI_Improbe(MPI_ANY_SOURCE, 0, MPI_COMM_WORLD, &there, &handle, &from);
        if (!there) break;
        any = true;
        MPI_Get_count(&from, MPI_BYTE, &n);
        const struct rank_frame room = {.n_bytes = (uint32_t)n - (uint32_t)sizeof room};
        struct message *m = message_new(a, &room);
        MPI_Mrecv(&m->frame, n, MPI_BYTE, &handle, MPI_STATUS_IGNORE);
        m->frame.peer = (uint32_t)from.MPI_SOURCE;
        if (m->frame.kind == CLOSE_KIND) {
            a->closing = true;
            free(m);
        } else {
            append(&a->to_worker, m);
        }
    }
    return any;
}

/* The job has ended: so do the workers of the other ranks. This takes the way of the worker's orders
 * (base/ranks/rank_team.c: to the ranks whose number without its highest bit is this one), so that it does not overtake
 * the last of them. */
static void close_children(struct agent *a)
{
    int bit = 1;
    while (bit <= a->rank) bit <<= 1;
    for (; a->rank + bit < a->n_rank; bit <<= 1) {
        const struct rank_frame f = {.peer = (uint32_t)(a->rank + bit), .kind = CLOSE_KIND};
        struct message *m = message_new(a, &f);
        MPI_Isend(&m->frame, (int)m->n_bytes, MPI_BYTE, (int)f.peer, 0, MPI_COMM_WORLD, &m->request);
        append(&a->to_rank, m);
    }
}

static void look_at_worker(struct agent *a)
{
    int how;
    if (stop_wanted) {
        stop_wanted = 0;
        if (a->rank == 0 && !a->worker_ended) kill(a->worker, SIGTERM);
    }
    if (a->worker_ended || waitpid(a->worker, &how, WNOHANG) != a->worker) return;
    a->worker_ended = true;
    while (read_worker(a)) finish_sends(a); /* its last messages */
    a->code = WIFEXITED(how) ? WEXITSTATUS(how) : 128 + WTERMSIG(how);
    if (!WIFEXITED(how)) lost(a, strsignal(WTERMSIG(how)));
    if (a->rank != 0 && a->code != 0 && !a->closing) lost(a, "its worker has failed");
    close_children(a);
}

/* Sleeps longer the longer nothing has happened; a message of the worker ends the sleep. */
static void pause_a_while(const struct agent *a, size_t n_idle)
{
    const long us = n_idle < 10 ? 0 : n_idle < 400 ? 50 : n_idle < 4000 ? 250 : 1000;
    const bool listens = !a->worker_ended && a->to_rank.n_bytes < QUEUE_MOST_BYTES;
    struct pollfd p = {.fd = listens ? a->fd : -1, .events = POLLIN};
    const struct timespec wait = {0, us * 1000};
    ppoll(&p, 1, &wait, NULL);
}

static void carry_messages(struct agent *a)
{
    size_t n_idle = 0;
    MPI_Request end = MPI_REQUEST_NULL;
    for (int ended = 0; !ended;) {
        bool any = read_worker(a);
        any |= finish_sends(a);
        any |= receive(a);
        any |= !a->worker_ended && write_worker(a);
        look_at_worker(a);
        if (a->worker_ended && a->to_rank.first == NULL && end == MPI_REQUEST_NULL) MPI_Ibarrier(MPI_COMM_WORLD, &end);
        if (end != MPI_REQUEST_NULL) MPI_Test(&end, &ended, MPI_STATUS_IGNORE);
        n_idle = any ? 0 : n_idle + 1;
        if (!any) pause_a_while(a, n_idle);
    }
}

/* Returns whether the launcher has started several processes that MPI takes for single ones. */
static bool is_lonely(const struct agent *a)
{
    const char *n = getenv("SLURM_STEP_NUM_TASKS");
    return a->n_rank == 1 && n != NULL && strtol(n, NULL, 10) > 1;
}

/* mpirun passes SIGUSR1 on, which asks for an end; SIGTERM it sends to the ranks that are left when one is lost, and
 * that is no end of the job. srun passes SIGTERM on. */
static void set_signals(void)
{
    struct sigaction action = {.sa_handler = want_stop};
    sigemptyset(&action.sa_mask);
    sigaction(SIGUSR1, &action, NULL);
    signal(SIGPIPE, SIG_IGN); /* a connection of MPI to a rank that is lost */
    if (getenv("OMPI_COMM_WORLD_SIZE") != NULL && getenv("SLURM_STEP_NUM_TASKS") == NULL) return;
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
}

static int print_usage(int argc, char **argv)
{
    const bool version = argc == 2 && strcmp(argv[1], "--version") == 0;
    const bool help = argc == 2 && strcmp(argv[1], "--help") == 0;
    fputs(version ? "selvedge-mpi " SELVEDGE_VERSION "\n"
                  : "usage: selvedge-mpi PROGRAM [ARGUMENT...]\n"
                    "Run PROGRAM, which is selvedge-worker, as one rank of a job, and carry its messages to the other "
                    "ranks by MPI.\nselvedge-worker --ranks, mpirun or srun starts it.\n",
          version || help ? stdout : stderr);
    return version || help ? 0 : EXIT_USAGE;
}

int main(int argc, char **argv)
{
    struct agent a = {.fd = -1};
    if (argc < 2 || argv[1][0] == '-') return print_usage(argc, argv);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    set_signals();
    if (!start_worker(&a, argv + 1)) {
        perror("selvedge-mpi: cannot start the worker");
        return EXIT_USAGE;
    }
    if (MPI_Init(&argc, &argv) != MPI_SUCCESS) return EXIT_USAGE;
    MPI_Comm_rank(MPI_COMM_WORLD, &a.rank);
    MPI_Comm_size(MPI_COMM_WORLD, &a.n_rank);
    if (is_lonely(&a)) {
        fprintf(stderr, "selvedge-mpi: srun has started several ranks, but MPI knows of one: start them by srun "
                        "--mpi=pmix, or by mpirun\n");
        MPI_Abort(MPI_COMM_WORLD, EXIT_USAGE);
    }
    const int place[2] = {a.rank, a.n_rank};
    if (write(a.fd, place, sizeof place) != (ssize_t)sizeof place) lost(&a, "its worker has not started");
    carry_messages(&a);
    MPI_Finalize();
    return a.rank == 0 ? a.code : 0;
}
