#!/usr/bin/python3
"""Writes the manual pages, and the completion of bash, zsh and fish, from the tables and texts behind --help.

    config/generate_manual.py PRINT-COMMANDS BIN OUT

PRINT-COMMANDS prints the commands and options of `selvedge` as JSON (clients/cli/arguments/print_commands_main.c). BIN is the folder of
the programs, whose --help is read, and selvedge.conf(5) follows from `selvedged --print-config`. OUT gets man/,
bash/, zsh/ and fish/."""
import json
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CLIENT = "client of the service that makes digital twins of cloth"
PURPOSES = {"selvedged": (8, "service that makes digital twins of cloth"),
            "selvedge-worker": (1, "run one job of Selvedge in its folder"),
            "selvedge-phantom": (1, "make artificial cloth with known fibers and scattering"),
            "selvedge-camera": (1, "show how Selvedge reads photographs, and calibrate cameras"),
            "selvedge-mpi": (1, "carry the messages of the ranks of one job of Selvedge")}
SEE_ALSO = ["selvedge(1)", "selvedged(8)", "selvedge-worker(1)", "selvedge-phantom(1)", "selvedge-camera(1)", "selvedge.conf(5)"]
STATUS = "0 done, 1 error or failed job, 2 wrong command line, 3 cancelled job, 130 interrupted."
OPTION = re.compile(r"--[a-z][a-z0-9-]*")


def version():
    with open(os.path.join(ROOT, "base", "version.h"), encoding="utf-8") as file:
        return re.search(r'SELVEDGE_VERSION "(.*?)"', file.read())[1]


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout


# ---- manual pages ----

def escape(text):
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("`", "\\(ga").replace("^", "\\(ha").replace("~", "\\(ti")
    return re.sub(r"^\.", "\\\\&.", text, flags=re.M)


def head(name, section, purpose):
    return (f'.TH {name.upper()} {section} "" "Selvedge {version()}" "Selvedge"\n.SH NAME\n{escape(name)} \\- {escape(purpose)}\n')


def see_also(name):
    others = [page for page in SEE_ALSO if not page.startswith(name + "(")]
    return (".SH SEE ALSO\n" + ", ".join(".BR {} ({})".format(*re.match(r"(.*)\((\d)\)", page).groups()).replace(".BR ", "\\fB")
                                         .replace(" (", "\\fR(") for page in others)
            + "\n.PP\nThe documentation is in /usr/share/doc/selvedge (or share/doc/selvedge below the prefix of the installation).\n")


def verbatim(lines):
    return ".nf\n" + escape("\n".join(lines).strip("\n")) + "\n.fi\n" if any(lines) else ""


def paragraphs(text):
    """Text of a command; lines with columns stay as they are."""
    if re.search(r"\S {3,}\S", text):
        return ".PP\n" + verbatim(text.rstrip("\n").split("\n"))
    return ".PP\n" + escape(" ".join(text.split())) + "\n" if text else ""


def option_item(option):
    letter = f"\\fB\\-{option['letter']}\\fR, " if option["letter"] else ""
    value = f" \\fI{escape(option['value'])}\\fR" if option["value"] else ""
    return f".TP\n{letter}\\fB\\-\\-{escape(option['name'])}\\fR{value}\n{escape(' '.join(option['help'].split()))}\n"


def client_page(table):
    options = {option["name"]: option for option in table["options"]}
    text = head("selvedge", 1, CLIENT)
    text += ".SH SYNOPSIS\n\\fBselvedge\\fR \\fICOMMAND\\fR [\\fIoptions\\fR]\n.br\n\\fBselvedge help\\fR \\fICOMMAND\\fR\n"
    text += ".SH DESCRIPTION\nSubmits jobs to a\n.BR selvedged (8)\nserver, follows them and downloads their results.\n.SH COMMANDS\n"
    for command in table["commands"] + table["tools"]:
        operand = f" \\fI{escape(command['operand'])}\\fR" if command["operand"] else ""
        text += f".SS \\fB{escape(command['name'])}\\fR{operand}\n{escape(command['summary'][0].upper() + command['summary'][1:])}.\n"
        text += paragraphs(command.get("text", ""))
        own = [name for name in command.get("options", []) if not options[name]["everywhere"]]
        text += "".join(option_item(options[name]) for name in own)
        if command in table["tools"]:
            text += ".PP\nNeeds no daemon; its \\-\\-help lists its options.\n"
    everywhere = [option for option in table["options"] if option["everywhere"] or option["name"] == "version"]
    text += ".SH OPTIONS OF EVERY COMMAND\n" + "".join(option_item(option) for option in everywhere)
    text += ".SH ENVIRONMENT\n.TP\n.B SELVEDGE_SERVER\naddress of the server\n"
    text += ".TP\n.B SELVEDGE_TOKEN\naccess token\n.TP\n.B SELVEDGE_TOKEN_FILE\nfile with the access token\n"
    return text + f".SH EXIT STATUS\n{STATUS}\n" + see_also("selvedge")


