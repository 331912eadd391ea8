/* Fur models fitted to the profiles of the ten published fibers, which rays through each fiber make (fiber_rays.h).
 * Prints one JSON object on each line.
 *
 *   models.fur.profile_fit_s
 *       Longest time of a fit of fur.v1 to one of the profiles, of 945 radiances with the noise of RAYS rays.
 *   models.fur.profile.<fiber>.nrmse, models.fur_near.profile.<fiber>.nrmse
 *       Residual over the range of the radiances, of a fiber with scales tilted one way, as a real one.
 *   models.fur.profile.<fiber>.nrmse_either_way
 *       The same where half of the rays meet the fiber turned round, as the model has it.
 *   models.fur.profile.<fiber>.published_nrmse
 *       What the published fit left of the measured fiber (Yan et al. 2017, table 4).
 *   models.mie.published_error
 *       Largest difference of an efficiency of the exact cylinder (mie_cylinder.h) from its published value.
 *
 * bench_profiles [RAYS] [FIBERS]
 *   RAYS    of a profile (900000)
 *   FIBERS  the first so many (10)
 */
#include "base/angle.h"
#include "optimizer/fit/profile/profile_fit.h"
#include "tests/support/fiber/fiber_rays.h"
#include "tests/support/wave/mie_cylinder.h"

#include <math.h>
#include <stdlib.h>

static const double published_nrmse[PUBLISHED_N_FIBER] = {.068, .064, .071, .073, .047, .060, .097, .062, .081, .161};

static void print(const char *model, int fiber, const char *what, double value)
{
    const char *name = published_fiber_name[fiber];
    printf("{\"name\":\"models.%s.profile.", model);
    for (; *name != '\0'; name++) putchar(*name == ' ' ? '_' : *name);
    printf(".%s\",\"value\":%.4g,\"unit\":\"1\",\"better\":\"lower\"}\n", what, value);
    fflush(stdout);
}

/* Fits a model; returns the time. */
static double fit(const char *id, const struct fiber_profile *profile, struct thread_pool *pool, double *nrmse)
{
    const struct scattering_model *m = scattering_find(id);
    struct fit_parameter parameter[SCATTERING_MAX_PARAM];
    struct fit_option option;
    struct profile_fit f;
    struct error err = {0};
    fit_option_init(&option);
    for (size_t p = 0; p < m->n_param; p++)
        parameter[p] = (struct fit_parameter){m->param[p].lower, m->param[p].upper, m->param[p].start, false};
    const struct profile_problem problem = {
        .model = m, .profile = profile, .parameter = parameter, .option = &option, .scale = 1, .pool = pool};
    if (profile_fit_run(&problem, "of rays", &f, &err) != STATUS_OK) {
        fprintf(stderr, "%s\n", err.text);
        exit(1);
    }
    *nrmse = f.nrmse;
    profile_fit_release(&f);
    return f.wall_s;
}

int main(int argc, char **argv)
{
    const uint32_t n_ray = argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 10) : 900000;
    const int n_fiber = argc > 2 ? (int)strtol(argv[2], NULL, 10) : PUBLISHED_N_FIBER;
    const double theta_i = -40 * RAD_PER_DEG;
    struct thread_pool *pool = NULL;
    double longest_s = 0, nrmse;
    if (n_ray == 0 || n_fiber < 1 || n_fiber > PUBLISHED_N_FIBER || thread_pool_new(0, &pool, NULL) != STATUS_OK) {
        fprintf(stderr, "usage: bench_profiles [RAYS] [FIBERS], at most %d fibers\n", PUBLISHED_N_FIBER);
        return 2;
    }
    printf("{\"name\":\"models.mie.published_error\",\"value\":%.3g,\"unit\":\"1\",\"better\":\"lower\"}\n",
           mie_published_error());
    for (int k = 0; k < n_fiber; k++) {
        struct ray_fiber f = published_fiber(k);
        struct fiber_profile profile;
        fiber_rays_profile(&f, theta_i, n_ray, (uint64_t)k + 1, &profile);
        longest_s = fmax(longest_s, fit("fur.v1", &profile, pool, &nrmse));
        print("fur", k, "nrmse", nrmse);
        fit("fur_near.v1", &profile, pool, &nrmse);
        print("fur_near", k, "nrmse", nrmse);
        fiber_profile_release(&profile);
        f.either_way = true;
        fiber_rays_profile(&f, theta_i, n_ray, (uint64_t)k + 1, &profile);
        fit("fur.v1", &profile, pool, &nrmse);
        print("fur", k, "nrmse_either_way", nrmse);
        print("fur", k, "published_nrmse", published_nrmse[k]);
        fiber_profile_release(&profile);
    }
    printf("{\"name\":\"models.fur.profile_fit_s\",\"value\":%.4g,\"unit\":\"s\",\"better\":\"lower\"}\n", longest_s);
    thread_pool_free(pool);
    return 0;
}
