/* The published two-lobe model once more, in double precision and by quadrature, straight from fabric thesis 5.4: what
 * the renderer's tables and closed forms must agree with. Parameters: nine numbers, internal units.
 */
#ifndef SELVEDGE_TESTS_REFERENCE_TWO_LOBE_H
#define SELVEDGE_TESTS_REFERENCE_TWO_LOBE_H

/* S in channel c for directions in the fiber frame. */
double reference_s(const double param[9], const double wi[3], const double wo[3], int c);
/* The normalised lobe gbar(th_o; m, s), its normaliser by Simpson's rule. */
double reference_gbar(double theta_o, double m, double s);
double reference_normaliser(double m, double s);
double reference_von_mises(double phi, double s);
/* Camera-side integral of S cos th_i over all wi, for th_o. */
double reference_camera_furnace(const double param[9], double theta_o, int c);

#endif
