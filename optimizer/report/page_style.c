#include "optimizer/report/page_style.h"

/* Colors have names that a dark screen redefines. Charts state their colors as attributes, because programs that make
 * PDFs apply no style sheet to them; rules for these attributes exchange them on a dark screen. */
static const char colors[] =
    ":root { color-scheme: light dark; --ink: #1c1f24; --soft: #5a6068; --line: #d8dbe0; --paper: #fff; --panel: "
    "#f4f5f7; --held: #2457a6; --flag: #8a5a00; --good: #1d7a46; --good-back: #dcf2e5; --fair: #b27d00; --fair-back: "
    "#fdf0d2; --bad: #b3261e; --bad-back: #fbe3e1; }\n"
    "@media screen and (prefers-color-scheme: dark) { :root { --ink: #e6e8ec; --soft: #a6adb8; --line: #3a404a; "
    "--paper: #14171c; --panel: #1e232a; --held: #8ab4ff; --flag: #e6b450; --good: #4fc07f; --good-back: #12301f; "
    "--fair: #e0a100; --fair-back: #362a0c; --bad: #ff8a80; --bad-back: #3d1715; }\n"
    "svg text[fill=\"#555\"] { fill: #a6adb8; } svg [stroke=\"#bbb\"], svg [stroke=\"#ddd\"] { stroke: #3a404a; }\n"
    "svg text[fill=\"#333\"] { fill: #e6e8ec; } svg polyline[stroke=\"#1c1f24\"] { stroke: #e6e8ec; }\n"
    "svg circle[stroke=\"#2457a6\"] { stroke: #8ab4ff; } svg circle[fill=\"#2457a6\"] { fill: #8ab4ff; }\n"
    "svg circle[stroke=\"#c0392b\"] { stroke: #ff8a80; } svg circle[fill=\"#c0392b\"] { fill: #ff8a80; }\n"
    "svg circle[stroke=\"#1e8449\"] { stroke: #4fc07f; } svg circle[fill=\"#1e8449\"] { fill: #4fc07f; } }\n";

static const char text[] =
    "body { font: 14px/1.45 system-ui, sans-serif; max-width: 1060px; margin: 2em auto; padding: 0 1em; color: "
    "var(--ink); background-color: var(--paper); }\n"
    "h1 { font-size: 1.9em; line-height: 1.2; margin: 0; overflow-wrap: anywhere; }\n"
    "h2 { font-size: 1.15em; margin: 1.8em 0 .5em; border-bottom: 1px solid; "
    "border-bottom-color: var(--line); padding-bottom: .2em; }\n"
    "h2.appendix { font-size: 1.5em; border: 0; margin-top: 3em; }\n"
    "table { border-collapse: collapse; } th, td { text-align: left; padding: .14em 1.2em .14em 0; vertical-align: "
    "top; } th { font-weight: 600; } td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }\n"
    "tr.held td { color: var(--held); } .flag { color: var(--flag); } .hint { color: var(--soft); }\n"
    ".charts, .pictures { display: flex; flex-wrap: wrap; gap: 14px; } figure { margin: 0; min-width: 10em; "
    "break-inside: avoid; } .pictures img { width: 104px; height: 104px; image-rendering: pixelated; margin-right: "
    "3px; } .lobes img { width: 128px; height: 128px; image-rendering: auto; vertical-align: bottom; } "
    ".surfaces img { width: auto; height: auto; max-width: 100%; } figcaption { font-size: .85em; margin-top: "
    ".3em; color: "
    "var(--soft); } .pictures figcaption { width: 0; min-width: 100%; }\n";

