"""Text that is shown to people: names and messages without characters that steer a terminal or a page."""

from __future__ import annotations


def is_plain(text: str) -> bool:
    """Whether a name has only characters that show: no control, format or line-breaking characters."""
    return text.isprintable()


def visible(text: str) -> str:
    r"""The text with control and format characters spelt out, such as ``\x1b``; line ends stay."""
    return "".join(
        char if char.isprintable() or char == "\n" else char.encode("unicode_escape").decode("ascii")
        for char in text
    )
