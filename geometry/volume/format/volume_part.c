#include "geometry/volume/format/volume_part.h"
#include "base/option_id.h"

status volume_part_choose(const char *name, const struct volume_parts *parts, const struct volume_part *part,
                          size_t index[2], struct file_ledger *ledger, struct error *err)
{
    static const char *const one[2] = {"channel", "time"}, *const many[2] = {"channels", "times"},
                             *const option[2] = {OPTION_SCAN_CHANNEL, OPTION_SCAN_TIME};
    for (int p = 0; p < 2; p++) {
        const size_t n = parts->n[p] > 1 ? parts->n[p] : 1;
        const size_t chosen = part == NULL ? 0 : p == VOLUME_CHANNELS ? part->channel : part->time;
        if (chosen > n)
            return error_set_field(err, STATUS_INVALID, option[p],
                                   "cannot read volume '%s': %s %zu is not there, the file has %zu", name, one[p],
                                   chosen, n);
        if (n > 1 && chosen == 0)
            return error_set_field(
                err, STATUS_INVALID, option[p],
                "cannot read volume '%s': %s says that it has %zu %s: choose one with '%s', 1 to %zu", name,
                parts->source, n, many[p], one[p], n);
        index[p] = chosen > 0 ? chosen - 1 : 0;
        if (n > 1) file_ledger_add(ledger, many[p], NULL, "%zu, number %zu is read", n, chosen);
    }
    return STATUS_OK;
}
