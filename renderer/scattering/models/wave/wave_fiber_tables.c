#include "renderer/scattering/models/wave/wave_fiber.h"

#include <stdlib.h>
#include <string.h>

enum { N_WAVE = WAVE_TABLE_N_WAVE };
enum quantity { VALUE, BY_C_T, BY_GAMMA, N_QUANTITY };
#define LEAST_FACTOR 5.5 /* waves with k gamma above this have a factor below exp(-5.5^2 / 2) = 3e-7 */
#define LEAST_N 1e-7     /* where the series of a dark fiber leaves less: this, without slope */

struct work {
    double cosine[N_WAVE + 1][WAVE_N_PHI + 1];
    double column[N_QUANTITY][WAVE_N_PHI + 1];
};

/* Weights of the table at a row and a C_T: of theta; of C, and their derivatives by C_T. */
struct place {
    double tilt[WAVE_TABLE_N_TILT], clear[2][WAVE_TABLE_N_CLEAR];
};

static void find_place(struct place *at, double cosine, double c_t)
{
    const double root = fmax(cbrt(c_t), wave_table_root(0)), by_c_t = root / (3 * c_t);
    wave_table_tilt_weights(cosine, at->tilt);
    wave_table_weights(root, at->clear[0], at->clear[1]);
    for (int i = 0; i < WAVE_TABLE_N_CLEAR; i++) at->clear[1][i] *= by_c_t;
}

/* Fourier coefficient k of a channel, and its derivatives. */
static void wave_of(const struct wave_table *table, int channel, int k, const struct place *at, double gamma,
                    double out[N_QUANTITY])
{
    const double blur = exp(-0.5 * pow(k * gamma, 2)) * (k == 0 ? 0.5 / M_PI : 1 / M_PI) / WAVE_TABLE_ONE;
    double sum[2] = {0, 0};
    for (int t = 0; t < WAVE_TABLE_N_TILT; t++)
        for (int i = 0; i < WAVE_TABLE_N_CLEAR; i++)
            for (int q = 0; q < 2; q++) sum[q] += at->tilt[t] * at->clear[q][i] * (double)table->wave[t][channel][i][k];
    out[VALUE] = blur * sum[0];
    out[BY_C_T] = blur * sum[1];
    out[BY_GAMMA] = -(double)k * k * gamma * out[VALUE];
}

static void fill_channel(struct scattering_state *s, struct work *w, const struct wave_table *table, int row,
                         int channel, const double *param)
{
    struct place at;
    find_place(&at, (double)row / WAVE_N_ROW, param[WAVE_P_C_T + channel]);
    memset(w->column, 0, sizeof w->column);
    for (int k = 0; k <= N_WAVE && k * param[WAVE_P_GAMMA] < LEAST_FACTOR; k++) {
        double wave[N_QUANTITY];
        wave_of(table, channel, k, &at, param[WAVE_P_GAMMA], wave);
        for (int q = 0; q < N_QUANTITY; q++)
            for (int j = 0; j <= WAVE_N_PHI; j++) w->column[q][j] += wave[q] * w->cosine[k][j];
        if (k == 0) s->row[row].energy[channel][channel] = (float)(2 * M_PI * wave[VALUE]);
    }
    for (int j = 0; j <= WAVE_N_PHI; j++) {
        struct wave_cell *cell = &s->cell[row][j];
        const bool faded = w->column[VALUE][j] < LEAST_N;
        if (faded) w->column[VALUE][j] = LEAST_N;
        cell->n[channel] = (float)w->column[VALUE][j];
        cell->d[WAVE_D_C_T][channel] = faded ? 0 : (float)w->column[BY_C_T][j];
        cell->d[WAVE_D_GAMMA][channel] = faded ? 0 : (float)w->column[BY_GAMMA][j];
    }
    azimuth_density(w->column[VALUE], WAVE_N_PHI, s->row[row].density[channel], s->row[row].below[channel]);
}

status wave_fiber_tables(struct scattering_state *s, const struct wave_table *table, const double *param,
                         struct error *err)
{
    struct work *w = malloc(sizeof *w);
    if (w == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot prepare scattering model: out of memory");
    for (int k = 0; k <= N_WAVE; k++)
        for (int j = 0; j <= WAVE_N_PHI; j++) w->cosine[k][j] = cos(k * j * M_PI / WAVE_N_PHI);
    for (int row = 0; row <= WAVE_N_ROW; row++)
        for (int channel = 0; channel < 3; channel++) fill_channel(s, w, table, row, channel, param);
    free(w);
    return STATUS_OK;
}
