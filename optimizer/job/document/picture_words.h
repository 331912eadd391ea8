/* Words of the job document that files of pictures and measured rows carry, too. */
#ifndef SELVEDGE_OPTIMIZER_PICTURE_WORDS_H
#define SELVEDGE_OPTIMIZER_PICTURE_WORDS_H

enum job_set { JOB_SET_FIT, JOB_SET_HELD_OUT };
/* How integer samples of a picture stand for light. */
enum job_transfer { JOB_TRANSFER_UNDECLARED, JOB_TRANSFER_LINEAR, JOB_TRANSFER_SRGB };
/* Symmetry of a measured BRDF: as its file says, or as the job says. */
enum job_symmetry { JOB_SYMMETRY_FILE, JOB_SYMMETRY_ISOTROPIC, JOB_SYMMETRY_ANISOTROPIC };

#endif
