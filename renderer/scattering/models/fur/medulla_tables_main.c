/* Makes the tables of light that is scattered in the medulla of a fiber (medulla.h): traces every node, compresses the
 * three tables and writes them as C source. A minute on two cores.
 *
 * medulla-tables FOLDER [SEED]
 *   FOLDER  where medulla_round_table.c and medulla_slab_table.c are written
 *   SEED    of the walks (1)
 * Prints the size, the time and, for each table, the error of the compression, which is noise of the walks for the most
 * part (tests/physics/fur/test_medulla.c separates the two).
 */
#include "base/clock.h"
#include "base/thread_pool.h"
#include "renderer/scattering/models/fur/medulla_fit.h"
#include "renderer/scattering/models/fur/medulla_trace.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROUND_WALKS = 40000, SLAB_WALKS = 20000, N_SWEEP = 400, N_TABLE = 1 + MEDULLA_N_HALF };
enum { N_MEDIUM = MEDULLA_N_DEPTH * MEDULLA_N_G };

struct raw {
    float round[MEDULLA_N_DEPTH][MEDULLA_N_G][MEDULLA_N_OFFSET][MEDULLA_N_TURN];
    float slab[MEDULLA_N_HALF][MEDULLA_N_DEPTH][MEDULLA_N_G][MEDULLA_N_SUM][MEDULLA_N_DIFFERENCE];
    uint64_t seed;
    status status[N_MEDIUM];
};

static void trace_medium(void *context, size_t i_task, size_t i_thread)
{
    struct raw *raw = context;
    int i = (int)i_task / MEDULLA_N_G, j = (int)i_task % MEDULLA_N_G;
    const struct medulla_medium m = {medulla_depth_of_node(i), medulla_g_of_node(j)};
    uint64_t seed = raw->seed * N_MEDIUM + i_task;
    float half[MEDULLA_N_HALF][MEDULLA_N_SUM][MEDULLA_N_DIFFERENCE];
    (void)i_thread;
    for (int k = 0; k < MEDULLA_N_OFFSET; k++)
        medulla_trace_round(&m, medulla_offset_of_node(k), ROUND_WALKS, seed * MEDULLA_N_OFFSET + (uint64_t)k,
                            raw->round[i][j][k]);
    raw->status[i_task] = medulla_trace_slab(&m, SLAB_WALKS, ~seed, half, NULL);
    for (int side = 0; side < MEDULLA_N_HALF; side++) memcpy(raw->slab[side][i][j], half[side], sizeof half[side]);
}

struct table {
    const char *name;
    const float *x;
    int n[MEDULLA_N_AXIS], rank;
    double *factor[MEDULLA_N_AXIS];
};

static const char *const round_axis[MEDULLA_N_AXIS] = {"depth", "g", "offset", "turn"};
static const char *const slab_axis[MEDULLA_N_AXIS] = {"depth", "g", "sum", "difference"};

static void stop(const char *what)
{
    fprintf(stderr, "medulla-tables: %s\n", what);
    exit(1);
}

static void compress(struct table *t, uint64_t seed)
{
    double left, start = clock_monotonic_s();
    for (int a = 0; a < MEDULLA_N_AXIS; a++) {
        t->factor[a] = malloc((size_t)t->n[a] * (size_t)t->rank * sizeof *t->factor[a]);
        if (t->factor[a] == NULL) stop("out of memory");
    }
    if (medulla_fit(t->x, t->n, t->rank, N_SWEEP, seed, t->factor, &left, NULL) != STATUS_OK) stop("out of memory");
    fprintf(stderr, "%s: %.4f of the root mean square left, %.1f s\n", t->name, left, clock_monotonic_s() - start);
}

/* Functions of the last axis are densities, of integral 1 over a turn. */
static void normalise_turn(struct table *t)
{
    const double step = 2 * M_PI / MEDULLA_N_TURN;
    for (int r = 0; r < t->rank; r++) {
        double sum = 0;
        for (int i = 0; i < MEDULLA_N_TURN; i++) sum += step * t->factor[3][i * t->rank + r];
        for (int i = 0; i < MEDULLA_N_TURN; i++) t->factor[3][i * t->rank + r] /= sum;
        for (int i = 0; i < MEDULLA_N_DEPTH; i++) t->factor[0][i * t->rank + r] *= sum;
    }
}

