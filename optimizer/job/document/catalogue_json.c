#include "optimizer/job/document/catalogue_json.h"
#include "base/catalogue/method_catalogue.h"
#include "base/catalogue/model_catalogue.h"
#include "base/catalogue/stop_reason.h"

static json_t *parameter_json(const struct param_info *p)
{
    json_t *channel = p->channel < 0 ? json_null() : json_integer(p->channel);
    return json_pack("{s:s, s:s, s:s, s:s, s:o, s:f, s:f, s:f, s:s, s:s}", "name", p->name, "symbol", p->symbol, "kind",
                     param_kind_name(p->kind), "unit", param_unit_name(p->unit), "channel", channel, "lower",
                     param_to_file_unit(p, p->lower), "upper", param_to_file_unit(p, p->upper), "start",
                     param_to_file_unit(p, p->start), "coordinate", param_coordinate_name(p->coordinate), "meaning",
                     p->meaning);
}

static json_t *models_json(void)
{
    json_t *list = json_array();
    const struct model_info *m;
    for (size_t i = 0; (m = model_catalogue_at(i)) != NULL; i++) {
        json_t *parameters = json_array();
        for (size_t p = 0; p < m->n_param; p++) json_array_append_new(parameters, parameter_json(&m->param[p]));
        json_array_append_new(list,
                              json_pack("{s:s, s:s, s:s, s:o}", "id", m->id, "title", m->title, "kind",
                                        m->kind == MODEL_SURFACE ? "surface" : "volume", "parameters", parameters));
    }
    return list;
}

static json_t *methods_json(void)
{
    static const struct {
        enum method_ability ability;
        const char *name;
    } table[METHOD_N_ABILITY] = {{METHOD_TAKES_PRIORS, "priors"},   {METHOD_TAKES_NUISANCE, "nuisance"},
                                 {METHOD_TAKES_TEXTURE, "texture"}, {METHOD_TAKES_PRECISION, "precision"},
                                 {METHOD_TAKES_STARTS, "starts"},   {METHOD_TAKES_TIES, "ties"},
                                 {METHOD_TAKES_DENSITY, "density"}};
    json_t *list = json_array();
    const struct method_info *m;
    for (size_t i = 0; (m = method_catalogue_at(i)) != NULL; i++) {
        json_t *takes = json_array();
        for (size_t k = 0; k < METHOD_N_ABILITY; k++)
            if ((m->takes & table[k].ability) != 0) json_array_append_new(takes, json_string(table[k].name));
        json_t *budget = m->default_path_budget > 0 ? json_integer((json_int_t)m->default_path_budget) : json_null();
        json_array_append_new(list, json_pack("{s:s, s:s, s:o, s:o, s:I, s:I}", "id", m->id, "title", m->title, "takes",
                                              takes, "default_path_budget", budget, "default_max_iterations",
                                              (json_int_t)m->default_max_iteration, "max_iterations_with_starts",
                                              (json_int_t)m->max_iteration_of_starts));
    }
    return list;
}

static json_t *stop_reasons_json(void)
{
    json_t *list = json_array();
    for (int i = 0; i < STOP_N_REASON; i++) {
        const struct stop_reason_info *r = stop_reason_info((enum stop_reason)i);
        json_array_append_new(list, json_pack("{s:s, s:s}", "id", r->id, "meaning", r->meaning));
    }
    return list;
}

json_t *catalogue_json(void)
{
    return json_pack("{s:o, s:o, s:o}", "models", models_json(), "methods", methods_json(), "stop_reasons",
                     stop_reasons_json());
}
