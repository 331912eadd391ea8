/* Makes the tables of azimuthal scattering by waves (wave_table.h): solves for every size over wavelength, polarisation
 * and absorption, and writes them as C source. 40 s of a core for each section.
 *
 * wave-tables FOLDER [SECTION]
 * wave-tables FOLDER NAME OUTLINE.csv RADIUS_UM INDEX
 *   FOLDER     where wave_SECTION_table.c, or wave_NAME_table.c, is written
 *   SECTION    one of the names of wave_sections.c; all without it
 *   OUTLINE    a closed polygon, such as one traced in a micrograph: a line "x,y" for each corner, in any unit. Corners
 *              become as round as a series of OUTLINE_WAVES waves makes them
 *   RADIUS_UM  of a circle of the section's area
 *   INDEX      of refraction
 * Prints for each section the time, the size and three errors, each the root mean square over azimuths of a difference,
 * over the root mean square of N, for a blur of 5 degrees: from N of one half of the sizes (speckle), from the exact N
 * between the values of C, and of the light that a fiber meets from its width, a difference that the tables neglect.
 */
#include "base/clock.h"
#include "base/thread_pool.h"
#include "renderer/scattering/models/wave/solver/wave_mean.h"
#include "renderer/scattering/models/wave/wave_table.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N_SIZE = 9, N_CLEAR = WAVE_TABLE_N_CLEAR, CHECK = N_CLEAR, N_COLUMN, N_WAVE = WAVE_TABLE_N_WAVE };
enum { CHECK_STEP = 4 }; /* so many sizes apart, values of C are checked */
enum { OUTLINE_WAVES = 32 };
enum { N_TASK = N_SIZE * N_COLUMN * WAVE_N_FIELD, MOST_COLUMN = 118 };

#define CHECK_CLEAR 0.5 /* between the values of C of the table */
#define REACH 2.2       /* sizes: standard deviations beyond the outer channels */
#define PER_WAVE 3      /* nodes: errors below 1e-3 of the forward amplitude */
#define BLUR (5 * M_PI / 180)

struct job {
    const struct wave_section *section;
    struct wave_outline outline; /* of radius 1 */
    double wave[N_TASK][N_WAVE + 1], met[N_TASK];
    status status[N_TASK];
    struct error error[N_TASK];
};

static void stop(const char *what)
{
    fprintf(stderr, "wave-tables: %s\n", what);
    exit(1);
}

/* Center of a channel: logarithm of the circumference of the circle over the wavelength. */
static double center(const struct wave_section *s, int channel)
{
    return log(2 * M_PI * s->radius_m / wave_length_m[channel]);
}

static double log_size(const struct wave_section *s, int i)
{
    const double low = center(s, 0) - REACH * WAVE_TABLE_SPREAD, high = center(s, 2) + REACH * WAVE_TABLE_SPREAD;
    return low + (high - low) * i / (N_SIZE - 1);
}

static double clear_of(int column) { return column == CHECK ? CHECK_CLEAR : pow(wave_table_root(column), 3); }

static void solve(void *context, size_t i_task, size_t i_thread)
{
    struct job *job = context;
    const int i = (int)i_task / WAVE_N_FIELD;
    (void)i_thread;
    if (i % N_COLUMN == CHECK && i / N_COLUMN % CHECK_STEP != 0) return;
    const double x = exp(log_size(job->section, i / N_COLUMN)), index = job->section->index;
    /* a diameter lets through the share exp(-4 x Im(index)) */
    const struct wave_problem p = {&job->outline, x, index - I * log(clear_of(i % N_COLUMN)) / (4 * x),
                                   (enum wave_field)(i_task % WAVE_N_FIELD),
                                   wave_solver_nodes(&job->outline, x, index, PER_WAVE)};
    struct wave_mean mean;
    job->status[i_task] = wave_mean_over_turns(&p, &mean, &job->error[i_task]);
    if (job->status[i_task] != STATUS_OK) return;
    job->met[i_task] = mean.met;
    for (int k = 0; k <= N_WAVE; k++) {
        double sum = 0;
        for (int j = 0; j < WAVE_MEAN_N_ANGLE; j++)
            sum +=
                mean.density[j] * cos(2 * M_PI * ((double)k * j / WAVE_MEAN_N_ANGLE)) * (2 * M_PI / WAVE_MEAN_N_ANGLE);
        job->wave[i_task][k] = k % 2 == 0 ? sum : -sum; /* straight on is half a turn from back */
    }
}

