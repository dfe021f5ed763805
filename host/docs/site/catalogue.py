"""Parts of the site that are made of the code: the commands with their options, and what the board answers."""

from __future__ import annotations

import re
from pathlib import Path

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
        self.state.document.settings.env.note_reread()  # made of the code, which no page's date tells
        rows = [
            (str(code), name, meaning, cure)
            for code, (name, meaning, cure) in sorted(meanings.ERRORS.items())
        ]
        return [table(("number", "name", "what it means", "what to do"), rows)]


class Commands(Directive):
    """``{commands}``: a section for each command, as its help page describes it."""

    def run(self) -> list[nodes.Node]:
        """The sections, in the order of the help page."""
        self.state.document.settings.env.note_reread()
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
        names = [name for name in names_of_arguments(command) if "{" not in name]  # that one says it itself
        arguments = [(name, described(command, name)) for name in names]
        if arguments:
            section += table(("argument", "what it is"), arguments)
        options = [parameter for parameter in command.params if isinstance(parameter, click.Option)]
        records = [_plain(option.get_help_record(context)) for option in options]
        if any(records):
            section += table(("option", "what it does"), [record for record in records if record])
        return section


class PaperPage(Directive):
    """``{paper}``: the body of the page that ``armtempo paper`` writes, below this page's own title."""

    def run(self) -> list[nodes.Node]:
        """As it is, in a box that the style sheet knows."""
        page = Path(__file__).parents[1] / "paper.html"
        self.state.document.settings.env.note_dependency(str(page))
        body = page.read_text(encoding="utf-8").partition("<body>")[2].partition("</body>")[0]
        _, _, content = body.partition("</p>")  # after its title and first lines
        return [nodes.raw("", f'<div class="paper">{content}</div>', format="html")]


def names_of_arguments(command: click.Command) -> list[str]:
    """What the usage line calls the arguments."""
    context = click.Context(command)
    return [
        parameter.make_metavar(context).strip("[].")
        for parameter in command.params
        if isinstance(parameter, click.Argument)
    ]


def described(command: click.Command, name: str) -> str:
    """What the help says of an argument: ``NAME: a sentence.``; "" if it says nothing."""
    text = " ".join((command.help or "").split())
    found = re.search(rf"(?:^|\s){re.escape(name)}: (.+?\.)(?=\s[A-Z]|$)", text)
    return found[1] if found else ""


def _plain(record: tuple[str, str] | None) -> tuple[str, str] | None:
    """Ranges in words."""
    if record is None:
        return None
    words = re.sub(r"\b([\d.]+)<=x<=([\d.]+)", r"\1 to \2", record[1])
    return record[0], re.sub(r"\bx>=([\d.]+)", r"at least \1", words)


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


def without_modules(
    _app: Sphinx,
    _what: str,
    _name: str,
    _object: object,
    _options: object,
    signature: str | None,
    returns: str | None,
) -> tuple[str | None, str | None]:
    """A signature as a person writes it: types without their modules, defaults without what only Python knows."""

    def short(text: str | None) -> str | None:
        return text and re.sub(r"~?\b(?:[a-z_]\w*\.)+(?=[A-Z])|~", "", re.sub(r"<[^<>]*>", "...", text))

    return short(signature), short(returns)


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx: makes the directives known."""
    app.add_directive("board-codes", BoardCodes)
    app.add_directive("commands", Commands)
    app.add_directive("paper", PaperPage)
    app.connect("autodoc-process-signature", without_modules)
    return {"parallel_read_safe": True}
