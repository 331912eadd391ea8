#include "clients/cli/text/cli_text.h"
#include "base/utf8.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

void text_size(double n_bytes, char out[CLI_SHORT_TEXT])
{
    static const char *const unit[] = {"B", "kB", "MB", "GB", "TB", "PB"};
    if (!(n_bytes >= 0.0)) {
        snprintf(out, CLI_SHORT_TEXT, "?");
        return;
    }
    size_t i = 0;
    while (n_bytes >= 999.5 && i + 1 < sizeof unit / sizeof unit[0]) n_bytes /= 1000.0, i++;
    int digits = i == 0 || n_bytes >= 99.95 ? 0 : n_bytes >= 9.995 ? 1 : 2;
    snprintf(out, CLI_SHORT_TEXT, "%.*f %s", digits, n_bytes, unit[i]);
}

void text_duration(double s, char out[CLI_SHORT_TEXT])
{
    if (!(s >= 0.0) || s > 1e9) {
        snprintf(out, CLI_SHORT_TEXT, "-");
        return;
    }
    long t = lround(s);
    if (t >= 3600)
        snprintf(out, CLI_SHORT_TEXT, "%ld:%02ld:%02ld", t / 3600, t / 60 % 60, t % 60);
    else
        snprintf(out, CLI_SHORT_TEXT, "%ld:%02ld", t / 60, t % 60);
}

void text_bar(double fraction, size_t width, char *out, size_t n_out)
{
    if (n_out == 0) return;
    if (width < 3) width = 3;
    if (width > n_out - 1) width = n_out - 1;
    if (width < 3) {
        out[0] = '\0';
        return;
    }
    if (!(fraction > 0.0)) fraction = 0.0;
    if (fraction > 1.0) fraction = 1.0;
    size_t inner = width - 2, filled = (size_t)(fraction * (double)inner + 1e-9);
    out[0] = '[';
    memset(out + 1, '#', filled);
    memset(out + 1 + filled, '-', inner - filled);
    out[width - 1] = ']';
    out[width] = '\0';
}

void text_with_error(double value, double standard_error, char out[CLI_SHORT_TEXT])
{
    if (isnan(value)) {
        snprintf(out, CLI_SHORT_TEXT, "-");
    } else if (!(standard_error > 0.0) || isinf(standard_error)) {
        snprintf(out, CLI_SHORT_TEXT, "%.4g", value);
    } else {
        int digits = 1 - (int)floor(log10(standard_error));
        if (digits < 0) digits = 0;
        if (digits > 8)
            snprintf(out, CLI_SHORT_TEXT, "%.5g +- %.2g", value, standard_error);
        else
            snprintf(out, CLI_SHORT_TEXT, "%.*f +- %.*f", digits, value, digits, standard_error);
    }
}

/* Returns the length of the UTF-8 sequence at p, or 0 if it is invalid or a control character (C0, DEL, C1). */
static size_t printable_bytes(const char *p)
{
    const unsigned char a = (unsigned char)p[0], b = (unsigned char)(a != 0 ? p[1] : 0);
    bool control = a < 0x20 || a == 0x7f || (a == 0xc2 && b < 0xa0);
    return control ? 0 : utf8_sequence_bytes(p);
}

void text_clean(const char *in, char *out, size_t n_out)
{
    size_t at = 0;
    const char *p = in;
    while (*p != '\0' && n_out > 0) {
        size_t n = printable_bytes(p);
        if (at + (n == 0 ? 1 : n) >= n_out) break;
        if (n == 0) {
            out[at++] = '?';
            p++;
        } else {
            memcpy(out + at, p, n);
            at += n;
            p += n;
        }
    }
    if (n_out > 0) out[at] = '\0';
}

static void fit_part(const struct job_view *v, char *out, size_t n_out)
{
    char objective[CLI_SHORT_TEXT];
    out[0] = '\0';
    if (isnan(v->objective)) return;
    text_with_error(v->objective, v->objective_se, objective);
    if (v->step >= 0)
        snprintf(out, n_out, "  step %ld  squared errors %s", v->step, objective);
    else
        snprintf(out, n_out, "  squared errors %s", objective);
}

static void stage_part(const struct job_view *v, char *out, size_t n_out)
{
    const char *stage = v->stage[0] == '\0' ? v->state : v->stage;
    if (v->i_stage >= 0 && v->n_stage > 0 && v->stage[0] != '\0')
        snprintf(out, n_out, "%s (%ld/%ld)", stage, v->i_stage + 1, v->n_stage);
    else
        snprintf(out, n_out, "%s", stage);
}

/* "2:05", or "1:00 to 4:00" where the remaining time is not known well. */
static void eta_part(const struct job_view *v, char *out, size_t n_out)
{
    char low[CLI_SHORT_TEXT], high[CLI_SHORT_TEXT];
    bool range = v->eta_low_s >= 0.0 && v->eta_high_s >= 0.0;
    text_duration(range ? v->eta_low_s : v->eta_s, low);
    text_duration(v->eta_high_s, high);
    snprintf(out, n_out, "%s%s%s", low, range ? " to " : "", range ? high : "");
}

void text_progress(const struct job_view *v, size_t n_column, char *out, size_t n_out)
{
    char stage[96], fit[160], eta[2 * CLI_SHORT_TEXT + 8], bar[48];
    stage_part(v, stage, sizeof stage);
    fit_part(v, fit, sizeof fit);
    eta_part(v, eta, sizeof eta);
    double fraction = isnan(v->fraction) ? 0.0 : v->fraction;
    text_bar(fraction, n_column >= 100 ? 32 : 20, bar, sizeof bar);
    int n = snprintf(out, n_out, "%s %3.0f %%  %-18s ETA %s%s", bar, 100.0 * fraction, stage, eta, fit);
    if (n > 0 && (size_t)n < n_out && n_column > 0 && (size_t)n > n_column) out[n_column] = '\0';
}

void text_progress_plain(const struct job_view *v, char *out, size_t n_out)
{
    char stage[96], fit[160], eta[2 * CLI_SHORT_TEXT + 8];
    stage_part(v, stage, sizeof stage);
    fit_part(v, fit, sizeof fit);
    eta_part(v, eta, sizeof eta);
    snprintf(out, n_out, "%3.0f %%  %s  ETA %s%s", isnan(v->fraction) ? 0.0 : 100.0 * v->fraction, stage, eta, fit);
}