/* The two pages for a customer. Programs that make PDFs know names of colors in properties of one value only. */
static const char front[] =
    ".letterhead { display: flex; justify-content: space-between; align-items: center; min-height: 3em; margin-bottom: "
    "1.2em; padding-bottom: .6em; border-bottom: 2px solid; }\n"
    ".letterhead img { max-height: 44px; max-width: 200px; display: block; margin-right: 1em; } .letterhead .name { "
    "flex: 1; font-size: 1.15em; font-weight: 600; overflow-wrap: anywhere; } .letterhead .date { color: var(--soft); "
    "white-space: nowrap; }\n"
    ".subtitle { color: var(--soft); margin: .2em 0 1em; }\n"
    ".cloth img { display: block; width: 100%; max-height: 720px; object-fit: contain; object-position: left; }\n"
    ".verdict { padding: .7em 1em; border-left: 6px solid; border-left-color: var(--line); background-color: "
    "var(--panel); margin: 1.2em 0; break-inside: avoid; } .verdict b { font-size: 1.15em; } .verdict p { margin: .2em "
    "0; }\n"
    ".verdict.good, .verdict.good_but_undetermined { border-left-color: var(--good); background-color: "
    "var(--good-back); }\n"
    ".verdict.pictures_only { border-left-color: var(--fair); background-color: var(--fair-back); }\n"
    ".verdict.does_not_describe_this_cloth { border-left-color: var(--bad); background-color: var(--bad-back); }\n"
    ".numbers { display: flex; flex-wrap: wrap; margin: 1.2em -6px; padding: 0; } .numbers div { flex: 1 1 8em; "
    "margin: "
    "6px; background-color: var(--panel); padding: .6em .8em; } .numbers dt { color: var(--soft); font-size: .85em; } "
    ".numbers dd { margin: 0; font-size: 1.3em; font-weight: 600; font-variant-numeric: tabular-nums; }\n"
    ".front h2 { margin-top: 1.2em; } .front ul { margin: .4em 0; padding-left: 1.3em; }\n"
    "table.words { width: 100%; } table.words td, table.words th { padding: .3em .8em .3em 0; border-bottom: 1px "
    "solid; border-bottom-color: var(--line); } table.words td.n, table.words td.flag { white-space: nowrap; "
    "overflow-wrap: normal; } table.words small { color: var(--soft); }\n"
    ".pair { display: flex; justify-content: space-between; align-items: flex-start; } .pair > figure { width: 48%; "
    "min-width: 0; } .pair svg, .pair img { width: 100%; height: auto; display: block; } .pair img { max-height: "
    "380px; object-fit: contain; object-position: left; }\n";

static const char screens[] =
    "@media screen and (max-width: 700px) { body { margin: 1em auto; } h2, li, td, th, code, pre, p { overflow-wrap: "
    "anywhere; } pre { white-space: pre-wrap; } th, td { padding-right: .6em; font-size: 12px; } svg, img { max-width: "
    "100%; } svg { height: auto; } .pair { display: block; } .pair > figure { width: 100%; margin-bottom: 1em; } "
    "td.rgb { max-width: 3.2em; } table.words td.n, table.words td.flag, table.words th { white-space: normal; "
    "overflow-wrap: normal; padding-right: .5em; } table.words td.n { min-width: 3.2em; } .letterhead { flex-wrap: "
    "wrap; } }\n";

static const char prints[] =
    "@media print { body { margin: 0; padding: 0; max-width: none; font-size: 10px; } h1 { string-set: sample "
    "content(); } h2, h2 + p { break-after: avoid; } thead { display: table-header-group; } tr, svg { break-inside: "
    "avoid; } th, td { padding-right: .8em; } td.n { white-space: nowrap; } td { overflow-wrap: anywhere; } "
    "td.key, td.flag { overflow-wrap: normal; }\n"
    ".charts, .pictures { display: block; } .charts svg { width: 48%; height: auto; } .pictures figure { display: "
    "inline-block; margin: 0 14px 10px 0; vertical-align: top; }\n"
    ".front { font-size: 11.5px; break-after: page; } .front h2 { font-size: 15px; } .cloth img { max-height: 124mm; } "
    ".many .cloth img { max-height: 88mm; } .drawing img { object-fit: cover; } .pair img { max-height: 66mm; } "
    "table.words { font-size: 10.5px; } table.words td, table.words th { padding: .2em .8em .2em 0; } .letterhead { "
    "margin-bottom: 5mm; } h2.appendix { margin-top: 0; } }\n";

void page_style(bool letter, FILE *out)
{
    fprintf(out, "%s%s%s%s%s", colors, text, front, screens, prints);
    fprintf(out,
            "@page { size: %s; margin: 15mm 15mm 17mm; @bottom-left { content: string(sample); font: 8px sans-serif; "
            "color: #667; } @bottom-right { content: \"page \" counter(page) \" of \" counter(pages); font: 8px "
            "sans-serif; color: #667; } }\n",
            letter ? "letter" : "A4");
}
