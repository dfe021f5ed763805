"""The verdict on a run: OK, or what is wrong or undecided."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armtempo.report import peaks, replayed
from armtempo.report.evaluation import Evaluation
from armtempo.report.run_folder import COMPLETE, transmission

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
    states = [repetition.state for repetition in found.run.repetitions]
    done = states.count(COMPLETE)
    where = ", on a virtual board" if found.run.meta.get("virtual") else ""
    text = f"{done} of {len(states)} repetitions complete{where}"
    yield VerdictItem(GOOD if done == len(states) else BAD, text)


def _samples(found: Evaluation) -> Iterator[VerdictItem]:
    """Missing or damaged samples; interrupted repetitions are only counted."""
    missing = [
        text for text in found.complaints if "cut short" not in text and replayed.SPEED_NOTE not in text
    ]
    yield from (VerdictItem(OPEN, text) for text in missing)
    if not missing:
        yield VerdictItem(GOOD, "no sample is missing")


def _steps(found: Evaluation) -> Iterator[VerdictItem]:
    """Whether every complete repetition ended at the motion's last step."""
    ends = [entry.commanded_steps for entry in found.run.entries if entry.state == COMPLETE]
    ends = [steps for steps in ends if len(steps) == len(found.names)]
    if not ends:
        return
    wrong = np.abs(np.array(ends) - planned_steps(found)[1]).max(axis=0)
    names = [name for name, off in zip(found.names, wrong, strict=True) if off > STEPS_OFF]
    if names:
        text = f"{_listed(names)} ended up to {wrong.max()} steps from where the motion ends"
        yield VerdictItem(BAD, f"{text}: please report it, as the board should make all steps")
    else:
        yield VerdictItem(GOOD, "the board made every step pulse of the motion")


def planned_steps(found: Evaluation) -> NDArray[np.int64]:
    """Steps (2, J) at the motion's start and end."""
    ends = np.stack([found.trajectory(0.0), found.trajectory(found.trajectory.duration_s)])
    return np.asarray(np.rint(transmission(found.run.joints).steps(ends)), dtype=np.int64)


def _commanded(found: Evaluation) -> Iterator[VerdictItem]:
    """Whether the command keeps the limits, of joints without an encoder."""
    blind = zip(found.names, found.extremes, found.limits, found.curves.measured, strict=False)
    asked = [
        (name, np.array(most.values[:2]), np.array(limit.values[:2]))
        for name, most, limit, measured in blind
        if not measured
    ]
    beyond = [name for name, most, limit in asked if np.any(most > limit * (1.0 + ROUNDED))]
    if beyond:
        yield VerdictItem(
            BAD, f"the commanded motion exceeds the speed or acceleration limit of {_listed(beyond)}"
        )
    elif asked:
        yield VerdictItem(GOOD, "the commanded motion keeps the limits of speed and acceleration")


def _following(found: Evaluation) -> Iterator[VerdictItem]:
    """Whether the arm followed, by its encoders; lists joints without one."""
    measured = found.curves.measured
    blind = [name for name, known in zip(found.names, measured, strict=True) if not known]
    if blind:
        yield VerdictItem(OPEN, without_encoder(blind))
    if not measured.any():
        return
    error = np.abs(found.curves.each[:, 0] - found.curves.theory[0])
    largest = np.where(measured, np.nan_to_num(error).max(axis=(0, 1)), np.nan)
    allowed = _following_errors_deg(found)
    too_far = [
        f"{name} was up to {off:.2f}° from the plan, {most:g}° are allowed"
        for name, off, most in zip(found.names, largest, allowed, strict=True)
        if 0.0 < most < off
    ]
    yield from (VerdictItem(BAD, text) for text in too_far)
    if not too_far:
        worst = int(np.nanargmax(largest))
        yield VerdictItem(
            GOOD, f"the arm followed: at most {largest[worst]:.2f}° from the plan ({found.names[worst]})"
        )


def without_encoder(names: Sequence[str]) -> str:
    """Text on joints without an encoder."""
    have = "has" if len(names) == 1 else "have"
    return (
        f"{_listed(names)} {have} no encoder, so whether the arm made the steps is not known; "
        "an encoder would show lost steps, lag and overshoot, and stop a motion that goes wrong"
    )


def _following_errors_deg(found: Evaluation) -> list[float]:
    if found.arm is None:
        return [0.0] * len(found.names)
    return [joint.encoder.following_error_deg if joint.encoder else 0.0 for joint in found.arm.driven]


def _limits(found: Evaluation) -> Iterator[VerdictItem]:
    kept = 0
    for name, checks in zip(found.names, found.limit_checks, strict=False):
        for quantity, check in zip(("speed", "acceleration"), checks, strict=True):
            text = f"{name}: {quantity} {check.peak:.1f} ± {check.sigma:.1f} of {check.limit:g}"
            if check.verdict == peaks.EXCEEDED:
                yield VerdictItem(BAD, f"{text}: the limit was exceeded")
            elif check.verdict == peaks.UNDECIDED:
                yield VerdictItem(OPEN, f"{text}: whether the limit was kept {peaks.UNDECIDED}")
            kept += check.verdict in (peaks.KEPT, peaks.WITHIN)
    if kept and kept == 2 * int(found.curves.measured.sum()):
        yield VerdictItem(
            GOOD, f"speed and acceleration stayed within {peaks.TOLERANCE:.0%} of their limits, as measured"
        )


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
