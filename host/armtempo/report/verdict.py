"""The verdict on a run: OK, or what is wrong or undecided."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from armtempo_shared.sequence import ENDINGS, STOPPED
from numpy.typing import NDArray

from armtempo.model.joint_unit import JointUnit
from armtempo.model.steps import position, whole_cycles
from armtempo.report import peaks, replayed
from armtempo.report.evaluation import Evaluation, LegEvaluation
from armtempo.report.run_folder import Repetition, transmission
from armtempo.report.run_reader import RepetitionData

GOOD, BAD, OPEN = "good", "bad", "open"
"""States of a finding: as it should be, not so, undecided by what was recorded."""
STEPS_OFF = 1
"""Allowed difference of step pulses at the end: an angle halfway between two steps rounds either way."""
ROUNDED = 1e-3
"""Fraction above a limit that may be rounding of the record."""
_SUMMARIES = {GOOD: "OK", BAD: "Not OK", OPEN: "OK in what was measured"}


@dataclass(frozen=True)
class VerdictItem:
    """A sentence of the verdict; ``state`` is GOOD, BAD or OPEN."""

    state: str
    text: str


@dataclass(frozen=True)
class Verdict:
    """All findings on a run, bad ones first."""

    findings: tuple[VerdictItem, ...]

    @property
    def state(self) -> str:
        """The worst state of the findings."""
        states = {finding.state for finding in self.findings}
        return BAD if BAD in states else OPEN if OPEN in states else GOOD

    @property
    def summary(self) -> str:
        """The verdict in a word or two."""
        return _SUMMARIES[self.state]

    @property
    def line(self) -> str:
        """The verdict on one line, with the findings that are not GOOD."""
        reasons = [finding.text for finding in self.findings if finding.state == self.state != GOOD]
        return ": ".join([self.summary, "; ".join(reasons)]) if reasons else self.summary


def of(found: Evaluation) -> Verdict:
    """The verdict on a run."""
    findings = [
        *_repetitions(found),
        *_samples(found),
        *_steps(found),
        *_commanded(found),
        *_following(found),
        *_limits(found),
    ]
    order = (BAD, OPEN, GOOD)
    return Verdict(tuple(sorted(findings, key=lambda finding: order.index(finding.state))))


def _repetitions(found: Evaluation) -> Iterator[VerdictItem]:
    """How the repetitions ended, a sequence with its step."""
    entries = found.run.entries
    where = ", on a virtual board" if found.run.meta.get("virtual") else ""
    for repetition, entry in zip(found.run.repetitions, entries, strict=True):
        if entry.rows:
            yield _ending(repetition, entry, where)
    motions = [entry.complete for entry in entries if not entry.rows]
    if motions:
        text = f"{sum(motions)} of {len(motions)} repetitions complete{where}"
        yield VerdictItem(GOOD if all(motions) else BAD, text)


def _ending(repetition: RepetitionData, entry: Repetition, where: str) -> VerdictItem:
    if entry.complete:
        return VerdictItem(GOOD, f"finished after {whole_cycles(entry.ended.get('cycle', 0))}{where}")
    step = f"in {position(entry.ended['step'], entry.ended['cycle'])}" if entry.ended else _last(repetition)
    code = f" ({entry.fault})" if entry.fault else ""
    stopped = entry.state == ENDINGS[STOPPED]
    return VerdictItem(OPEN if stopped else BAD, f"{entry.state.replace('_', ' ')}{code} {step}{where}")


def _last(repetition: RepetitionData) -> str:
    if not repetition.rows:
        return "before its first row was reported"
    last = repetition.rows[-1]
    return f"after row {last.row} ({last.words}), {position(last.step, last.cycle)}, was reported"


def _samples(found: Evaluation) -> Iterator[VerdictItem]:
    """Missing or damaged samples; interrupted repetitions are only counted."""
    missing = [
        text for text in found.complaints if "cut short" not in text and replayed.SPEED_NOTE not in text
    ]
    yield from (VerdictItem(OPEN, text) for text in missing)
    if found.legs and not missing:
        yield VerdictItem(GOOD, "no sample is missing")


def _steps(found: Evaluation) -> Iterator[VerdictItem]:
    """Whether every complete run of a leg ended at the motion's last step."""
    checked = 0
    for leg in found.legs:
        if not leg.ends_steps:
            continue
        wrong = np.abs(np.array(leg.ends_steps) - planned_steps(leg)[1]).max(axis=0)
        names = [name for name, off in zip(leg.names, wrong, strict=True) if off > STEPS_OFF]
        if names:
            what = "the motion" if found.single else f"motion {leg.number} ({leg.words})"
            text = f"{_listed(names)} ended up to {wrong.max()} steps from where {what} ends"
            yield VerdictItem(BAD, f"{text}: please report it, as the board should make all steps")
        else:
            checked += len(leg.ends_steps)
    if checked:
        what = "the motion" if found.single else f"{checked} whole motions"
        yield VerdictItem(GOOD, f"the board made every step pulse of {what}")


