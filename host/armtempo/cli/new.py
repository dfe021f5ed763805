"""``armtempo new``: a project folder for a new arm, described by options or by answers at the terminal."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from armtempo.basics import json_text
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError
from armtempo.cli import options, results
from armtempo.diagnosis import figures
from armtempo.new_arm import folder as project_folder
from armtempo.new_arm import joint_entry, questions
from armtempo.new_arm.folder import ArmText
from armtempo.new_arm.questions import Answers


@click.command("new")
@click.argument("folder", type=options.PATH)
@click.option("--like", metavar="ARM", help="Copy a shipped arm, such as ar4.")
@click.option(
    "--urdf",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Import the arm of a URDF. Needs the extra 'urdf'.",
)
@click.option(
    "--joint",
    "joints",
    multiple=True,
    metavar="KEY=VALUE,…",
    help="One joint, base first; repeat for each: name, d_mm, a_mm, alpha_deg, theta_offset_deg, "
    "low_deg, high_deg, steps_per_rev, microsteps, gear_ratio, speed_deg_s, encoder_counts, parallel_linkage (1); of a "
    "sliding one: type=prismatic, low_mm, high_mm, mm_per_rev, speed_mm_s.",
)
@click.option("--modified", is_flag=True, help="The joints' rows are in the modified (Craig) convention.")
@click.option("--resume", is_flag=True, help="Continue with the questions that Ctrl-C interrupted.")
@click.option(
    "--port", default=None, help="Port of the board; 'sim:board' is a virtual board.", metavar="PORT"
)
@options.as_json
def new(
    folder: Path,
    like: str | None,
    urdf: Path | None,
    joints: tuple[str, ...],
    modified: bool,
    resume: bool,
    port: str | None,
    as_json: bool,
) -> None:
    """Make a project folder: arm file, first job and settings.

    FOLDER: a new or an empty folder. Its README.md has the next commands.

    In a terminal, it asks for what the options do not give: '?' explains, '<' goes back.
    """
    if sum(map(bool, (like, urdf, joints))) > 1:
        raise InputError("--like, --urdf and --joint exclude each other", "give one of them")
    project_folder.check_free(folder)
    asked = _asked() and not as_json
    if like or urdf or joints:
        arm = _given_arm(folder.name, like, urdf, joints, modified)
        if port is None:
            port = click.prompt("port of the board", default="sim:board") if asked else "sim:board"
    elif asked:
        answers = hold(folder, resume)
        arm, port = _arm_of(folder.name, answers), port or answers["port"]
    else:
        raise InputError("which arm?", "give --like ARM, --urdf FILE, or a --joint for each joint")
    written = project_folder.write(folder, arm, port)
    draft_path(folder).unlink(missing_ok=True)
    joint_figures = figures.of(arm.arm)
    values = {
        "files": [str(path) for path in written],
        "joints": [joint.values for joint in joint_figures],
        "notes": list(arm.notes),
    }
    next_step = f"next: cd {folder}; armtempo check; the other commands are in README.md"
    lines = [*(f"wrote {path}" for path in written), *figures.table(joint_figures)]
    lines += [*(f"note: {text}" for text in arm.notes), next_step]
    results.show(as_json, values, lines)


def _asked() -> bool:
    """Whether questions can be asked: stdin and stdout are terminals."""
    return sys.stdin.isatty()


def _given_arm(
    name: str, like: str | None, urdf: Path | None, joints: tuple[str, ...], modified: bool
) -> ArmText:
    if like:
        return project_folder.from_shipped(like)
    if urdf:
        return project_folder.from_urdf(urdf)
    return project_folder.from_joints(
        name, [joint_entry.parse(text, n) for n, text in enumerate(joints, 1)], modified
    )


def _arm_of(name: str, answers: dict[str, str]) -> ArmText:
    if answers["arm"] != "own":
        arm = project_folder.from_shipped(answers["arm"])
    else:
        modified = answers["convention"] == questions.MODIFIED
        arm = project_folder.from_joints(name, questions.joints(answers), modified)
    return project_folder.within(arm, questions.workspace(answers))


def draft_path(folder: Path) -> Path:
    """The file that keeps the answers until the project folder is made."""
    return folder.parent / f".{folder.name}.draft.json"


def hold(folder: Path, resume: bool) -> Answers:
    """Ask all questions. The text of KeyboardInterrupt says how to continue if answers were kept."""
    draft = draft_path(folder)
    answers = _kept(draft) if resume else {}
    results.echo("'?' explains a question, '<' goes back to the previous one; Ctrl-C keeps the answers.")
    try:
        while (question := questions.following(answers)) is not None:
            text = click.prompt(question.text, default=question.default).strip()
            if text == "?":
                results.echo(question.explanation)
            elif text == "<":
                if answers:
                    answers.popitem()
            else:
                try:
                    question.read(text)
                except questions.WrongAnswerError as wrong:
                    results.echo(f"  {wrong}")
                    continue
                answers[question.key] = text
                draft.parent.mkdir(parents=True, exist_ok=True)
                replace_text(draft, json.dumps(answers))
    except (click.Abort, KeyboardInterrupt):
        if not draft.exists():
            raise
        raise KeyboardInterrupt(
            f"the answers are kept; continue with: armtempo new {folder} --resume"
        ) from None
    return answers


def _kept(draft: Path) -> Answers:
    """The valid answers of a draft; raises InputError if there are none."""
    try:
        found = json_text.loads(draft.read_text(encoding="utf-8"))
        given = {str(key): str(value) for key, value in found.items()}
    except (OSError, ValueError, AttributeError):
        raise InputError(f"{draft}: no kept answers", "leave out --resume") from None
    answers: Answers = {}
    while (question := questions.following(answers)) is not None and question.key in given:
        try:
            question.read(given[question.key])
        except questions.WrongAnswerError:
            break
        answers[question.key] = given[question.key]
    return answers
