/* Columns of a cylinder after they were measured: their standard errors, and the curvature of the light over a column.
 *
 * Errors. The parts along a column (photograph.h) should have the same light, up to a gradient by the nearby lamp,
 * which leaves the mean as it is. What departs from a straight line along the axis is texture and noise. Its variance,
 * relative to the column's light, is pooled over the three neighbours on each side, because eight parts alone tell a
 * standard error to 30 % and weights would follow chance. Texture may be as long as a part: the parts' covariance is
 * taken as v (1 for a part, r for neighbours), and r, between -0.4 and 0.5, follows from the residuals e of all
 * columns of the photograph in all channels by
 *
 *   E sum e_b^2 = v tr(M + r M T),   E sum e_b e_(b+1) = v/2 tr(M T + r M T M T),
 *
 * with M the matrix that leaves the residuals about a line and T the one of neighbours (method of moments). The mean of
 * n parts has the variance v (1 + 2 r (n - 1) / n) / n; columns of three parts or fewer keep their plain scatter.
 *
 * Differences between columns are no measure of errors: a highlight of a few columns looks like noise. Errors that show
 * between columns alone, as of threads along the axis that alias with the pixels, are the fit's to find: it takes what
 * residuals leave beyond the stated errors as misfit, in the weights of rows and in the errors of parameters
 * (linear_model.h).
 *
 * The outline's error turns all columns of a photograph by column.angle_se_deg: the column's radiance changes by this
 * angle times the slope between its neighbours.
 *
 * Curvature. A column of the step h, whose weights fall to both sides, sees the light m at its angle plus
 * h^2/48 m" + h^4/5760 m"": a highlight of 4 degrees looks 4.5 % wider in columns of 6. With the second and fourth
 * differences d2, d4 of the columns, d2/48 is subtracted and d4/501 added, the inverse up to the sixth derivative. The
 * highlight is then right within 0.1 % in width and 1.3 % in height; noise of a column becomes 5 % larger. */
#ifndef SELVEDGE_OPTIMIZER_COLUMN_ERRORS_H
#define SELVEDGE_OPTIMIZER_COLUMN_ERRORS_H

#include "optimizer/photographs/rows/observation.h"

/* States se_rgb of all columns from the observation `first` on, then removes the curvature from mean_rgb. Columns that
 * do not lie between two others at equal steps (at the ends, or beside one that was left out) keep their curvature, and
 * d4 is left out where the next two are not there. */
void column_errors_state(struct observation_set *o, size_t first);

#endif
