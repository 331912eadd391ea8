#include "geometry/fibers/fiber_terms.h"
#include "base/option_id.h"

status fiber_terms_no_radius(const char *name, struct error *err)
{
    return error_set_field(err, STATUS_INVALID, OPTION_FIBER_RADIUS,
                           "cannot use fibers '%s': the file states no radius, as hair of Mitsuba does: give it here",
                           name);
}

status fiber_terms_two_radii(const char *name, struct error *err)
{
    return error_set_field(err, STATUS_INVALID, OPTION_FIBER_RADIUS,
                           "cannot use fibers '%s': the file states the radius of its fibers: leave it out here", name);
}
