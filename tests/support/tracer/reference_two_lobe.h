/* A second implementation of the published two-lobe model, in double precision and by quadrature, directly from section
 * 5.4 of the fabric thesis. The renderer's tables and closed forms must agree with it. Parameters: nine numbers in
 * internal units.
 */
#ifndef SELVEDGE_TESTS_REFERENCE_TWO_LOBE_H
#define SELVEDGE_TESTS_REFERENCE_TWO_LOBE_H

/* The scattering function S in channel c for directions in the fiber frame. */
double reference_s(const double param[9], const double wi[3], const double wo[3], int c);
/* The normalised lobe gbar(th_o; m, s), and its normaliser, computed by Simpson's rule. */
double reference_gbar(double theta_o, double m, double s);
double reference_normaliser(double m, double s);
double reference_von_mises(double phi, double s);
/* Integral of S cos th_i over all wi for the camera direction th_o. */
double reference_camera_furnace(const double param[9], double theta_o, int c);

#endif
