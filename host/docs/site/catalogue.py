"""Parts of the site that are made of the code: the commands with their options, and what the board answers."""

from __future__ import annotations

import click
from armtempo.cli import main
from armtempo_shared import meanings
from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.application import Sphinx


class BoardCodes(Directive):
    """``{board-codes}``: number, name, meaning and cure of each refusal and fault of the board."""

    def run(self) -> list[nodes.Node]:
        """One table."""
        rows = [
            (str(code), name, meaning, cure)
            for code, (name, meaning, cure) in sorted(meanings.ERRORS.items())
        ]
        return [table(("number", "name", "what it means", "what to do"), rows)]


class Commands(Directive):
    """``{commands}``: a section for each command, as its help page describes it."""

    def run(self) -> list[nodes.Node]:
        """The sections, in the order of the help page."""
        group = click.Context(main, info_name="armtempo")
        return [self._section(group, name) for name in main.list_commands(group)]

    def _section(self, group: click.Context, name: str) -> nodes.section:
        command = main.get_command(group, name)
        assert command is not None
        context = click.Context(command, info_name=name, parent=group)
        section = nodes.section(ids=[nodes.make_id(name)], names=[name])
        section += nodes.title(text=name)
        section += nodes.literal_block(
            text=command.get_usage(context).removeprefix("Usage: "), language="text"
        )
        for paragraph in (command.help or "").split("\n\n"):
            section += nodes.paragraph(text=" ".join(paragraph.replace("\b", "").split()))
        records = [parameter.get_help_record(context) for parameter in command.params]
        if any(records):
            section += table(("option", "what it does"), [record for record in records if record])
        return section


def table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> nodes.table:
    """A table: names in the first column, plain text in the others."""
    group = nodes.tgroup(cols=len(heads))
    group += [nodes.colspec(colwidth=1) for _ in heads]
    group += nodes.thead("", row([nodes.Text(head) for head in heads]))
    group += nodes.tbody(
        "", *(row([nodes.literal(text=name), *map(nodes.Text, rest)]) for name, *rest in rows)
    )
    return nodes.table("", group)


def row(cells: list[nodes.Node]) -> nodes.row:
    """One row, a paragraph in each cell."""
    return nodes.row("", *(nodes.entry("", nodes.paragraph("", "", cell)) for cell in cells))


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx: makes the directives known."""
    app.add_directive("board-codes", BoardCodes)
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}
