#include "optimizer/fit/photographs/observation_load.h"
#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/fit/photographs/measurement_table.h"
#include "optimizer/fit/photographs/photograph.h"
#include "optimizer/fit/photographs/photograph_contrast.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_TABLE_BYTES = 16 << 20 };

static status load_table(const struct job_document *doc, const char *folder, struct observation_set *o,
                         struct error *err)
{
    char path[4096];
    char *text = NULL;
    size_t n = 0;
    snprintf(path, sizeof path, "%s/%s", folder, doc->measurement_file);
    status s = file_read_all(path, MAX_TABLE_BYTES, &text, &n, err);
    if (s != STATUS_OK) {
        if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_MEASUREMENT_FILE);
        return s;
    }
    s = measurement_table_parse(text, n, doc->measurement_file, doc, o, err);
    free(text);
    return s;
}

static status load_photograph(const struct job_document *doc, size_t i, const char *folder,
                              const struct warning_sink *warn, struct observation_set *o, struct error *err)
{
    const struct job_photograph *p = &doc->photograph[i];
    struct photograph_mean mean;
    struct observation item = {.set = p->set, .weight = p->weight};
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, p->file);
    status s = photograph_measure(path, p, &mean, err);
    if (s != STATUS_OK) {
        if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_PHOTOGRAPH_FILE "[%zu]", i);
        return s;
    }
    if (mean.warning[0] != '\0') warning_send(warn, OPTION_NONE, "%s", mean.warning);
    snprintf(item.name, sizeof item.name, "%s", p->file);
    if (doc->texture_block_mm > 0.0) {
        item.n_cell = job_texture_cells(doc);
        s = photograph_contrast(path, p, item.n_cell, item.contrast_rgb, item.contrast_se_rgb, err);
        if (s != STATUS_OK) {
            if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_TEXTURE_BLOCK);
            return s;
        }
        if (!observation_contrast_known(&item) && doc->texture_weight > 0.0)
            warning_send(warn, OPTION_NONE,
                         "photograph '%s' is black in one of its channels, so its texture is not compared with the "
                         "rendering's",
                         p->file);
    }
    memcpy(item.mean_rgb, mean.mean_rgb, sizeof item.mean_rgb);
    memcpy(item.se_rgb, mean.se_rgb, sizeof item.se_rgb);
    item.configuration = observation_configuration(doc, p->light_theta_deg, p->light_phi_deg, p->camera_theta_deg,
                                                   p->camera_phi_deg, p->cloth_rotation_deg);
    return observation_set_append(o, &item, err);
}

status observation_set_load(const struct job_document *doc, const char *folder, const struct warning_sink *warn,
                            struct observation_set *o, struct error *err)
{
    if (doc->measurement_file[0] != '\0') return load_table(doc, folder, o, err);
    for (size_t i = 0; i < doc->n_photograph; i++) {
        status s = load_photograph(doc, i, folder, warn, o, err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}
