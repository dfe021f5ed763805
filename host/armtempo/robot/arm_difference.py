"""The differences between two arm records, in terms of the arm file, and the consequences of replacing one."""

from __future__ import annotations

from armtempo_shared import armrecord

_WORDS = {
    "channel": "motor channel",
    "dir_inverted": "motor direction",
    "encoder": "encoder",
    "encoder_inverted": "encoder direction",
    "counts_num": "encoder counts a step",
    "counts_den": "encoder counts a step",
    "min_steps": "range",
    "max_steps": "range",
    "max_rate": "speed limit",
    "following_counts": "following error",
    "limit_low": "limit switches",
    "limit_high": "limit switches",
    "limit_active_high": "limit switches",
    "flags": "E-stop, enable output or what a lost link does",
    "pulse_ticks": "driver timing",
    "low_ticks": "driver timing",
    "dir_setup_ticks": "driver timing",
    "dir_hold_ticks": "driver timing",
    "link_timeout_ms": "link time-out",
    "identity": "geometry, motors, encoders or switches",
}
_KEEPS = "which keeps the position, as only limits, outputs or inputs differ"
_LOSES = "after which the position is unknown"


def describe(old: bytes, new: bytes) -> str:
    """Describe the differences between the new and the old record."""
    try:
        (old_head, old_joints, _), (new_head, new_joints, _) = armrecord.unpack(old), armrecord.unpack(new)
        wiring = [*zip(armrecord.unpack_outputs(old), armrecord.unpack_outputs(new), strict=True)]
    except armrecord.ArmRecordError:
        return "the board's record is of another version"
    if len(old_joints) != len(new_joints):
        return f"it has {len(new_joints)} driven joints, the board's arm {len(old_joints)}"
    found = [_words(old_head, new_head)]
    for number, rows in enumerate(zip(old_joints, new_joints, strict=True), 1):
        words = _words(*rows)
        found.append(f"joint {number}: {words}" if words else "")
    found += [
        what for what, (before, after) in zip(("outputs", "inputs"), wiring, strict=True) if before != after
    ]
    return "other " + "; ".join(filter(None, found))


def consequence(old: bytes, new: bytes) -> str:
    """Describe the consequences for the position and stored motions if the new record replaces the old one."""
    try:
        (old_head, old_joints, _), (new_head, new_joints, _) = armrecord.unpack(old), armrecord.unpack(new)
    except armrecord.ArmRecordError:
        return _LOSES
    same = armrecord.without_limits(old_head, old_joints) == armrecord.without_limits(new_head, new_joints)
    return _KEEPS if same else _LOSES


def _words(old: dict[str, int], new: dict[str, int]) -> str:
    return ", ".join(dict.fromkeys(_WORDS.get(key, key) for key in old if old[key] != new[key]))
