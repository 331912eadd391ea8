/* The parts of the light of a fiber with a medulla, and a share with its derivatives (fur_means.h). */
#ifndef SELVEDGE_RENDERER_FUR_MEAN_H
#define SELVEDGE_RENDERER_FUR_MEAN_H

/* R, TT, TRT with all longer paths, light scattered in the medulla that leaves back and that goes through, and both. */
enum fur_part_of_light { FUR_PART_BACK = 3, FUR_PART_THROUGH, FUR_PART_SCATTERED, FUR_N_PART_OF_LIGHT };
enum fur_mean_by { FUR_M_ETA, FUR_M_KAPPA, FUR_M_LAYERS, FUR_M_MS, FUR_M_G, FUR_N_MEAN_BY };
enum { FUR_N_ROW = 64 };

struct fur_mean {
    double v, d[FUR_N_MEAN_BY];
};

#endif
