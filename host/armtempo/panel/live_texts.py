"""What changes on every page during a motion, as texts by the ids of their places; the page's script shows them."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from armtempo.basics.errors import InputError
from armtempo.kinematics.of_arm import forward
from armtempo.model.pose import to_rpy_deg
from armtempo.panel import words
from armtempo.panel.panel_board import PanelBoard

OLD_S = 0.5
"""A state that is older than this is shown with its age."""


def texts(operator: PanelBoard) -> dict[str, str]:
    """The state, where the arm is, what was said last, the angle of each joint."""
    live = operator.live
    said = operator.log.last[-1] if operator.log.last else ""
    found = {
        "armtempo-state": words.plain(state_line(operator)),
        "armtempo-where": position(operator) if live.known else words.UNKNOWN,
        "armtempo-said": words.plain(said),
        "armtempo-unknown": words.OLD_STATE.format(age=live.age_s) if is_old(operator) else words.UNKNOWN,
    }
    for number, (angle, joint) in enumerate(zip(live.angles_deg, operator.arm.driven, strict=True), 1):
        here = angle if live.known else live.known_alone(number - 1)
        found[f"armtempo-angle-{number}"] = "?" if here is None else f"{here:.2f}{joint.unit.sign}"
    return found


def position(operator: PanelBoard) -> str:
    """Where the tool and the joints are."""
    angles = operator.live.angles_deg
    pairs = zip(angles, operator.arm.driven, strict=True)
    where = "  ".join(f"{angle:.2f}{joint.unit.sign}" for angle, joint in pairs)
    with suppress(InputError):
        pose = forward(operator.arm, angles)
        x, y, z = pose[:3, 3].round(1) + 0.0  # no -0.0
        roll, pitch, yaw = np.round(to_rpy_deg(pose), 1) + 0.0
        return f"x {x:.1f}  y {y:.1f}  z {z:.1f} mm  ·  roll {roll:.1f}  pitch {pitch:.1f}  yaw {yaw:.1f}°  ·  {where}"
    return where


def is_old(operator: PanelBoard) -> bool:
    """Whether the arm may have moved since the board was last heard: it was known, and the connection is broken."""
    return bool(operator.trouble) and operator.live.known and operator.live.age_s > OLD_S


def state_line(operator: PanelBoard) -> str:
    """The board's state in a line, with its age if that is more than OLD_S."""
    doing = f" · {operator.busy}" if operator.busy else ""
    if operator.busy and operator.progress:
        doing += f" {operator.progress:.0%}"
    state = operator.live.state
    if state is None:  # its program is being deployed
        return f"{operator.port}{doing}"
    age_s = operator.live.age_s
    old = f" · {words.OLD_STATE.format(age=age_s)}" if age_s > OLD_S else ""
    kind = f" ({words.VIRTUAL})" if state.virtual else ""
    name = state.state
    if state.moving and not state.speed_percent:
        name = state.state if operator.live.held else words.PAUSED
    elif state.moving and state.speed_percent != 100:
        name += f" {words.AT_SPEED.format(percent=state.speed_percent)}"
    fault = f" · {state.fault}" if state.fault else ""
    return f"{name}{doing}{old} · {state.port}{kind}{fault}"
