/* Makes the tables of azimuthal scattering by waves (wave_table.h): solves for every size over wavelength, angle to the
 * axis and absorption, and writes them as C source. Two minutes of a core for each section.
 *
 * wave-tables FOLDER [SECTION]
 * wave-tables FOLDER NAME OUTLINE.csv RADIUS_UM INDEX
 *   FOLDER     where wave_SECTION_table.c, or wave_NAME_table.c, is written
 *   SECTION    one of the names of wave_sections.c; all without it
 *   OUTLINE    a closed polygon, such as one traced in a micrograph: a line "x,y" for each corner, in any unit. Corners
 *              become as round as a series of OUTLINE_WAVES waves makes them
 *   RADIUS_UM  of a circle of the section's area
 *   INDEX      of refraction
 * Prints for each section the time, the size and four errors, each the root mean square over azimuths of a difference,
 * over the root mean square of N, for a blur of 5 degrees: from N of one half of the sizes (speckle), from the exact N
 * between the values of C, from the exact N between the values of theta, and of the light that a fiber meets from its
 * width, a difference that the tables neglect.
 */
#include "base/clock.h"
#include "base/thread_pool.h"
#include "renderer/scattering/models/wave/solver/wave_mean.h"
#include "renderer/scattering/models/wave/wave_table.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N_TILT = WAVE_TABLE_N_TILT, N_CLEAR = WAVE_TABLE_N_CLEAR, N_WAVE = WAVE_TABLE_N_WAVE };
/* The points of the table, and those between them that check it. */
enum {
    N_TABLE = N_TILT * N_CLEAR,
    N_CHECK_CLEAR = 2,
    N_CHECK_TILT = 4,
    N_POINT = N_TABLE + N_CHECK_CLEAR + N_CHECK_TILT
};
enum { N_SIZE = 17, N_TASK = N_SIZE * N_POINT, MOST_COLUMN = 120, OUTLINE_WAVES = 32 };

#define CHECK_CLEAR 0.5 /* between the values of C of the table */
#define REACH 2.2       /* sizes: standard deviations beyond the outer channels */
/* Nodes: energy within 4e-3 for light across the fiber. Oblique waves inside are longer, but as many nodes by their
 * length would leave 10 % at 85 degrees in trilobal fibers; these leave 1e-3. */
#define PER_WAVE 3
#define BLUR (5 * M_PI / 180)

