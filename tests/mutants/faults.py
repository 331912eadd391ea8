"""Small faults in source text: every place of a file where one of the operators below applies.

Works on tokens, not on a syntax tree: what does not compile is sorted out by the compiler. Left alone are comments, strings,
preprocessor lines, sizes of arrays and of memory, everything inside a call that logs, words a message or asserts, and answers to a
lack of memory, which no test provokes; and three kinds of places where every fault is equivalent (equivalent_places below).
"""
import dataclasses
import re

TOKEN = {
    "c": r"//[^\n]*|/\*.*?\*/|(?m:^[ \t]*\#(?:[^\n\\]|\\.|\\\n)*)",
    "js": r"//[^\n]*|/\*.*?\*/|`(?:[^`\\]|\\.)*`|(?<=[(=,:] )/[^/\n]+/\w*|(?<=\()/[^/\n]+/\w*",
    "py": r"\#[^\n]*|[rfb]*\"\"\".*?\"\"\"|[rfb]*'''.*?'''",
}
REST = (r"|(?P<string>[LuURrfb]?\"(?:[^\"\\\n]|\\.)*\"|[Lrfb]?'(?:[^'\\\n]|\\.)*')"
        r"|(?P<number>(?:0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)[uUlLfF]*)|(?P<word>[A-Za-z_$]\w*)"
        r"|(?P<operator><<=|>>=|===|!==|\*\*|->|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|=>|.)")
# names of calls whose arguments are words or only observe
SPOKEN = re.compile(r"^(log_\w+|error_set\w*|error_prefix|fprintf|printf|assert\w*|_Static_assert|print|console|fail\w*)$")
# what is dropped here leaks or stays locked, which no test of a result can see
RELEASES = re.compile(r"^(free|close|fclose|\w*_(release|free|close|unlock|lock|destroy|init|finalize)|log_\w+|assert\w*|print|progress_report)$")
DESCRIPTOR = re.compile(r"^(\w*_)?fd$")
# calls that do not depend on the order of their first two arguments; of the comparisons, only whether they are 0 is asked for
SYMMETRIC = re.compile(r"^(f(min|max)f?|hypotf?|memcmp|strn?(case)?cmp)$")
TYPES = re.compile(r"^(char|int|float|double|bool|status|size_t|ssize_t|off_t|u?int\d+_t|unsigned|signed|long|short|struct|enum|union|"
                   r"const|static|extern|inline|void|typedef|let|var|def|class|import|from|restrict|_Atomic|atomic_\w+)$")
CONTROL = {"if", "for", "while", "switch", "return", "sizeof", "else", "do", "case", "goto", "break", "continue", "default", "elif",
           "in", "not", "and", "or", "function", "async", "await", "new", "throw", "raise", "try", "catch", "except", "with", "yield",
           "lambda", "export", "_Alignof", "_Generic", "typeof"}
SWAP = {"<": ["<=", ">="], "<=": ["<", ">"], ">": [">=", "<="], ">=": [">", "<"], "==": ["!="], "!=": ["=="], "===": ["!=="], "!==": ["==="],
        "+=": ["-="], "-=": ["+="], "*=": ["/="], "/=": ["*="], "&&": ["||"], "||": ["&&"]}
BINARY = {"+": "-", "-": "+", "*": "/", "/": "*", "%": "*"}


@dataclasses.dataclass
class Token:
    kind: str
    text: str
    start: int
    end: int
    spoken: bool = False
    in_size: bool = False
    equivalent: bool = False


@dataclasses.dataclass
class Fault:
    path: str
    line: int
    operator: str
    start: int
    end: int
    new: str

    def apply(self, text):
        return text[:self.start] + self.new + text[self.end:]


def tokens_of(text, language):
    pattern = re.compile(f"(?P<skip>{TOKEN[language]}|\\s)" + REST, re.S)
    found = [Token(m.lastgroup, m.group(), m.start(), m.end()) for m in pattern.finditer(text) if m.lastgroup != "skip"]
    mark_spoken(found)
    mark_sizes(found)
    mark_equivalent(found)
    return found


def closing(found, i):
    """Index of the bracket that closes found[i]."""
    depth = 0
    for j in range(i, len(found)):
        depth += found[j].text in "([{" and len(found[j].text) == 1
        depth -= found[j].text in ")]}" and len(found[j].text) == 1
        if depth == 0:
            return j
    return len(found) - 1


def mark_spoken(found):
    for i, t in enumerate(found[:-1]):
        if t.kind == "word" and SPOKEN.match(t.text) and found[i + 1].text == "(":
            for k in range(i + 1, closing(found, i + 1) + 1):
                found[k].spoken = True


