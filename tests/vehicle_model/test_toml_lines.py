"""Lines of TOML entries, for texts as awkward as TOML allows."""

import tomllib
from typing import Any

from vehicle_model.toml_lines import blank_texts, entry_lines, line_of

AWKWARD = '''\
top = """ [no.table]
key = 1 # not a comment
"""
a.b = 1 # [neither]
[x]
"quoted key" = 'a # b [c]'
list = [ # opens
  { k = 1 },
  [1], "]", # looks like a header
]
after = 1
[[t]]
n = 1
[t.sub]
m = 2
[[t.inner]]
i = 1
[[t]] # second
n = 2
[t.sub]
m = 3
[[t.inner]]
i = 2
[[t.inner]]
i = 3
'''

LINES = {
    ("top",): 1, ("a", "b"): 4, ("x",): 5, ("x", "quoted key"): 6, ("x", "list"): 7, ("x", "after"): 11,
    ("t",): 12, ("t", 0): 12, ("t", 0, "n"): 13, ("t", 0, "sub"): 14, ("t", 0, "sub", "m"): 15,
    ("t", 0, "inner"): 16, ("t", 0, "inner", 0): 16, ("t", 0, "inner", 0, "i"): 17,
    ("t", 1): 18, ("t", 1, "n"): 19, ("t", 1, "sub"): 20, ("t", 1, "sub", "m"): 21,
    ("t", 1, "inner"): 22, ("t", 1, "inner", 0): 22, ("t", 1, "inner", 0, "i"): 23,
    ("t", 1, "inner", 1): 24, ("t", 1, "inner", 1, "i"): 25,
}  # fmt: skip


def test_every_key_is_found_on_its_line_and_nothing_inside_texts_lists_and_comments() -> None:
    assert entry_lines(AWKWARD) == LINES
    document = tomllib.loads(AWKWARD)
    for keys in LINES:  # every place exists in what the parser made of the text
        at: Any = document
        for key in keys:
            at = at[key]


def test_an_entry_without_a_line_of_its_own_has_that_of_the_innermost_table_around_it() -> None:
    lines = entry_lines(AWKWARD)
    assert line_of(lines, ("x", "list", 0, "k")) == 7
    assert line_of(lines, ("t", 1, "missing")) == 18
    assert line_of(lines, ("missing",)) == 1


def test_blanking_keeps_every_character_in_its_place() -> None:
    blanked = blank_texts(AWKWARD)
    assert [len(line) for line in blanked.split("\n")] == [len(line) for line in AWKWARD.split("\n")]
    assert not set("\"'#") & set(blanked)
