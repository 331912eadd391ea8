/* Responses, sets of pixels and peaks in pictures of slices, against plain loops over the whole picture. */
#include "base/lanes.h"
#include "geometry/fibers/slices/blob_response.h"
#include "geometry/fibers/slices/pixel_bits.h"
#include "geometry/fibers/slices/slice_peaks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 37, HEIGHT = 29, N = WIDTH * HEIGHT, N_BYTE = (WIDTH + 7) / 8 };
static const float UNTOUCHED = -7.0f;

static uint32_t next(uint32_t *state) { return *state = *state * 1664525u + 1013904223u; }
static float number(uint32_t *state) { return (float)(next(state) >> 8) / 16777216.0f; }

static size_t mirror(long i, size_t n)
{
    while (i < 0 || i >= (long)n) i = i < 0 ? -i - 1 : 2 * (long)n - 1 - i;
    return (size_t)i;
}

/* -sigma^2 times the Laplacian by the two-dimensional kernel, in double precision. */
static double dense_response(const struct blob_kernel *k, const float *image, size_t width, size_t height, size_t u,
                             size_t v)
{
    double sum = 0.0;
    for (int y = -k->reach; y <= k->reach; y++)
        for (int x = -k->reach; x <= k->reach; x++) {
            const double weight = (double)k->smooth[abs(y)] * (double)k->second[abs(x)] +
                                  (double)k->second[abs(y)] * (double)k->smooth[abs(x)];
            sum += weight * (double)image[mirror((long)v + y, height) * width + mirror((long)u + x, width)];
        }
    return (double)k->factor * sum;
}

static void check_responses(size_t width, size_t height, double sigma)
{
    struct blob_kernel k;
    const size_t n = width * height, n_block = blob_n_block(width);
    uint32_t state = 5;
    assert_true(blob_kernel_init(&k, sigma));
    float *image = malloc(n * sizeof *image), *response = malloc(n * sizeof *response),
          *scratch = malloc(blob_scratch(width, k.reach) * sizeof *scratch);
    uint8_t *asked = malloc(n_block * height), *work = malloc(n_block * height);
    for (size_t i = 0; i < n; i++) image[i] = number(&state);
    for (size_t i = 0; i < n; i++) response[i] = UNTOUCHED;
    for (size_t i = 0; i < n_block * height; i++) asked[i] = next(&state) >> 24 < 40 || i == 0;
    const struct blob_picture p = {image, width, height, asked};
    blob_response(&k, &p, scratch, work, response);
    for (size_t v = 0; v < height; v++)
        for (size_t u = 0; u < width; u++) {
            const float r = response[v * width + u];
            if (asked[v * n_block + u / BLOB_BLOCK] == 0)
                assert_true(r == UNTOUCHED);
            else /* float sums of densities up to 1 and weights whose moduli add up to 4 at most */
                assert_true(fabs((double)r - dense_response(&k, image, width, height, u, v)) < 1e-5);
        }
    free(image);
    free(response);
    free(scratch);
    free(asked);
    free(work);
}

static void test_responses(void **state)
{
    (void)state;
    check_responses(WIDTH, HEIGHT, 0.6);
    check_responses(WIDTH, HEIGHT, 2.3);
    check_responses(40, 24, 1.0);
    check_responses(5, 3, 4.0); /* the picture is smaller than the kernel */
    check_responses(1, 1, 1.0);
    struct blob_kernel k;
    assert_false(blob_kernel_init(&k, 0.0));
    assert_false(blob_kernel_init(&k, 17.0));
}

/* Kernels answer alike at all scales: a parabola x^2 + y^2 has the Laplacian 4. */
static void test_moments(void **state)
{
    (void)state;
    for (double sigma = 0.6; sigma < 5.0; sigma *= 1.7) {
        struct blob_kernel k;
        assert_true(blob_kernel_init(&k, sigma));
        double sum = (double)k.smooth[0], zero = (double)k.second[0], moment = 0.0;
        for (int i = 1; i <= k.reach; i++) {
            sum += 2.0 * (double)k.smooth[i];
            zero += 2.0 * (double)k.second[i];
            moment += 2.0 * (double)k.second[i] * i * i;
        }
        assert_true(fabs(sum - 1.0) < 1e-6 && fabs(zero) < 1e-6 && fabs(moment - 2.0) < 1e-5);
    }
}