def statement_start(found, i):
    while i > 0 and found[i - 1].text not in (";", "{", "}"):
        i -= 1
    return i


def mark_sizes(found):
    """Sizes of arrays in declarations, and of memory that is asked for: one more element changes nothing."""
    for i, t in enumerate(found):
        if t.text in ("malloc", "calloc", "realloc", "aligned_alloc") and i + 1 < len(found) and found[i + 1].text == "(":
            for k in range(i + 1, closing(found, i + 1) + 1):
                found[k].in_size = True
        if t.text == "[" and found[statement_start(found, i)].kind == "word" and TYPES.match(found[statement_start(found, i)].text):
            for k in range(i, closing(found, i) + 1):
                found[k].in_size = True


def mark_equivalent(found):
    """Places where a fault changes nothing that a program can see.

    - The sign of a descriptor or of what snprintf returns: POSIX says -1 for a failure, a program with standard input,
      output and error open never gets the descriptor 0, and no text of the product is empty or fails to be printed.
    - The size of a buffer that is given to snprintf: buffers are larger than any text, as are the arrays of mark_sizes.
    - The first value of a struct error, which is written before it is read.
    """
    printed = {found[i - 2].text for i, t in enumerate(found) if i > 1 and t.text == "snprintf" and found[i - 1].text == "="}
    for i, t in enumerate(found[:-4]):
        before, after = found[max(0, i - 1)], found[i + 1]
        if t.text in ("<", ">=") and after.text == "0" and (DESCRIPTOR.match(before.text) or before.text in printed):
            t.equivalent = after.equivalent = True
        if t.text in ("snprintf", "vsnprintf") and after.text == "(":
            mark_argument(found, i + 1, 1)
        if t.text == "error" and before.text == "struct" and [x.text for x in found[i + 2:i + 4]] == ["=", "{"]:
            found[i + 4].equivalent = True


def mark_argument(found, bracket, wanted):
    """Marks one argument of the call with this opening bracket as a place of equivalent faults."""
    depth, argument = 0, 0
    for k in range(bracket + 1, closing(found, bracket)):
        depth += found[k].text in ("(", "[", "{")
        depth -= found[k].text in (")", "]", "}")
        if depth == 0 and found[k].text == ",":
            argument += 1
        elif argument == wanted:
            found[k].equivalent = True


def one_more(text):
    """Another constant: a whole number plus one, any other number doubled."""
    digits = re.match(r"(0[xX][0-9a-fA-F]+|[\d.]+(?:[eE][+-]?\d+)?)([uUlLfF]*)$", text)
    if digits is None:
        return None
    value, suffix = digits.groups()
    if re.fullmatch(r"0[xX].*|\d+", value):
        return f"{int(value, 0 if value[:2] in ('0x', '0X') else 10) + 1}{suffix}"
    return f"{2.0 * float(value) if float(value) != 0.0 else 1.0!r}{suffix}"


def operator_faults(found, i):
    t = found[i]
    before = found[i - 1] if i > 0 else None
    if t.equivalent:
        return
    if t.kind == "operator" and t.text in SWAP:
        yield from ((("compare" if t.text[0] in "<>=!" else "logic" if t.text in ("&&", "||") else "arithmetic"), t.start, t.end, new)
                    for new in SWAP[t.text])
    elif t.kind == "operator" and t.text in BINARY and before is not None and i + 1 < len(found):
        is_binary = before.kind in ("word", "number") and before.text not in CONTROL or before.text in (")", "]")
        spaced = before.end < t.start and t.end < found[i + 1].start
        if is_binary and spaced:
            yield "arithmetic", t.start, t.end, BINARY[t.text]
    elif t.kind == "operator" and t.text == "!" and i + 1 < len(found) and (found[i + 1].kind == "word" or found[i + 1].text == "("):
        yield "logic", t.start, t.end, ""
    elif t.kind == "number" and not t.in_size:
        new = one_more(t.text)
        if new is not None:
            yield "constant", t.start, t.end, new


def condition_faults(found, i, language):
    if found[i].text != "if" or found[i + 1].text != "(" or language == "py":
        return
    end = closing(found, i + 1)
    for new in ("0", "1"):
        yield "condition", found[i + 1].end, found[end].start, new