def planned_steps(found: LegEvaluation) -> NDArray[np.int64]:
    """Steps (2, J) at the motion's start and end."""
    ends = np.stack([found.trajectory(0.0), found.trajectory(found.trajectory.duration_s)])
    return np.asarray(np.rint(transmission(found.joints).steps(ends)), dtype=np.int64)


def _commanded(found: Evaluation) -> Iterator[VerdictItem]:
    """Whether the command keeps the limits, of joints without an encoder."""
    asked = [
        (name, np.array(most.values[:2]), np.array(limit.values[:2]))
        for leg in found.legs
        for name, most, limit, measured in zip(
            leg.names, leg.extremes, leg.limits, leg.curves.measured, strict=False
        )
        if not measured
    ]
    beyond = dict.fromkeys(name for name, most, limit in asked if np.any(most > limit * (1.0 + ROUNDED)))
    if beyond:
        yield VerdictItem(
            BAD, f"the commanded motion exceeds the speed or acceleration limit of {_listed([*beyond])}"
        )
    elif asked:
        yield VerdictItem(GOOD, "the commanded motion keeps the limits of speed and acceleration")


def _following(found: Evaluation) -> Iterator[VerdictItem]:
    """Whether the arm followed, by its encoders; lists joints without one."""
    if not found.legs:
        return
    names = found.legs[0].names
    measured = np.any([leg.curves.measured for leg in found.legs], axis=0)
    blind = [name for name, known in zip(names, measured, strict=True) if not known]
    if blind:
        yield VerdictItem(OPEN, without_encoder(blind))
    if not measured.any():
        return
    errors = [np.abs(leg.curves.each[:, 0] - leg.curves.theory[0]) for leg in found.legs]
    most = np.max([np.nan_to_num(error).max(axis=(0, 1)) for error in errors], axis=0)
    largest = np.where(measured, most, np.nan)
    allowed = _following_errors_deg(found.legs[0])
    too_far = [
        f"{joint.name} was up to {off:.2f}{joint.unit.sign} from the plan, {most:g}{joint.unit.sign} are allowed"
        for joint, off, most in zip(found.legs[0].joints, largest, allowed, strict=True)
        if 0.0 < most < off
    ]
    yield from (VerdictItem(BAD, text) for text in too_far)
    if not too_far:
        worst: dict[JointUnit, tuple[str, float]] = {}  # degrees and mm do not compare
        for joint, off in zip(found.legs[0].joints, largest, strict=True):
            if off > worst.get(joint.unit, ("", -1.0))[1]:
                worst[joint.unit] = joint.name, off
        listed = (f"{off:.2f}{unit.sign} from the plan ({name})" for unit, (name, off) in worst.items())
        yield VerdictItem(GOOD, f"the arm followed: at most {' and '.join(listed)}")


def without_encoder(names: Sequence[str]) -> str:
    """Text on joints without an encoder."""
    have = "has" if len(names) == 1 else "have"
    return (
        f"{_listed(names)} {have} no encoder, so whether the arm made the steps is not known; "
        "an encoder would show lost steps, lag and overshoot, and stop a motion that goes wrong"
    )


def _following_errors_deg(found: LegEvaluation) -> list[float]:
    if found.arm is None:
        return [0.0] * len(found.names)
    return [joint.encoder.following_error_deg if joint.encoder else 0.0 for joint in found.arm.driven]


def _limits(found: Evaluation) -> Iterator[VerdictItem]:
    kept = measured = 0
    for leg in found.legs:
        which = "" if found.single else f"motion {leg.number} ({leg.words}), "
        measured += int(leg.curves.measured.sum())
        for name, checks in zip(leg.names, leg.limit_checks, strict=False):
            for quantity, check in zip(("speed", "acceleration"), checks, strict=True):
                text = f"{which}{name}: {quantity} {check.peak:.1f} ± {check.sigma:.1f} of {check.limit:g}"
                if check.verdict == peaks.EXCEEDED:
                    yield VerdictItem(BAD, f"{text}: the limit was exceeded")
                elif check.verdict == peaks.UNDECIDED:
                    yield VerdictItem(OPEN, f"{text}: whether the limit was kept {peaks.UNDECIDED}")
                kept += check.verdict in (peaks.KEPT, peaks.WITHIN)
    if kept and kept == 2 * measured:
        yield VerdictItem(
            GOOD, f"speed and acceleration stayed within {peaks.TOLERANCE:.0%} of their limits, as measured"
        )


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
