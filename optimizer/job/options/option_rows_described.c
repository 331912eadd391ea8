/* Rows of the option table: the described cloth, and corrections of other ones. Their numbers come from
 * base/catalogue/cloth_numbers.def and correction_numbers.def. */
#include "base/catalogue/cloth_description.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/options/option_rows.h"

#define OF_YARN(member) INTO_OF(struct job_cloth_yarn, member)
/* A number is a value, or an object for a number that is searched. */
#define NUMBER_SCHEMA(lower, upper)                                                                                    \
    "{\"anyOf\": [{\"type\": \"number\", \"minimum\": " lower ", \"maximum\": " upper                                  \
    "}, {\"$ref\": \"#/components/schemas/SearchedNumber\"}]}"
#define NUMBER_ROW(where, name, units, lower, upper, value, text)                                                      \
    {.path = where #name,                                                                                              \
     .kind = OPTION_OWN,                                                                                               \
     .unit = units,                                                                                                    \
     .standard = #value,                                                                                               \
     .allowed = #lower ".." #upper ", or an object",                                                                   \
     .schema = NUMBER_SCHEMA(#lower, #upper),                                                                          \
     .meaning = text},
#define CLOTH_NUMBER(name, unit, lower, upper, standard, coordinate, structures, meaning)                              \
    NUMBER_ROW("cloth.", name, unit, lower, upper, standard, meaning)
#define YARN_NUMBER(name, unit, lower, upper, standard, coordinate, structures, meaning)
#define CORRECTION_NUMBER(name, unit, lower, upper, standard, coordinate, meaning)                                     \
    NUMBER_ROW("correction.", name, unit, lower, upper, standard, meaning)

static const char *weave_name(size_t i) { return cloth_weave_names[i]; }
static const char *surface_name(size_t i) { return film_surface_names[i]; }
static const char *optics_name(size_t i) { return film_optics_names[i]; }
static const char *metal_name(size_t i) { return film_metal_names[i]; }

/* Rows of a film or of sequins, whose paths begin with `where`; `numbers` and `texts` say where values go. */
#define FILM_NUMBER(where, into, name, from, to, units, value, text)                                                   \
    {                                                                                                                  \
        .path = where #name, .kind = OPTION_NUMBER, into(name), RANGE(from, to), .unit = units, .standard = value,     \
        .meaning = text                                                                                                \
    }
#define FILM_METAL(where, numbers, many, texts)                                                                        \
    {.path = where "metal",                                                                                            \
     .kind = OPTION_WORD,                                                                                              \
     texts(metal),                                                                                                     \
     .choice_at = metal_name,                                                                                          \
     .standard = "\"silver\"",                                                                                         \
     .meaning = "Gives the color."},                                                                                   \
        {.path = where "color",                                                                                        \
         .kind = OPTION_NUMBERS,                                                                                       \
         many(color),                                                                                                  \
         RANGE(0.001, 1),                                                                                              \
         .left_out = "from the metal",                                                                                 \
         .allowed = "r, g, b",                                                                                         \
         .meaning = "Reflectance at normal incidence."},                                                               \
        FILM_NUMBER(where, numbers, roughness, 0.02, 1, NULL, "0.2", "Alpha of GGX."),                                 \
        {.path = where "surface",                                                                                      \
         .kind = OPTION_WORD,                                                                                          \
         texts(surface),                                                                                               \
         .choice_at = surface_name,                                                                                    \
         .standard = "\"smooth\"",                                                                                     \
         .meaning = "Facets that glitter in pictures, or `smooth`."},                                                  \
        {.path = where "optics",                                                                                       \
         .kind = OPTION_WORD,                                                                                          \
         texts(optics),                                                                                                \
         .choice_at = optics_name,                                                                                     \
         .standard = "\"rays\"",                                                                                       \
         .meaning = "Diffraction model of colored glints, not of `smooth` and `flakes`."},                             \
        FILM_NUMBER(where, numbers, grain_um, 1, 1000, "um", "40", "Size of what glitters.")
#define FILM_OF_YARN(member) INTO_OF(struct job_cloth_yarn, film.member)
#define FILM_TEXT_OF_YARN(member) TEXT_INTO_OF(struct job_cloth_yarn, film.member)
#define FILM_NUMBERS_OF_YARN(member) NUMBERS_INTO_OF(struct job_cloth_yarn, film.member)
#define SEQUIN(member) INTO(cloth, sequins.member)
#define SEQUIN_TEXT(member) TEXT_INTO(cloth, sequins.member)
#define SEQUIN_NUMBERS(member) NUMBERS_INTO(cloth, sequins.member)

#define ORDER_SCHEMA                                                                                                   \
    "{\"type\": \"array\", \"items\": {\"type\": \"integer\", \"minimum\": 0, \"maximum\": 3}, \"minItems\": 1, "      \
    "\"maxItems\": 64}"

const struct job_option option_rows_described[] = {
    {.path = "cloth",
     .kind = OPTION_SECTION,
     .may_be_empty = true,
     OF_SECTION(cloth),
     .id = OPTION_CLOTH,
     .check = job_check_cloth,
     .left_out = "this, `volume` or `fibers`",
     .meaning =
         "The cloth described by its weave and yarns. Each number is a value, or an object `{value, lower, upper, "
         "prior: [mean, sd], fit}` for a number that is searched together with the scattering parameters "
         "(`fit` is true unless it is given). docs/described-cloth.md shows what each number does."},
    {.path = "cloth.weave",
     .kind = OPTION_WORD,
     TEXT_INTO(cloth, weave),
     .choice_at = weave_name,
     .left_out = "this, `draft`, `draft_file` or `texture`",
     .meaning = "Name of the weave."},
    {.path = "cloth.draft",
     .kind = OPTION_OWN,
     .left_out = "from `weave` or `texture`",
     .allowed = "1 to 32 texts of 1 to 32 signs 0 and 1",
     .schema =
         "{\"type\": \"array\", \"items\": {\"type\": \"string\", \"pattern\": \"^[01]{1,32}$\"}, \"minItems\": 1, "
         "\"maxItems\": 32}",
     .meaning = "One repeat of the weave, a text for each weft, the upper one first: 1 where the warp lies above."},
    {.path = "cloth.draft_file",
     .kind = OPTION_FILE_NAME,
     .id = OPTION_DRAFT_FILE,
     INTO(cloth, draft_file),
     .left_out = "none",
     .meaning = "Draft as WIF 1.1, with a repeat of at most 32 threads: first pick above, first warp right."},
    {.path = "cloth.texture",
     .kind = OPTION_FILE_NAME,
     .id = OPTION_CLOTH_TEXTURE,
     INTO(cloth, texture),
     .left_out = "none",
     .meaning = "Photograph of the flat cloth from straight above, PNG (sRGB) or OpenEXR, that shows its weave. Draft "
                "and covers come from it where the job leaves them open; a contradiction is warned about "
                "(docs/weave-detection.md)."},
    {.path = "cloth.texture_px_per_mm",
     .kind = OPTION_NUMBER,
     .id = OPTION_TEXTURE_PX_PER_MM,
     INTO(cloth, texture_px_per_mm),
     RANGE(0.1, 10000),
     .unit = "px/mm",
     .left_out = "not known",
     .meaning = "Pixels of `texture` in a millimetre. Threads per centimetre, `flatness` and `crimp` then come from "
                "the photograph, too, where the job leaves them open."},
    {.path = "cloth.texture_colors",
     .kind = OPTION_BOOL,
     INTO(cloth, texture_colors),
     .standard = "false",
     .meaning =
         "Whether `C_TT` of named kinds of yarn starts at the colors that `texture` shows of warp and weft, if it "
         "shows them clearly. The brightness is that of the fitted rows."},
    {.path = "cloth.warp",
     .kind = OPTION_OWN,
     .standard = "[0]",
     .allowed = "1 to 64 kinds of yarn",
     .schema = ORDER_SCHEMA,
     .meaning = "Kinds of the warp yarns from left to right, as places in `yarns`; the order repeats."},
    {.path = "cloth.weft",
     .kind = OPTION_OWN,
     .standard = "[0]",
     .allowed = "1 to 64 kinds of yarn",
     .schema = ORDER_SCHEMA,
     .meaning = "Kinds of the weft yarns from below; of a knit, its courses."},
    {.path = "cloth.tile_warps",
     .kind = OPTION_COUNT,
     INTO(cloth, tile_yarn[1]),
     RANGE(1, 128),
     .left_out = "whole repeats, at least 8; wales: 4",
     .meaning = "Warp yarns, or wales, in the tile that is repeated."},
    {.path = "cloth.tile_wefts",
     .kind = OPTION_COUNT,
     INTO(cloth, tile_yarn[0]),
     RANGE(1, 128),
     .left_out = "whole repeats, at least 8; courses: 4",
     .meaning = "Weft yarns, or courses, in the tile."},
    {.path = "cloth.final_tiles",
     .kind = OPTION_COUNT,
     INTO(cloth, final_tiles),
     RANGE(1, 8),
     .standard = "1",
     .meaning =
         "With fitted numbers of the cloth: how many times as long along both edges the tile of the last fit and of "
         "the result is. Small tiles show the random places of their fibers; the search is fast with them."},
    {.path = "cloth.renew_places",
     .kind = OPTION_BOOL,
     INTO(cloth, renew_places),
     .standard = "false",
     .meaning = "With fitted numbers of the cloth: whether every estimate of the search has fibers at other random "
                "places. It makes twice as many cloths, and needs large tiles, such as 16 x 16 yarns."},
    {.path = "cloth.warp_per_cm",
     .kind = OPTION_NUMBER,
     INTO(cloth, threads_per_cm[1]),
     RANGE(1, 400),
     .unit = "1/cm",
     .left_out = "from `cover_warp`",
     .meaning = "Warp yarns in a centimetre, where they were counted. Replaces `cover_warp`."},
    {.path = "cloth.weft_per_cm",
     .kind = OPTION_NUMBER,
     INTO(cloth, threads_per_cm[0]),
     RANGE(1, 400),
     .unit = "1/cm",
     .left_out = "from `cover_weft`",
     .meaning = "Weft yarns in a centimetre. Replaces `cover_weft`."},
    {.path = "cloth.seed",
     .kind = OPTION_LARGE_COUNT,
     INTO(cloth, seed),
     .standard = "1",
     .meaning = "Selects the random places of the fibers. All values of the numbers use the same."},
#include "base/catalogue/cloth_numbers.def"
#undef CLOTH_NUMBER
#undef YARN_NUMBER
    {.path = "cloth.yarns",
     .kind = OPTION_LIST,
     .id = OPTION_YARNS,
     LIST_INTO(cloth, yarn, n_yarn),
     RANGE(1, CLOTH_MAX_KIND),
     .items = "kinds of yarn",
     .left_out = "one kind; velvet: ground and pile",
     .meaning = "The kinds of yarn. Each is a group of fibers, and has scattering parameters of its own when it has a "
                "`name`. The last "
                "kind of a velvet is its pile."},
    {.path = "cloth.yarns[].fibers",
     .kind = OPTION_COUNT,
     OF_YARN(n_fiber),
     RANGE(1, 100000),
     .left_out = "40; pile: 16; felt: 600",
     .allowed = "1..1000, felt 1..100000",
     .meaning = "Fibers in a section of the yarn, in a tuft of the pile, or in the tile of a felt."},
    {.path = "cloth.yarns[].name",
     .kind = OPTION_TEXT,
     TEXT_INTO_OF(struct job_cloth_yarn, name),
     .left_out = "one set of scattering parameters for all kinds",
     .allowed = "1..20 characters `A-Z a-z 0-9 _ -`",
     .schema = "{\"pattern\": \"^[A-Za-z0-9_-]{1,20}$\"}",
     .meaning = "With a name for each of several kinds surface models fit a set of parameters for each, named "
                "`NAME.C_R.r`."},
    {.path = "cloth.yarns[].plies",
     .kind = OPTION_COUNT,
     OF_YARN(n_ply),
     RANGE(1, CLOTH_MAX_PLY),
     .standard = "1",
     .meaning = "Plies that are twisted together."},
    {.path = "cloth.yarns[].melange_with",
     .kind = OPTION_COUNT,
     OF_YARN(melange_with),
     RANGE(0, 3),
     .left_out = "pure yarn",
     .meaning = "Kind that a share of this yarn's fibers belongs to; the number `melange` is the share."},
    {.path = "cloth.yarns[].film_width_um",
     .kind = OPTION_NUMBER,
     FILM_OF_YARN(width_um),
     RANGE(10, 5000),
     .unit = "um",
     .left_out = "no film",
     .meaning =
         "Width of a flat film of metallised plastic around the yarn. Without `fibers` the yarn is the film alone "
         "(lame); such kinds come last and have no `name`."},
    FILM_NUMBER("cloth.yarns[].film_", FILM_OF_YARN, thickness_um, 2, 500, "um", "12", "Thickness of the film."),
    FILM_NUMBER("cloth.yarns[].film_", FILM_OF_YARN, wraps_per_m, -50000, 50000, "1/m", "0",
                "Turns in a metre; whole in the tile."),
    FILM_METAL("cloth.yarns[].film_", FILM_OF_YARN, FILM_NUMBERS_OF_YARN, FILM_TEXT_OF_YARN),
    {.path = "cloth.sequin_diameter_um",
     .kind = OPTION_NUMBER,
     SEQUIN(width_um),
     RANGE(50, 50000),
     .unit = "um",
     .left_out = "no sequins",
     .meaning = "Diameter of sequins: discs of metallised film on the face of the cloth."},
    FILM_NUMBER("cloth.sequin_", SEQUIN, thickness_um, 5, 2000, "um", "100", "Their thickness."),
    FILM_NUMBER("cloth.sequin_", SEQUIN, spacing_um, 50, 100000, "um", "3000",
                "Their distance along the weft, at which the tile has whole ones."),
    FILM_NUMBER("cloth.sequin_", SEQUIN, row_spacing_um, 50, 100000, "um", "2000", "Between their rows."),
    FILM_NUMBER("cloth.sequin_", SEQUIN, tilt_deg, 0, 60, "deg", "12", "Tilt of all, by which they overlap."),
    FILM_NUMBER("cloth.sequin_", SEQUIN, tilt_spread_deg, 0, 20, "deg", "2", "Standard deviation of single tilts."),
    FILM_METAL("cloth.sequin_", SEQUIN, SEQUIN_NUMBERS, SEQUIN_TEXT),
#define CLOTH_NUMBER(name, unit, lower, upper, standard, coordinate, structures, meaning)
#define YARN_NUMBER(name, unit, lower, upper, standard, coordinate, structures, meaning)                               \
    NUMBER_ROW("cloth.yarns[].", name, unit, lower, upper, standard, meaning)
#include "base/catalogue/cloth_numbers.def"
    {.path = "correction",
     .kind = OPTION_SECTION,
     INTO(cloth, has_correction),
     .id = OPTION_CORRECTION,
     .check = job_check_correction,
     .left_out = "the fibers are used as they are",
     .meaning =
         "Corrections of the fibers of a scan or a file. Each number is a value, or an object as in `cloth` for one "
         "that is fitted together with the scattering parameters. The result says which corrections the "
         "measurements ask for and what they gain (docs/scanned-cloth.md)."},
#include "base/catalogue/correction_numbers.def"
#undef CORRECTION_NUMBER
    {.path = "composition",
     .kind = OPTION_TEXT,
     TEXT_INTO(cloth, composition),
     .check = job_check_composition,
     .left_out = "not known",
     .allowed = "percentages that sum to 100",
     .meaning = "Fibers for exports: `60 % cotton, 40 % polyester`."},
    {.path = "weight_g_m2",
     .kind = OPTION_NUMBER,
     INTO(cloth, weight_g_m2),
     RANGE(1, 10000),
     .unit = "g/m2",
     .left_out = "not known",
     .meaning = "Weight for exports."},
    {.path = NULL},
};