def swapped_arguments(found, i):
    if found[i].kind != "word" or found[i].text in CONTROL or TYPES.match(found[i].text) or found[i + 1].text != "(":
        return
    if SPOKEN.match(found[i].text) or SYMMETRIC.match(found[i].text):
        return
    if i > 0 and (found[i - 1].kind == "word" and found[i - 1].text not in CONTROL or found[i - 1].text == "*" and found[i - 1].end == found[i].start):
        return  # a declaration
    end, first, argument = closing(found, i + 1), i + 2, []
    depth = 0
    for k in range(i + 2, end + 1):
        if k == end or (depth == 0 and found[k].text == ","):
            if k > first:
                argument.append((first, k - 1))
            first = k + 1
        depth += found[k].text in ("(", "[", "{")
        depth -= found[k].text in (")", "]", "}")
    text = lambda a: "".join(t.text for t in found[a[0]:a[1] + 1])
    simple = lambda a: all(t.kind in ("word", "number") or t.text in ("->", ".", "&", "[", "]") for t in found[a[0]:a[1] + 1])
    return [(a, b) for a, b in zip(argument, argument[1:]) if simple(a) and simple(b) and text(a) != text(b)]


def is_statement(found, i):
    """The end (index of the semicolon) of an assignment or call that is a statement and may be dropped; None."""
    t = found[i]
    if t.kind != "word" or t.text in CONTROL or TYPES.match(t.text) or RELEASES.match(t.text):
        return None
    if found[i + 1].kind == "word" or found[i + 1].text == "*" and found[i + 1].end == found[i + 2].start or found[i + 1].text == ":":
        return None  # a declaration or a label
    depth, acts = 0, False
    for k in range(i, len(found)):
        depth += found[k].text in ("(", "[", "{")
        depth -= found[k].text in (")", "]", "}")
        if depth < 0 or found[k].text == "{" and depth == 1 and found[k - 1].text == ")":
            return None
        acts = acts or found[k].text in ("=", "+=", "-=", "*=", "/=", "|=", "&=", "^=", "++", "--", "(")
        if depth == 0 and found[k].text == ";":
            return k if acts else None
    return None


def starts_statement(found, i, heads):
    return i > 0 and (found[i - 1].text in (";", "{", "}", "else") or i - 1 in heads)


def control_heads(found):
    """Indices of the brackets that close the head of an if, for or while."""
    return {closing(found, i + 1) for i, t in enumerate(found[:-1]) if t.text in ("if", "for", "while") and found[i + 1].text == "("}


def statement_faults(found, i, heads, language):
    if language == "py" or not starts_statement(found, i, heads):
        return
    end = is_statement(found, i)
    if end is not None:
        yield "dropped statement", found[i].start, found[end].end, ";"
    if found[i].text in ("break", "continue") and found[i + 1].text == ";" and found[i].text == "continue":
        yield "dropped statement", found[i].start, found[i + 1].end, ";"
    if found[i].text == "return" and found[i + 1].text != ";":
        k = i + 1
        while k < len(found) and found[k].text != ";":
            k += 1
        if "".join(t.text for t in found[i + 1:k]) not in ("0", "STATUS_OK", "NULL", "false", "err"):
            yield "early return", found[i + 1].start, found[k].start, "0"


def early_returns(found, language):
    """The bodies of functions without a result, emptied, but for those that release something."""
    for i, t in enumerate(found):
        if language != "c" or t.text != "{" or i == 0 or found[i - 1].text != ")":
            continue
        start = statement_start(found, i)
        name = next((a.text for a, b in zip(found[start:i], found[start + 1:i]) if b.text == "("), "")
        if RELEASES.match(name):
            continue
        if any(x.text == "void" for x in found[start:start + 3]) and found[start].text in ("static", "void") and \
                all(x.text != "*" for x in found[start:start + 3]):
            yield "early return", t.start, t.end, "{ return;"


def faults_of(path, text, language):
    """All faults of a file."""
    found = tokens_of(text, language)
    heads = control_heads(found)
    out = []

    def add(operator, start, end, new):
        line_start = text.rfind("\n", 0, start) + 1
        if "NO_MEMORY" in text[line_start:text.find("\n", text.find("\n", end) + 1)]:
            return
        out.append(Fault(path, text.count("\n", 0, start) + 1, operator, start, end, new))

    for i, t in enumerate(found[:-2]):
        if t.spoken:
            continue
        for fault in [*operator_faults(found, i), *condition_faults(found, i, language), *statement_faults(found, i, heads, language)]:
            add(*fault)
        for a, b in swapped_arguments(found, i) or []:
            first, second = (text[found[x[0]].start:found[x[1]].end] for x in (a, b))
            between = text[found[a[1]].end:found[b[0]].start]
            add("swapped arguments", found[a[0]].start, found[b[1]].end, second + between + first)
    for fault in early_returns(found, language):
        add(*fault)
    return out
