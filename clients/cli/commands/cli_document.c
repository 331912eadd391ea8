#include "clients/cli/commands/cli_document.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

/* Endings of file names, the kind of file, and the command that takes it. */
static const struct {
    const char *endings, *kind, *use;
} kind[] = {
    {" tif tiff nrrd nhdr mhd mha nii gz h5 hdf5 dcm npy vol raw vgi ", "a scan",
     "`selvedge reconstruct FILE` traces its fibers; a job document names it in 'volume.files'"},
    {" dng cr2 cr3 nef arw orf rw2 raf jpg jpeg png exr ", "a photograph",
     "`selvedge photo FILE` shows what becomes of it; a job document names it in 'photographs'"},
    {" csv tsv txt binary bsdf brdf ", "a table", "a job document names it in 'measurements.file'"},
    {" hair obj bcc cyhair ", "fibers", "a job document names it in 'fibers.file'"},
    {" wif ", "a draft", "a job document names it in 'cloth.draft_file'"},
};

/* Index in `kind` by the ending of the name; -1: it tells nothing. */
static int kind_of(const char *path)
{
    char ending[16];
    const char *dot = strrchr(path, '.');
    if (dot == NULL || strlen(dot) > 10) return -1;
    snprintf(ending, sizeof ending, " %s ", dot + 1);
    for (size_t i = 0; ending[i] != '\0'; i++) ending[i] = (char)tolower((unsigned char)ending[i]);
    for (size_t i = 0; i < sizeof kind / sizeof *kind; i++)
        if (strstr(kind[i].endings, ending) != NULL) return (int)i;
    return -1;
}

/* The first byte that is no space nor part of a byte order mark; EOF: there is none. */
static int first_byte(FILE *f)
{
    int c = getc(f);
    while (c != EOF && (isspace(c) || c == 0xEF || c == 0xBB || c == 0xBF)) c = getc(f);
    return c;
}

status cli_document_check(const char *path, struct error *err)
{
    struct stat st;
    if (stat(path, &st) != 0) return error_set_errno(err, "cannot read the job document '%s'", path);
    if (S_ISDIR(st.st_mode))
        return error_set(err, STATUS_INVALID,
                         "'%s' is a folder: give the job document in it, or use `selvedge batch submit` or "
                         "`selvedge watch-folder`",
                         path);
    FILE *f = fopen(path, "rb");
    if (f == NULL) return error_set_errno(err, "cannot read the job document '%s'", path);
    const int c = first_byte(f), i = kind_of(path);
    fclose(f);
    if (c == EOF) return error_set(err, STATUS_INVALID, "the job document '%s' is empty", path);
    if (c == '{') return STATUS_OK;
    if (i < 0)
        return error_set(err, STATUS_INVALID,
                         "'%s' is no job document, which is a JSON object: it does not begin with {", path);
    return error_set(err, STATUS_INVALID, "'%s' is no job document; by its name it is %s: %s", path, kind[i].kind,
                     kind[i].use);
}