def help_items(text):
    """A help text as (option with its value, lines of its meaning) and, under None, the lines between."""
    items = []
    for line in text.split("\n"):
        match = re.match(r" {2,4}(-\S.*?)(?: {2,}| (?=(?:make|all|of)\b)|$)(.*)", line)
        if match:
            items.append((match[1], [match[2]]))
        elif items and items[-1][0] and re.match(r" {8,}\S", line):
            items[-1][1].append(line)
        else:
            if not items or items[-1][0]:
                items.append((None, []))
            items[-1][1].append(line)
    return items


def help_section(text):
    out = ""
    for option, lines in help_items(text):
        if option:
            out += f".TP\n\\fB{escape(option)}\\fR\n{escape(' '.join(' '.join(lines).split()))}\n"
        elif any(lines):
            out += ".PP\n" + verbatim(lines)
    return out


def helps(program, folder):
    """The help of a program and of its commands: name of the command (or ""), text."""
    path = os.path.join(folder, program)
    text = run(path, "--help")
    yield "", text
    if program == "selvedge-phantom":
        for command in dict.fromkeys(re.findall(rf"^  {program} ([a-z]+)", text, flags=re.M)):
            yield command, run(path, command, "--help")


def program_page(program, folder):
    section, purpose = PURPOSES[program]
    text = head(program, section, purpose) + ".SH DESCRIPTION\n"
    for command, help_text in helps(program, folder):
        text += (f".SH \"{program} {command}\"\n" if command else "") + help_section(help_text)
    return text + see_also(program)


def settings_page(folder):
    text = head("selvedge.conf", 5, "settings of selvedged") + ".SH DESCRIPTION\n"
    note = []
    for line in run(os.path.join(folder, "selvedged"), "--print-config").split("\n"):
        if line.startswith(";"):
            note.append(line.lstrip("; "))
        elif line.startswith("["):
            text += f".SH \"[{line.strip('[]')}]\"\n"
        elif "=" in line:
            key, value = (part.strip() for part in line.split("=", 1))
            text += f".TP\n\\fB{escape(key)}\\fR = {escape(value)}\n{escape(' '.join(note))}\n"
            note = []
        elif note:
            text += escape(" ".join(note)) + "\n"
            note = []
    return text + see_also("selvedge.conf")


# ---- completion ----

def long_options(program, folder):
    found = dict.fromkeys(option for _, text in helps(program, folder) for option in OPTION.findall(text))
    return sorted(found)


def bash_client(table):
    options = {option["name"]: option for option in table["options"]}
    names = [command["name"] for command in table["commands"] + table["tools"]] + ["help"]
    anywhere = " ".join("--" + name for name, option in options.items() if option["everywhere"] or name == "version")
    cases = "".join(f"        {command['name']}) words=\"{' '.join('--' + name for name in command['options'])}\" ;;\n"
                    for command in table["commands"])
    return f"""# completion of selvedge for bash
_selvedge()
{{
    local current="${{COMP_WORDS[COMP_CWORD]}}" command="" words="" i
    for ((i = 1; i < COMP_CWORD; i++)); do
        case "${{COMP_WORDS[i]}}" in
        -* | help) ;;
        *) command="${{COMP_WORDS[i]}}"; break ;;
        esac
    done
    case "$command" in
        "") words="{' '.join(names)} {anywhere}" ;;
{cases}    esac
    if [[ -z "$command" || "$current" == -* ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
    fi
}}
complete -o default -F _selvedge selvedge
"""


def bash_program(program, folder):
    name = "_" + program.replace("-", "_")
    commands = [command for command, _ in helps(program, folder) if command]
    words = " ".join(commands + long_options(program, folder))
    condition = '"${COMP_WORDS[COMP_CWORD]}" == -*' + (" || $COMP_CWORD -eq 1" if commands else "")
    return f"""# completion of {program} for bash
{name}()
{{
    if [[ {condition} ]]; then
        mapfile -t COMPREPLY < <(compgen -W "{words}" -- "${{COMP_WORDS[COMP_CWORD]}}")
    fi
}}
complete -o default -F {name} {program}
"""


