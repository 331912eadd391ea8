/* The letterhead of reports: laboratory, logo and size of paper of the settings, which a worker finds in the folder of
 * its job (letterhead.json, optimizer/job/job_folder.h). */
#ifndef SELVEDGE_SERVER_LETTERHEAD_H
#define SELVEDGE_SERVER_LETTERHEAD_H

#include "server/settings/settings.h"

/* Returns the content of letterhead.json, freed by the caller: {"laboratory", "logo": URI "data:image/...", "paper"}.
 * STATUS_INVALID with the setting in err->field for a name that is not UTF-8, and for a logo that is neither PNG nor
 * SVG; STATUS_NOT_FOUND, STATUS_IO and STATUS_TOO_LARGE where the file of the logo cannot be read. */
status letterhead_read(const struct settings *s, char **text, struct error *err);

#endif