/* Mean over the polarisations and over every `step`-th size from `first`. */
static void average(const struct job *job, int channel, int column, const int sizes[2], double wave[N_WAVE + 1])
{
    double weights = 0;
    memset(wave, 0, (N_WAVE + 1) * sizeof *wave);
    for (int i = sizes[0]; i < N_SIZE; i += sizes[1]) {
        const double off = (log_size(job->section, i) - center(job->section, channel)) / WAVE_TABLE_SPREAD;
        const double weight = exp(-0.5 * off * off) / WAVE_N_FIELD;
        weights += weight * WAVE_N_FIELD;
        for (int field = 0; field < WAVE_N_FIELD; field++)
            for (int k = 0; k <= N_WAVE; k++)
                wave[k] += weight * job->wave[(i * N_COLUMN + column) * WAVE_N_FIELD + field][k];
    }
    for (int k = 0; k <= N_WAVE; k++) wave[k] /= weights;
}

/* Mean square over a turn of a blurred function with these coefficients. */
static double mean_square(const double wave[N_WAVE + 1])
{
    double sum = wave[0] * wave[0];
    for (int k = 1; k <= N_WAVE; k++) sum += 2 * pow(wave[k] * exp(-0.5 * pow(k * BLUR, 2)), 2);
    return sum;
}

static const int all_sizes[2] = {0, 1}, checked_sizes[2] = {0, CHECK_STEP};

/* Half of the difference of both halves of the sizes. */
static double speckle(const struct job *job)
{
    double difference = 0, size = 0;
    for (int c = 0; c < 3; c++)
        for (int column = 0; column < N_CLEAR; column++) {
            double half[2][N_WAVE + 1];
            for (int h = 0; h < 2; h++) average(job, c, column, (const int[2]){h, 2}, half[h]);
            for (int k = 0; k <= N_WAVE; k++) {
                const double mean = 0.5 * (half[0][k] + half[1][k]);
                half[0][k] = 0.5 * (half[0][k] - half[1][k]);
                half[1][k] = mean;
            }
            difference += mean_square(half[0]) / mean_square(half[1]);
            size += 1;
        }
    return sqrt(difference / size);
}

static double between_clears(const struct job *job)
{
    double weight[N_CLEAR], slope[N_CLEAR], sum = 0;
    wave_table_weights(cbrt(CHECK_CLEAR), weight, slope);
    for (int c = 0; c < 3; c++) {
        double want[N_WAVE + 1], off[N_WAVE + 1], wave[N_WAVE + 1];
        average(job, c, CHECK, checked_sizes, want);
        memcpy(off, want, sizeof off);
        for (int i = 0; i < N_CLEAR; i++) {
            average(job, c, i, checked_sizes, wave);
            for (int k = 0; k <= N_WAVE; k++) off[k] -= weight[i] * wave[k];
        }
        sum += mean_square(off) / mean_square(want) / 3;
    }
    return sqrt(sum);
}

/* One channel and value of C, in lines of at most MOST_COLUMN. */
static void write_waves(FILE *f, const double wave[N_WAVE + 1])
{
    int column = 0;
    fprintf(f, "{\n");
    for (int k = 0; k <= N_WAVE; k++) {
        char number[32];
        snprintf(number, sizeof number, "%.5fF,", wave[k]);
        column += (int)strlen(number);
        if (column > MOST_COLUMN) {
            fprintf(f, "\n");
            column = (int)strlen(number);
        }
        fprintf(f, "%s", number);
    }
    fprintf(f, "\n},");
}

