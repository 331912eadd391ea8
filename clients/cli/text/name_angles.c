#include "clients/cli/text/name_angles.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

const char *const name_angle_key[NAME_N_ANGLE] = {"light_theta_deg", "light_phi_deg", "camera_theta_deg",
                                                  "camera_phi_deg", "cloth_rotation_deg"};
static const char *const place[NAME_N_ANGLE] = {"{light_theta}", "{light_phi}", "{camera_theta}", "{camera_phi}",
                                                "{rotation}"};
/* The rotation first, so that it is not left to a '*'. */
static const char *const usual[] = {
    "lt{light_theta}_lp{light_phi}_ct{camera_theta}_cp{camera_phi}_r{rotation}",
    "lt{light_theta}_lp{light_phi}_ct{camera_theta}_cp{camera_phi}",
    "light{light_theta}_{light_phi}_camera{camera_theta}_{camera_phi}_rotation{rotation}",
    "light{light_theta}_{light_phi}_camera{camera_theta}_{camera_phi}",
    "l{light_theta}_{light_phi}_c{camera_theta}_{camera_phi}_r{rotation}",
    "l{light_theta}_{light_phi}_c{camera_theta}_{camera_phi}",
    "t{light_theta}_p{light_phi}_r{rotation}",
    "t{light_theta}_p{light_phi}",
    "theta{light_theta}_phi{light_phi}",
    "{light_theta}_{light_phi}_{camera_theta}_{camera_phi}_{rotation}",
    "{light_theta}_{light_phi}_{camera_theta}_{camera_phi}",
    "*_lt{light_theta}_lp{light_phi}_ct{camera_theta}_cp{camera_phi}*",
    "*_l{light_theta}_{light_phi}_c{camera_theta}_{camera_phi}*",
    "*_t{light_theta}_p{light_phi}_r{rotation}",
    "*_t{light_theta}_p{light_phi}",
    "t{light_theta}_p{light_phi}_*",
};

/* Index of the place that the pattern begins with; -1: none. */
static int place_at(const char *pattern)
{
    for (int i = 0; i < NAME_N_ANGLE; i++)
        if (strncmp(pattern, place[i], strlen(place[i])) == 0) return i;
    return -1;
}

/* The bytes of a number: a sign, digits, and digits after a point. */
static size_t number_bytes(const char *text)
{
    size_t n = text[0] == '-' || text[0] == '+' ? 1 : 0;
    const size_t n_digit = strspn(text + n, "0123456789");
    if (n_digit == 0) return 0;
    n += n_digit;
    if (text[n] == '.' && isdigit((unsigned char)text[n + 1])) n += 1 + strspn(text + n + 1, "0123456789");
    return n;
}

static bool is_same(char pattern, char c)
{
    if (pattern == '_') return c == '_' || c == '-' || c == '.' || c == ' ';
    return tolower((unsigned char)pattern) == tolower((unsigned char)c);
}

static bool match(const char *pattern, const char *name, struct name_angles *angles)
{
    for (; *pattern != '\0'; name++, pattern++) {
        if (*pattern == '*') {
            for (;; name++) {
                if (match(pattern + 1, name, angles)) return true;
                if (*name == '\0') return false;
            }
        }
        const int i = place_at(pattern);
        if (i >= 0) {
            char number[32];
            const size_t n = number_bytes(name);
            if (n == 0 || n >= sizeof number) return false;
            memcpy(number, name, n);
            number[n] = '\0';
            angles->deg[i] = strtod(number, NULL);
            angles->given[i] = true;
            name += n - 1;
            pattern += strlen(place[i]) - 1;
        } else if (*name == '\0' || !is_same(*pattern, *name)) {
            return false;
        }
    }
    return *name == '\0';
}

bool name_angles_read(const char *pattern, const char *name, struct name_angles *angles)
{
    *angles = (struct name_angles){0};
    return match(pattern, name, angles);
}

status name_angles_check(const char *pattern, struct error *err)
{
    bool seen[NAME_N_ANGLE] = {false};
    size_t n = 0;
    for (const char *p = strchr(pattern, '{'); p != NULL; p = strchr(p + 1, '{')) {
        const int i = place_at(p);
        if (i < 0)
            return error_set(err, STATUS_INVALID,
                             "the pattern '%s' has an unknown place at '%s': known are {light_theta}, {light_phi}, "
                             "{camera_theta}, {camera_phi}, {rotation}",
                             pattern, p);
        if (seen[i]) return error_set(err, STATUS_INVALID, "the pattern '%s' has %s twice", pattern, place[i]);
        seen[i] = true;
        n++;
    }
    if (n > 0) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "the pattern '%s' has no place of an angle, such as {light_theta}", pattern);
}

const char *name_angles_guess(const char *const *name, size_t n)
{
    for (size_t i = 0; i < sizeof usual / sizeof *usual; i++) {
        struct name_angles a;
        size_t k = 0;
        while (k < n && name_angles_read(usual[i], name[k], &a)) k++;
        if (n > 0 && k == n) return usual[i];
    }
    return NULL;
}
