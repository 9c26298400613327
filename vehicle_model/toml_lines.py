"""Where the entries of a TOML text stand: tomllib gives values without lines, messages for people need them."""

import re

__all__ = ["Keys", "blank_texts", "entry_lines", "line_of"]

Keys = tuple[str | int, ...]  # where an entry stands: names of tables and keys, indices in arrays of tables

_KEY = r"""(?:[A-Za-z0-9_-]+|"[^"\n]*"|'[^'\n]*')"""
_DOTTED = rf"{_KEY}(?:[ \t]*\.[ \t]*{_KEY})*"
_ASSIGNMENT = re.compile(rf"\s*({_DOTTED})\s*=")
_TABLE = re.compile(rf"\s*\[\s*({_DOTTED})\s*\]")
_TABLE_OF_ARRAY = re.compile(rf"\s*\[\[\s*({_DOTTED})\s*\]\]")
_TEXT_OR_COMMENT = re.compile(
    r'"""(?:\\.|[^\\])*?"""|\'\'\'.*?\'\'\'|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|#[^\n]*', re.DOTALL
)


def blank_texts(text: str) -> str:
    """The TOML text with all strings and comments overwritten by `~`, each character and line break in its place."""
    return _TEXT_OR_COMMENT.sub(lambda match: re.sub(r"[^\r\n]", "~", match[0]), text)


def entry_lines(text: str) -> dict[Keys, int]:
    """Line (from 1) of every table header and key of a valid TOML text; keys inside inline tables are left out."""
    lines: dict[Keys, int] = {}
    sizes: dict[Keys, int] = {}  # of the arrays of tables met so far
    table: Keys = ()
    depth = 0  # of brackets that a value on an earlier line has left open
    for number, (line, blanked) in enumerate(zip(text.split("\n"), blank_texts(text).split("\n"), strict=True), 1):
        begins = depth == 0 and blanked.strip(" \t\r~") != ""  # not inside a value, a text or a comment
        if begins and (match := _TABLE_OF_ARRAY.match(line)):
            array = _placed(_split(match[1]), sizes, whole=False)
            sizes[array] = sizes.get(array, 0) + 1
            table = (*array, sizes[array] - 1)
            lines.setdefault(array, number)
            lines[table] = number
        elif begins and (match := _TABLE.match(line)):
            table = _placed(_split(match[1]), sizes, whole=True)
            lines[table] = number
        else:
            if begins and (match := _ASSIGNMENT.match(line)):
                lines.setdefault((*table, *_split(match[1])), number)
            depth += sum(map(blanked.count, "[{")) - sum(map(blanked.count, "]}"))
    return lines


def line_of(lines: dict[Keys, int], keys: Keys) -> int:
    """Line of the entry, or of the innermost table around it that has one; 1 if none has."""
    while keys and keys not in lines:
        keys = keys[:-1]
    return lines.get(keys, 1)


def _split(dotted: str) -> list[str]:
    return [key.strip("\"'") for key in re.findall(_KEY, dotted)]


def _placed(names: list[str], sizes: dict[Keys, int], *, whole: bool) -> Keys:
    """Place that a header names: below an array of tables it means the array's last table so far."""
    keys: Keys = ()
    for position, name in enumerate(names):
        keys = (*keys, name)
        if keys in sizes and (whole or position < len(names) - 1):
            keys = (*keys, sizes[keys] - 1)
    return keys