static bool has(const uint8_t *bits, size_t pitch, long u, long v)
{
    return u >= 0 && v >= 0 && u < WIDTH && v < HEIGHT && (bits[(size_t)v * pitch + (size_t)u / 8] >> u % 8 & 1) != 0;
}

static void draw_bits(uint8_t *bits, size_t pitch, uint32_t *state)
{
    memset(bits, 0, pitch * HEIGHT);
    for (int i = 0; i < 12; i++) {
        const size_t u = next(state) % WIDTH, v = (next(state) >> 8) % HEIGHT;
        bits[v * pitch + u / 8] |= (uint8_t)(1u << u % 8);
    }
}

static void test_near_pixels(void **unused)
{
    (void)unused;
    enum { PITCH = N_BYTE + 3 };
    uint8_t bits[PITCH * HEIGHT], work[N_BYTE * HEIGHT], near[N_BYTE * HEIGHT];
    uint32_t state = 3;
    for (unsigned reach = 0; reach <= 8; reach++) {
        draw_bits(bits, PITCH, &state);
        pixel_bits_near(bits, PITCH, N_BYTE, HEIGHT, reach, work, near);
        for (long v = 0; v < HEIGHT; v++)
            for (long u = 0; u < WIDTH; u++) {
                bool any = false;
                for (long y = v - (long)reach; y <= v + (long)reach; y++)
                    for (long x = u - (long)reach; x <= u + (long)reach; x++) any = any || has(bits, PITCH, x, y);
                assert_int_equal(has(near, N_BYTE, u, v), any);
            }
    }
}

struct found {
    bool at[N];
    size_t n, last;
};

static bool find(void *context, size_t u, size_t v)
{
    struct found *f = context;
    assert_true(f->n == 0 || v * WIDTH + u > f->last);
    f->at[f->last = v * WIDTH + u] = true;
    f->n++;
    return f->n < N;
}

/* Higher than all neighbours, or the first of equals. */
static bool is_peak(const float *r, long u, long v)
{
    for (long y = v - 1; y <= v + 1; y++)
        for (long x = u - 1; x <= u + 1; x++) {
            if (x < 0 || y < 0 || x >= WIDTH || y >= HEIGHT || (x == u && y == v)) continue;
            const float here = r[v * WIDTH + u], there = r[y * WIDTH + x];
            if (there > here || (there == here && (y < v || (y == v && x < u)))) return false;
        }
    return true;
}

static void test_peaks(void **unused)
{
    (void)unused;
    float response[N + LANES];
    uint8_t some[N_BYTE * HEIGHT], candidate[N_BYTE * HEIGHT], work[N_BYTE * HEIGHT];
    uint32_t state = 11;
    size_t n = 0;
    for (int round = 0; round < 50; round++) {
        struct found f = {0};
        draw_bits(some, N_BYTE, &state);
        pixel_bits_near(some, N_BYTE, N_BYTE, HEIGHT, 2, work, candidate);
        for (size_t i = 0; i < N; i++) response[i] = (float)(next(&state) >> 28) / 16.0f; /* with many equals */
        const struct peak_search s = {response, WIDTH, HEIGHT, candidate, 0.5f};
        assert_true(peaks_visit(&s, find, &f));
        for (long v = 0; v < HEIGHT; v++)
            for (long u = 0; u < WIDTH; u++)
                assert_int_equal(f.at[v * WIDTH + u], has(candidate, N_BYTE, u, v) && response[v * WIDTH + u] >= 0.5f &&
                                                          is_peak(response, u, v));
        n += f.n;
    }
    assert_true(n > 100);
}

int main(void)
{
    const struct CMUnitTest test[] = {cmocka_unit_test(test_responses), cmocka_unit_test(test_moments),
                                      cmocka_unit_test(test_near_pixels), cmocka_unit_test(test_peaks)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