def zsh_text(text):
    text = " ".join(text.split())
    return text.replace("'", "'\\''").replace("[", "\\[").replace("]", "\\]").replace(":", "\\:")


def zsh_option(option):
    value = f":{zsh_text(option['value'])}:_files" if option["value"] else ""
    return f"'--{option['name']}[{zsh_text(option['help'])}]{value}'"


def zsh_program(program, folder):
    commands = [command for command, _ in helps(program, folder) if command]
    first = [f"'1:command:({' '.join(commands)})'"] if commands else []
    return " ".join(first + [f"'{option}'" for option in long_options(program, folder)])


def zsh(table, folder):
    options = {option["name"]: option for option in table["options"]}
    commands = " \\\n        ".join(f"'{command['name']}:{zsh_text(command['summary'])}'" for command in table["commands"] + table["tools"])
    cases = "".join(f"    {command['name']}) _arguments {' '.join(zsh_option(options[name]) for name in command['options'])} '*:file:_files' ;;\n"
                    for command in table["commands"])
    programs = "".join(f"{program}) _arguments {zsh_program(program, folder)} '*:file:_files' ;;\n"
                       for program in PURPOSES if os.path.exists(os.path.join(folder, program)))
    anywhere = " ".join(zsh_option(option) for option in table["options"] if option["everywhere"] or option["name"] == "version")
    return f"""#compdef selvedge {' '.join(PURPOSES)}
# completion of the programs of Selvedge for zsh
_selvedge_client()
{{
    local -a commands
    commands=({commands} \\
        'help:explain a command')
    if (( CURRENT == 2 )); then
        _describe command commands
        _arguments {anywhere}
        return
    fi
    case "$words[2]" in
{cases}    help) _describe command commands ;;
    *) _files ;;
    esac
}}
case "$service" in
selvedge) _selvedge_client ;;
{programs}esac
"""


def fish_text(text):
    return "'" + " ".join(text.split()).replace("\\", "\\\\").replace("'", "\\'") + "'"


def fish_option(program, option, condition):
    letter = f" -s {option['letter']}" if option["letter"] else ""
    value = " -r" if option["value"] else ""
    return f"complete -c {program}{condition}{letter} -l {option['name']}{value} -d {fish_text(option['help'])}\n"


def fish_client(table):
    commands = table["commands"] + table["tools"]
    text = "# completion of selvedge for fish\n"
    for command in commands:
        text += f"complete -c selvedge -n __fish_use_subcommand -f -a {command['name']} -d {fish_text(command['summary'])}\n"
    names = " ".join(command["name"] for command in commands)
    text += "complete -c selvedge -n __fish_use_subcommand -f -a help -d 'explain a command'\n"
    text += f"complete -c selvedge -n '__fish_seen_subcommand_from help' -f -a '{names}'\n"
    for option in table["options"]:
        takers = " ".join(command["name"] for command in table["commands"] if option["name"] in command["options"])
        if option["everywhere"] or option["name"] == "version":
            text += fish_option("selvedge", option, "")
        else:
            text += fish_option("selvedge", option, f" -n '__fish_seen_subcommand_from {takers}'")
    return text


def fish_program(program, folder):
    text = f"# completion of {program} for fish\n"
    commands = [command for command, _ in helps(program, folder) if command]
    if commands:
        text += f"complete -c {program} -n __fish_use_subcommand -f -a '{' '.join(commands)}'\n"
    return text + "".join(f"complete -c {program} -l {option[2:]}\n" for option in long_options(program, folder))


def main():
    print_commands, folder, out = sys.argv[1:]
    table = json.loads(run(print_commands))
    files = {"man/selvedge.1": client_page(table), "man/selvedge.conf.5": settings_page(folder),
             "bash/selvedge": bash_client(table), "zsh/_selvedge": zsh(table, folder), "fish/selvedge.fish": fish_client(table)}
    for program, (section, _) in PURPOSES.items():
        if os.path.exists(os.path.join(folder, program)):
            files[f"man/{program}.{section}"] = program_page(program, folder)
            if long_options(program, folder):
                files[f"bash/{program}"] = bash_program(program, folder)
                files[f"fish/{program}.fish"] = fish_program(program, folder)
    for name, text in files.items():
        path = os.path.join(out, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)


if __name__ == "__main__":
    main()
