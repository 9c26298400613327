"""Words of a command line taken apart by its form, such as `goto NORTH EAST DOWN [SPEED]`.

Lower case stands for itself (`cruise|hover`: one of them), upper case for a number, NAME for any word; what stands in
brackets may be left out. The form that people read in messages is the one that is applied.
"""

from collections.abc import Sequence

from sitl.toml_file import LARGEST

__all__ = ["Argument", "arguments"]

Argument = float | str


def arguments(form: str, words: Sequence[str]) -> list[Argument] | None:
    """Values for the places of the form after its first word; None where the words are not of this form."""
    places = form.split()
    fewest = sum(not place.startswith("[") for place in places)
    if not fewest <= len(words) <= len(places):
        return None
    values = [_value(place.strip("[]"), word) for place, word in zip(places, words, strict=False)][1:]
    return None if None in values else [value for value in values if value is not None]


def _value(place: str, word: str) -> Argument | None:
    if place == "NAME":
        return word
    if not place.isupper():
        return word if word in place.split("|") else None
    try:
        value = float(word)
    except ValueError:
        return None
    return value if abs(value) <= LARGEST else None
