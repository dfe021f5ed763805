"""Time-optimal B-spline motions for stepper arms on an STM32F407 with MicroPython.

A motion from the arm file to the report::

    arm = armtempo.Arm.load("my_arm.toml")          # or Arm.paper(), the shipped one
    job = armtempo.Job.load("my_job.toml", arm)     # or Job("mine", via_deg=[[0, -60, 40], …])
    plan = armtempo.plan(arm, job)                  # plan.trajectory(time_s), plan.save(…)
    with armtempo.connect("/dev/ttyACM0") as board: # or "sim", a virtual board
        board.home(arm)                             # says that it is there; nothing moves
        run = board.run(plan, repeat=3)
    run.report()                                    # run.samples: a structured array

The public names are those in ``__all__``. Angles are in degrees, times in seconds, lengths in mm; J is the
number of driven joints. Names are imported at their first use, so ``import armtempo`` loads neither numpy nor
scipy.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in "typing", whose import takes longer than the rest of a stop

if TYPE_CHECKING:
    from typing import Any

    __version__: str

    from armtempo import deploy as deploy, optimise as optimise, simulator as simulator
    from armtempo.basics.errors import (
        ArmtempoError as ArmtempoError,
        BoardError as BoardError,
        InputError as InputError,
        LinkError as LinkError,
        MissingPackageError as MissingPackageError,
        PlanError as PlanError,
        RunFolderError as RunFolderError,
    )
    from armtempo.kinematics.of_arm import (
        forward as forward,
        inverse as inverse,
        inverse_many as inverse_many,
    )
    from armtempo.model.arm import Arm as Arm
    from armtempo.model.frame import ArmFrame as ArmFrame
    from armtempo.model.job import Job as Job, Stop as Stop
    from armtempo.model.outputs import Input as Input, Output as Output
    from armtempo.model.pallet import ArmPallet as ArmPallet
    from armtempo.model.parts import (
        Driver as Driver,
        Dynamics as Dynamics,
        Encoder as Encoder,
        Joint as Joint,
        Limits as Limits,
        LimitSwitches as LimitSwitches,
        Load as Load,
        Motor as Motor,
        Safety as Safety,
    )
    from armtempo.model.plan import Plan as Plan
    from armtempo.model.posture import ArmPosture as ArmPosture
    from armtempo.model.sequence import Sequence as Sequence
    from armtempo.model.steps import (
        Count as Count,
        EachPlace as EachPlace,
        Goto as Goto,
        Hold as Hold,
        Repeat as Repeat,
        RunMotion as RunMotion,
        SetOutput as SetOutput,
        Step as Step,
        ToPlace as ToPlace,
        UseTool as UseTool,
        Wait as Wait,
        WaitInput as WaitInput,
    )
    from armtempo.model.tool import ArmTool as ArmTool
    from armtempo.model.tool_pose import Pose as Pose
    from armtempo.model.tool_segment import ToolSegment as ToolSegment
    from armtempo.pipeline import (
        compare as compare,
        connect as connect,
        plan as plan,
        plan_sequence as plan_sequence,
        summary as summary,
    )
    from armtempo.ports.board_port import find_ports as find_ports
    from armtempo.report.run import Run as Run
    from armtempo.robot.board import Board as Board
    from armtempo.robot.board_state import BoardState as BoardState
    from armtempo.robot.recording import Watcher as Watcher
    from armtempo.robot.shared_board import SharedBoard as SharedBoard, attach as attach
    from armtempo.robot.stop_request import Stopped as Stopped, StopRequest as StopRequest
    from armtempo.splines.bspline import Spline as Spline
    from armtempo.splines.trajectory import Trajectory as Trajectory

_HOMES = {
    "armtempo.basics.errors": (
        "ArmtempoError",
        "BoardError",
        "InputError",
        "LinkError",
        "MissingPackageError",
        "PlanError",
        "RunFolderError",
    ),
    "armtempo.kinematics.of_arm": ("forward", "inverse", "inverse_many"),
    "armtempo.ports.board_port": ("find_ports",),
    "armtempo.model.arm": ("Arm",),
    "armtempo.model.frame": ("ArmFrame",),
    "armtempo.model.job": ("Job", "Stop"),
    "armtempo.model.outputs": ("Input", "Output"),
    "armtempo.model.pallet": ("ArmPallet",),
    "armtempo.model.parts": (
        "Driver",
        "Dynamics",
        "Encoder",
        "Joint",
        "LimitSwitches",
        "Limits",
        "Load",
        "Motor",
        "Safety",
    ),
    "armtempo.model.posture": ("ArmPosture",),
    "armtempo.model.steps": (
        "Count",
        "EachPlace",
        "Goto",
        "Hold",
        "Repeat",
        "RunMotion",
        "SetOutput",
        "Step",
        "ToPlace",
        "UseTool",
        "Wait",
        "WaitInput",
    ),
    "armtempo.model.plan": ("Plan",),
    "armtempo.model.sequence": ("Sequence",),
    "armtempo.model.tool": ("ArmTool",),
    "armtempo.model.tool_pose": ("Pose",),
    "armtempo.model.tool_segment": ("ToolSegment",),
    "armtempo.pipeline": ("compare", "connect", "plan", "plan_sequence", "summary"),
    "armtempo.robot.board": ("Board",),
    "armtempo.robot.board_state": ("BoardState",),
    "armtempo.robot.recording": ("Watcher",),
    "armtempo.report.run": ("Run",),
    "armtempo.robot.shared_board": ("SharedBoard", "attach"),
    "armtempo.robot.stop_request": ("StopRequest", "Stopped"),
    "armtempo.splines.bspline": ("Spline",),
    "armtempo.splines.trajectory": ("Trajectory",),
}
_MODULES = ("deploy", "optimise", "simulator")
"""Public subpackages; their ``__all__`` lists their public names."""
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}
__all__ = sorted([*_HOME_OF, *_MODULES, "__version__"])


def __getattr__(name: str) -> Any:
    """A public name, imported at its first use (PEP 562)."""
    from importlib import import_module

    if name in _MODULES:
        return import_module(f"{__name__}.{name}")
    if name == "__version__":
        value = import_module("armtempo.basics.installation").installed_version()
    elif name in _HOME_OF:
        value = getattr(import_module(_HOME_OF[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