struct job {
    const struct wave_section *section;
    struct wave_outline outline; /* of radius 1 */
    double wave[N_SIZE][N_POINT][N_WAVE + 1], met[N_SIZE][N_POINT];
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

/* cos(theta) and C. */
struct point {
    double cosine, clear;
};

static int point_of(int i_tilt, int i_clear) { return i_tilt * N_CLEAR + i_clear; }

/* Values of theta at which C is checked, and between which two of the table theta is. */
static const int checked_tilt[N_CHECK_CLEAR] = {N_TILT - 1, N_TILT / 2}, checked_gap[N_CHECK_TILT] = {0, 2, 4, 7};

static int checked_clear(int i) { return i % 2 == 0 ? N_CLEAR - 1 : N_CLEAR / 2; }

static struct point point_at(int i)
{
    if (i < N_TABLE) return (struct point){wave_table_cosine(i / N_CLEAR), pow(wave_table_root(i % N_CLEAR), 3)};
    if (i < N_TABLE + N_CHECK_CLEAR) return (struct point){wave_table_cosine(checked_tilt[i - N_TABLE]), CHECK_CLEAR};
    const int k = i - N_TABLE - N_CHECK_CLEAR;
    return (struct point){0.5 * (wave_table_cosine(checked_gap[k]) + wave_table_cosine(checked_gap[k] + 1)),
                          pow(wave_table_root(checked_clear(k)), 3)};
}

static void solve(void *context, size_t i_task, size_t i_thread)
{
    struct job *job = context;
    const size_t i_size = i_task % N_SIZE, i_point = i_task / N_SIZE;
    const struct point at = point_at((int)i_point);
    const double x = exp(log_size(job->section, (int)i_size)), index = job->section->index;
    (void)i_thread;
    /* a diameter lets through the share exp(-4 x Im(index)) */
    const struct oblique_problem p = {&job->outline, x, index - I * log(at.clear) / (4 * x), acos(at.cosine),
                                      wave_solver_nodes(&job->outline, x, index, PER_WAVE)};
    struct wave_mean mean;
    job->status[i_task] = wave_mean_over_turns(&p, &mean, &job->error[i_task]);
    if (job->status[i_task] != STATUS_OK) return;
    job->met[i_size][i_point] = mean.met;
    for (int k = 0; k <= N_WAVE; k++) {
        double sum = 0;
        for (int j = 0; j < WAVE_MEAN_N_ANGLE; j++)
            sum +=
                mean.density[j] * cos(2 * M_PI * ((double)k * j / WAVE_MEAN_N_ANGLE)) * (2 * M_PI / WAVE_MEAN_N_ANGLE);
        job->wave[i_size][i_point][k] = k % 2 == 0 ? sum : -sum; /* straight on is half a turn from back */
    }
}

/* Mean over every `step`-th size from `first`. */
static void average(const struct job *job, int channel, int point, const int sizes[2], double wave[N_WAVE + 1])
{
    double weights = 0;
    memset(wave, 0, (N_WAVE + 1) * sizeof *wave);
    for (int i = sizes[0]; i < N_SIZE; i += sizes[1]) {
        const double off = (log_size(job->section, i) - center(job->section, channel)) / WAVE_TABLE_SPREAD;
        const double weight = exp(-0.5 * off * off);
        weights += weight;
        for (int k = 0; k <= N_WAVE; k++) wave[k] += weight * job->wave[i][point][k];
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

static const int all_sizes[2] = {0, 1};

/* Half of the difference of both halves of the sizes. */
static double speckle(const struct job *job)
{
    double difference = 0;
    for (int c = 0; c < 3; c++)
        for (int point = 0; point < N_TABLE; point++) {
            double half[2][N_WAVE + 1];
            for (int h = 0; h < 2; h++) average(job, c, point, (const int[2]){h, 2}, half[h]);
            for (int k = 0; k <= N_WAVE; k++) {
                const double mean = 0.5 * (half[0][k] + half[1][k]);
                half[0][k] = 0.5 * (half[0][k] - half[1][k]);
                half[1][k] = mean;
            }
            difference += mean_square(half[0]) / mean_square(half[1]);
        }
    return sqrt(difference / (3 * N_TABLE));
}

/* Mean over the channels of the squared difference of a point from its value by n points of the table. */
static double interpolation_error(const struct job *job, int point, const int *node, const double *weight, int n)
{
    double sum = 0;
    for (int c = 0; c < 3; c++) {
        double want[N_WAVE + 1], off[N_WAVE + 1], wave[N_WAVE + 1];
        average(job, c, point, all_sizes, want);
        memcpy(off, want, sizeof off);
        for (int i = 0; i < n; i++) {
            average(job, c, node[i], all_sizes, wave);
            for (int k = 0; k <= N_WAVE; k++) off[k] -= weight[i] * wave[k];
        }
        sum += mean_square(off) / mean_square(want) / 3;
    }
    return sum;
}

static double between_clears(const struct job *job)
{
    double weight[N_CLEAR], slope[N_CLEAR], sum = 0;
    wave_table_weights(cbrt(CHECK_CLEAR), weight, slope);
    for (int k = 0; k < N_CHECK_CLEAR; k++) {
        int node[N_CLEAR];
        for (int i = 0; i < N_CLEAR; i++) node[i] = point_of(checked_tilt[k], i);
        const double off = interpolation_error(job, N_TABLE + k, node, weight, N_CLEAR);
        printf("  cos(theta) %.3f, C %.2f: %.4f from the table\n", wave_table_cosine(checked_tilt[k]), CHECK_CLEAR,
               sqrt(off));
        sum += off / N_CHECK_CLEAR;
    }
    return sqrt(sum);
}

static double between_tilts(const struct job *job)
{
    double sum = 0;
    for (int k = 0; k < N_CHECK_TILT; k++) {
        const int point = N_TABLE + N_CHECK_CLEAR + k;
        double weight[N_TILT];
        int node[N_TILT];
        wave_table_tilt_weights(point_at(point).cosine, weight);
        for (int i = 0; i < N_TILT; i++) node[i] = point_of(i, checked_clear(k));
        const double off = interpolation_error(job, point, node, weight, N_TILT);
        printf("  cos(theta) %.3f, C %.2f: %.4f from the table\n", point_at(point).cosine, point_at(point).clear,
               sqrt(off));
        sum += off / N_CHECK_TILT;
    }
    return sqrt(sum);
}

/* A file that breaks lines before they exceed MOST_COLUMN. */
struct lines {
    FILE *file;
    int column;
};

static void write_text(struct lines *l, const char *text)
{
    if (l->column + (int)strlen(text) > MOST_COLUMN) {
        fprintf(l->file, "\n");
        l->column = 0;
    }
    l->column += fprintf(l->file, "%s", text);
}

/* One angle, channel and value of C. */
static void write_waves(struct lines *l, const double wave[N_WAVE + 1])
{
    write_text(l, "{");
    for (int k = 0; k <= N_WAVE; k++) {
        char number[32];
        snprintf(number, sizeof number, k < N_WAVE ? "%ld," : "%ld", lround(WAVE_TABLE_ONE * wave[k]));
        write_text(l, number);
    }
    write_text(l, "},");
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
            "const struct wave_table wave_%s_table = {{\n",
            job->section->name);
    struct lines l = {f, 0};
    for (int t = 0; t < N_TILT; t++)
        for (int c = 0; c < 3; c++) {
            write_text(&l, c == 0 ? "{{" : "{");
            for (int i = 0; i < N_CLEAR; i++) {
                double wave[N_WAVE + 1];
                average(job, c, point_of(t, i), all_sizes, wave);
                if (i == N_CLEAR - 1) wave[0] = 1; /* nothing is absorbed */
                write_waves(&l, wave);
            }
            write_text(&l, c == 2 ? "}}," : "},");
        }
    fprintf(f, "\n}};\n/* clang-format on */\n");
    if (fclose(f) != 0) stop("cannot write to the folder");
}

/* Turns an outline that is symmetric about the y axis, where t = pi / 2 is, so that it is so about the x axis: then the
 * solver uses the mirror. */
static void lay_mirror(struct wave_outline *o)
{
    double imaginary = 0, real = 0;
    struct wave_outline turned = *o;
    wave_outline_turn_quarter(&turned);
    for (int k = 0; k <= o->n_wave; k++) {
        imaginary += fabs(cimag(turned.forward[k])) + fabs(cimag(turned.backward[k]));
        real += fabs(creal(turned.forward[k])) + fabs(creal(turned.backward[k]));
    }
    if (imaginary < 1e-12 * real) *o = turned;
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
    lay_mirror(&job->outline);
    if (wave_outline_check(&job->outline, &err) != STATUS_OK) stop(err.text);
    if (thread_pool_run(pool, N_TASK, solve, job, NULL) != STATUS_OK) stop("not all was solved");
    for (int i = 0; i < N_TASK; i++) {
        const double met = job->met[i % N_SIZE][i / N_SIZE];
        if (job->status[i] != STATUS_OK) stop(job->error[i].text);
        least = fmin(least, met);
        most = fmax(most, met);
    }
    write_table(job, folder);
    printf("%s: x = %.1f to %.1f, %zu bytes, %.1f s; speckle %.4f, light met %.3f to %.3f; between values of C %.4f, ",
           section->name, exp(log_size(section, 0)), exp(log_size(section, N_SIZE - 1)), sizeof(struct wave_table),
           clock_monotonic_s() - start, speckle(job), least, most, between_clears(job));
    printf("of theta %.4f\n", between_tilts(job));
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
