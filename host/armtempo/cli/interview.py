"""Questions at the terminal: '?' explains, '<' goes back, and Ctrl-C keeps what was answered."""

from __future__ import annotations

import json
from pathlib import Path

import click

from armtempo.basics.errors import InputError
from armtempo.formats.atomic_file import replace_text
from armtempo.new_arm import questions
from armtempo.new_arm.questions import Answers


def draft_path(folder: Path) -> Path:
    """Where the answers for a project folder are kept until it is made."""
    return folder.parent / f".{folder.name}.draft.json"


def hold(folder: Path, resume: bool) -> Answers:
    """Ask until all is answered. KeyboardInterrupt says how to go on, where answers were kept."""
    draft = draft_path(folder)
    answers = _kept(draft) if resume else {}
    click.echo("'?' explains a question, '<' goes back to the one before; Ctrl-C keeps what was answered.")
    try:
        while (question := questions.following(answers)) is not None:
            text = click.prompt(question.text, default=question.default).strip()
            if text == "?":
                click.echo(question.explanation)
            elif text == "<":
                if answers:
                    answers.popitem()
            else:
                try:
                    question.read(text)
                except questions.WrongAnswerError as wrong:
                    click.echo(f"  {wrong}")
                    continue
                answers[question.key] = text
                draft.parent.mkdir(parents=True, exist_ok=True)
                replace_text(draft, json.dumps(answers))
    except (click.Abort, KeyboardInterrupt):
        if not draft.exists():
            raise
        raise KeyboardInterrupt(f"the answers are kept; go on with: armtempo new {folder} --resume") from None
    return answers


def _kept(draft: Path) -> Answers:
    """The answers of a draft, as far as they can be taken; InputError where there are none."""
    try:
        found = json.loads(draft.read_text(encoding="utf-8"))
        given = {str(key): str(value) for key, value in found.items()}
    except (OSError, ValueError, AttributeError):
        raise InputError(f"{draft}: no answers are kept there", "leave out --resume") from None
    answers: Answers = {}
    while (question := questions.following(answers)) is not None and question.key in given:
        try:
            question.read(given[question.key])
        except questions.WrongAnswerError:
            break
        answers[question.key] = given[question.key]
    return answers