static void write_table(const struct job *job, const char *folder)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/wave_%s_table.c", folder, job->section->name);
    FILE *f = fopen(path, "w");
    if (f == NULL) stop("cannot write to the folder");
    fprintf(f,
            "/* Made by wave-tables (`make wave-tables`), not by hand; wave_table.h defines it. */\n"
            "#include \"renderer/scattering/models/wave/wave_table.h\"\n\n/* clang-format off */\n"
            "const struct wave_table wave_%s_table = {%g, {\n",
            job->section->name, job->section->index);
    for (int c = 0; c < 3; c++) {
        fprintf(f, "{");
        for (int i = 0; i < N_CLEAR; i++) {
            double wave[N_WAVE + 1];
            average(job, c, i, all_sizes, wave);
            if (i == N_CLEAR - 1) wave[0] = 1; /* nothing is absorbed */
            write_waves(f, wave);
        }
        fprintf(f, "},\n");
    }
    fprintf(f, "}};\n/* clang-format on */\n");
    if (fclose(f) != 0) stop("cannot write to the folder");
}

static void make(struct thread_pool *pool, const struct wave_section *section, const struct wave_outline *outline,
                 const char *folder)
{
    struct job *job = calloc(1, sizeof *job);
    struct error err = {0};
    const double start = clock_monotonic_s();
    double least = INFINITY, most = 0;
    if (job == NULL) stop("out of memory");
    job->section = section;
    job->outline = *outline;
    wave_outline_scale(&job->outline, 1 / sqrt(wave_outline_area(&job->outline) / M_PI));
    if (wave_outline_check(&job->outline, &err) != STATUS_OK) stop(err.text);
    if (thread_pool_run(pool, N_TASK, solve, job, NULL) != STATUS_OK) stop("not all was solved");
    for (int i = 0; i < N_TASK; i++) {
        if (job->status[i] != STATUS_OK) stop(job->error[i].text);
        if (!(job->met[i] > 0)) continue; /* not checked */
        least = fmin(least, job->met[i]);
        most = fmax(most, job->met[i]);
    }
    write_table(job, folder);
    printf("%s: x = %.1f to %.1f, %zu bytes, %.1f s; speckle %.4f, between values of C %.4f, light met %.3f to %.3f\n",
           section->name, exp(log_size(section, 0)), exp(log_size(section, N_SIZE - 1)), sizeof(struct wave_table),
           clock_monotonic_s() - start, speckle(job), between_clears(job), least, most);
    free(job);
}

static void make_known(struct thread_pool *pool, const char *folder, const char *name)
{
    bool found = false;
    for (int i = 0; i < WAVE_N_SECTION; i++) {
        struct wave_outline outline;
        if (name != NULL && strcmp(name, wave_sections[i].name) != 0) continue;
        wave_sections[i].outline(&outline);
        make(pool, &wave_sections[i], &outline, folder);
        found = true;
    }
    if (!found) stop("there is no such section");
}

static double number(const char *text, double lower, double upper, const char *otherwise)
{
    char *end;
    const double value = strtod(text, &end);
    if (end == text || *end != '\0' || !(value >= lower && value <= upper)) stop(otherwise);
    return value;
}

static void make_outlined(struct thread_pool *pool, char **argument)
{
    struct wave_outline outline;
    struct error err = {0};
    const char *name = argument[1];
    if (name[strspn(name, "abcdefghijklmnopqrstuvwxyz0123456789_")] != '\0' || name[0] == '\0' || strlen(name) > 40)
        stop("NAME has at most 40 small letters, digits and _");
    const struct wave_section section = {name,
                                         1e-6 * number(argument[3], 0.5, 20, "RADIUS_UM is a number from 0.5 to 20"),
                                         number(argument[4], 1.1, 3, "INDEX is a number from 1.1 to 3"), NULL};
    if (wave_outline_load(&outline, argument[2], OUTLINE_WAVES, &err) != STATUS_OK) stop(err.text);
    make(pool, &section, &outline, argument[0]);
}

int main(int argc, char **argv)
{
    struct thread_pool *pool = NULL;
    if (argc != 2 && argc != 3 && argc != 6)
        stop("usage: wave-tables FOLDER [SECTION], or wave-tables FOLDER NAME OUTLINE.csv RADIUS_UM INDEX");
    if (thread_pool_new(0, &pool, NULL) != STATUS_OK) stop("out of memory");
    if (argc == 6)
        make_outlined(pool, argv + 1);
    else
        make_known(pool, argv[1], argc > 2 ? argv[2] : NULL);
    thread_pool_free(pool);
    return 0;
}
