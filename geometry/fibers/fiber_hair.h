/* Layout of Cem Yuksel's .hair, for its reader and its writer; docs/file-formats.md has the bytes. */
#ifndef SELVEDGE_GEOMETRY_FIBER_HAIR_H
#define SELVEDGE_GEOMETRY_FIBER_HAIR_H

enum {
    HAIR_HEADER_BYTES = 128,
    HAIR_TEXT_OFFSET = 40,
    HAIR_TEXT_BYTES = 88,
    HAIR_SEGMENTS = 1,
    HAIR_POINTS = 2,
    HAIR_THICKNESS = 4,
    HAIR_TRANSPARENCY = 8,
    HAIR_COLOUR = 16,
    HAIR_KNOWN = 31
};

/* Parts of the text of a header that Selvedge writes. */
#define HAIR_TILE_KEY "selvedge tile_mm="
#define HAIR_GROUP_KEY " groups=rgb"
#define HAIR_SECTION_KEY " sections"
#define HAIR_LUMEN_KEY " lumens"

#endif
