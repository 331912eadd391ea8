"""No line of the given files is longer than 120 columns. clang-format breaks code, but leaves comments as they are.
Prints each breach; exit status 1 when there is one."""
import sys

COLUMNS = 120


def main():
    breaches = []
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as source:
            breaches += [f"{path}:{number}: {len(line) - 1} columns" for number, line in enumerate(source, 1)
                         if len(line.rstrip("\n")) > COLUMNS]
    print("\n".join(breaches) if breaches else "columns ok")
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main())
