/* How long messages between two ranks take: started by mpirun -n 2 selvedge-mpi rank_messages. Rank 0 sends orders
 * of several sizes, which rank 1 confirms, and prints the median and the least time from an order to its
 * confirmation, and the processor time that both take rank 0: {"bytes": 0, "median_s": ..., "least_s": ..., "cpu_s":
 * ...}, a line each. */
#include "base/clock.h"
#include "base/ranks/rank_team.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ORDER_ECHO = RANK_ORDER_END + 1, N_REPEAT = 101 };

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static status measure(struct rank_team *team, size_t n_bytes, const void *data, struct error *err)
{
    double took_s[N_REPEAT];
    status s = STATUS_OK;
    double cpu_s = clock_process_s();
    for (int i = 0; i < N_REPEAT && s == STATUS_OK; i++) {
        double begin_s = clock_monotonic_s();
        s = rank_team_order(team, ORDER_ECHO, data, n_bytes, err);
        if (s == STATUS_OK) s = rank_team_gather(team, err);
        took_s[i] = clock_monotonic_s() - begin_s;
    }
    cpu_s = (clock_process_s() - cpu_s) / N_REPEAT;
    qsort(took_s, N_REPEAT, sizeof *took_s, compare);
    printf("{\"bytes\": %zu, \"median_s\": %.3g, \"least_s\": %.3g, \"cpu_s\": %.3g}\n", n_bytes, took_s[N_REPEAT / 2],
           took_s[0], cpu_s);
    return s;
}

static status confirm_all(struct rank_team *team, struct error *err)
{
    struct rank_order order;
    for (;;) {
        status s = rank_team_wait(team, &order, err);
        rank_order_release(&order);
        if (s != STATUS_OK || order.kind == RANK_ORDER_END) return s;
        rank_team_confirm(team);
    }
}

int main(int argc, char **argv)
{
    static const size_t size[] = {0, 4096, 65536, 1 << 20, 8 << 20};
    int fd;
    size_t rank, n_rank;
    struct rank_team *team = NULL;
    struct error err = {0};
    void *data = calloc(size[4], 1);
    if (data == NULL || argc < 3 || sscanf(argv[2], "%d,%zu,%zu", &fd, &rank, &n_rank) != 3) {
        fprintf(stderr, "usage: mpirun -n 2 selvedge-mpi %s\n", argv[0]);
        return 2;
    }
    status s = rank_team_open(fd, rank, n_rank, &team, &err);
    for (size_t i = 0; rank == 0 && s == STATUS_OK && i < sizeof size / sizeof *size; i++)
        s = measure(team, size[i], data, &err);
    if (rank > 0 && s == STATUS_OK) s = confirm_all(team, &err);
    if (s != STATUS_OK) fprintf(stderr, "rank %zu: %s\n", rank, err.text);
    rank_team_close(team);
    free(data);
    return s != STATUS_OK;
}
