"""What somebody may have meant by a word that is not known."""

from __future__ import annotations

from collections.abc import Iterable

_LIKELY, _SURE = 0.6, 0.8
"""Least similarity, as ``difflib`` measures it: for a question, for a statement."""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """A question for the nearest known word, to stand after an error; "" if none is near."""
    near = _nearest(word, known, _LIKELY)
    return f"; did you mean {near!r}?" if near else ""


def misspelt(word: str, found: Iterable[str]) -> str:
    """The one of the words found that is most surely ``word``, with a letter wrong or two exchanged; else ""."""
    words = list(found)
    exchanged = [other for other in words if sorted(other) == sorted(word)]
    return exchanged[0] if exchanged else _nearest(word, words, _SURE)


def _nearest(word: str, known: Iterable[str], least: float) -> str:
    import difflib  # takes a while, and most words are known

    found = difflib.get_close_matches(word, list(known), 1, least)
    return found[0] if found else ""