/* Lines of at most MOST_COLUMN; four digits, and 0 below 1e-6 of the largest entry. */
static size_t write_factor(FILE *f, const struct table *t, int axis, const char *const name[])
{
    enum { MOST_COLUMN = 118 };
    const int n = t->n[axis] * t->rank;
    double top = 0;
    int column = 0;
    for (int i = 0; i < n; i++) top = fmax(top, t->factor[axis][i]);
    fprintf(f, "const float %s_%s[%d][%d] = {\n", t->name, name[axis], t->n[axis], t->rank);
    for (int i = 0; i < n; i++) {
        char text[64], number[32] = "0";
        double value = t->factor[axis][i];
        if (value > 1e-6 * top) snprintf(number, sizeof number, "%#.4gF", value);
        snprintf(text, sizeof text, "%s%s%s,", i % t->rank == 0 ? "{" : "", number, (i + 1) % t->rank == 0 ? "}" : "");
        column += (int)strlen(text);
        if (column > MOST_COLUMN) {
            fprintf(f, "\n");
            column = (int)strlen(text);
        }
        fprintf(f, "%s", text);
    }
    fprintf(f, "\n};\n");
    return (size_t)n * sizeof(float);
}

static size_t write_tables(const char *folder, const char *file, const struct table *t, int n,
                           const char *const axis[MEDULLA_N_AXIS])
{
    char path[4096];
    size_t bytes = 0;
    snprintf(path, sizeof path, "%s/%s", folder, file);
    FILE *f = fopen(path, "w");
    if (f == NULL) stop("cannot write to the folder");
    fprintf(f, "/* Made by medulla-tables (`make medulla-tables`), not by hand; medulla.h defines it. */\n"
               "#include \"renderer/scattering/models/fur/medulla.h\"\n\n/* clang-format off */\n");
    for (int k = 0; k < n; k++)
        for (int a = 0; a < MEDULLA_N_AXIS; a++) bytes += write_factor(f, &t[k], a, axis);
    fprintf(f, "/* clang-format on */\n");
    if (fclose(f) != 0) stop("cannot write to the folder");
    return bytes;
}

int main(int argc, char **argv)
{
    struct raw *raw = calloc(1, sizeof *raw);
    struct thread_pool *pool = NULL;
    double start = clock_monotonic_s();
    if (argc < 2 || argc > 3) stop("usage: medulla-tables FOLDER [SEED]");
    if (raw == NULL || thread_pool_new(0, &pool, NULL) != STATUS_OK) stop("out of memory");
    raw->seed = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
    if (thread_pool_run(pool, N_MEDIUM, trace_medium, raw, NULL) != STATUS_OK) stop("the walks were not all made");
    thread_pool_free(pool);
    for (int i = 0; i < N_MEDIUM; i++)
        if (raw->status[i] != STATUS_OK) stop("out of memory");
    fprintf(stderr, "traced in %.1f s\n", clock_monotonic_s() - start);
    struct table table[N_TABLE] = {{"medulla_round",
                                    raw->round[0][0][0],
                                    {MEDULLA_N_DEPTH, MEDULLA_N_G, MEDULLA_N_OFFSET, MEDULLA_N_TURN},
                                    MEDULLA_ROUND_RANK,
                                    {NULL}}};
    static const char *const slab_name[MEDULLA_N_HALF] = {"medulla_back", "medulla_through"};
    for (int side = 0; side < MEDULLA_N_HALF; side++)
        table[1 + side] = (struct table){slab_name[side],
                                         raw->slab[side][0][0][0],
                                         {MEDULLA_N_DEPTH, MEDULLA_N_G, MEDULLA_N_SUM, MEDULLA_N_DIFFERENCE},
                                         MEDULLA_SLAB_RANK,
                                         {NULL}};
    for (int k = 0; k < N_TABLE; k++) compress(&table[k], raw->seed);
    normalise_turn(&table[0]);
    size_t bytes = write_tables(argv[1], "medulla_round_table.c", table, 1, round_axis) +
                   write_tables(argv[1], "medulla_slab_table.c", table + 1, MEDULLA_N_HALF, slab_axis);
    fprintf(stderr, "%zu bytes in %.1f s\n", bytes, clock_monotonic_s() - start);
    for (int k = 0; k < N_TABLE; k++)
        for (int a = 0; a < MEDULLA_N_AXIS; a++) free(table[k].factor[a]);
    free(raw);
    return 0;
}
