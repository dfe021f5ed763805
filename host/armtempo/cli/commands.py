"""The commands: module and function, one line of help, and examples of each.

The help page and completion use these lines, so they import no command's module. A test parses each example
with the command's own parser, and compares the line with the function's docstring.
"""

from __future__ import annotations

import click


class Entry:
    """A command's place, ``module:function``, and the help that is shown without importing it."""

    def __init__(self, where: str, summary: str, *examples: str) -> None:
        self.module, self.function = where.split(":")
        self.summary = summary
        self.examples = examples

    def short_help(self, width: int = 45) -> str:
        """The line, cut by click to ``width`` characters."""
        return click.Command(None, help=self.summary).get_short_help_str(width)

    @property
    def epilog(self) -> str:
        """The examples at the end of its help page."""
        lines = "\n".join(f"  armtempo {line}" for line in self.examples)
        return f"Examples:\n\n\b\n{lines}"


GROUPS: dict[str, dict[str, Entry]] = {
    "Plan": {
        "new": Entry(
            "new:new",
            "Make a project folder: arm file, first job and settings.",
            "new my_arm",
            "new my_arm --like ar4 --port /dev/ttyACM0",
        ),
        "plan": Entry(
            "plan:plan",
            "Plan a job or a sequence, and write its trajectory file.",
            "plan",
            "plan --job pick.toml -o pick.json",
            "plan sequence.toml",
            "plan --path free --corridor-mm 5",
        ),
        "ik": Entry(
            "kinematics:ik",
            "Print all solutions of the inverse kinematics for a pose.",
            "ik --position 240 180 80",
            "ik --arm ar4 --position 300 0 300 --rpy 0 90 0 --json",
        ),
        "fk": Entry(
            "kinematics:fk",
            "Print the tool's pose and every frame for joint angles.",
            "fk 0,-60,40",
            "fk first.json",
        ),
        "check": Entry(
            "check:check",
            "Check an arm file and a job for likely mistakes.",
            "check",
            "check --arm my_arm.toml --job first.toml --picture arm.png",
        ),
        "import": Entry(
            "exchange:import_table",
            "Make a job file from a table or a ROS JointTrajectory.",
            "import points.csv",
            "import motion.csv --tolerance-deg 0.05 -o back.toml",
        ),
        "export": Entry(
            "exchange:export",
            "Write a motion as CSV or as a ROS JointTrajectory.",
            "export first.json -o first.csv --rate 250",
            "export first.json --format ros > first.yaml",
        ),
        "import-urdf": Entry(
            "exchange:import_urdf",
            "Make an arm file from a URDF.",
            "import-urdf robot.urdf -o arm.toml --tip tool0",
        ),
    },
    "Run": {
        "demo": Entry(
            "demo:demo",
            "Plan, replay and report the paper's feeding motion.",
            "demo",
            "demo --pick-and-place",
        ),
        "home": Entry(
            "posture:home", "Declare the arm's position.", "home", "home 0,-60,40", "home --switches"
        ),
        "goto": Entry(
            "posture:goto",
            "Move straight to a posture, or the tool to a pose.",
            "goto home",
            "goto 10,-50,30",
            "goto --frame tray --position 0 0 50",
            "goto first.json",
        ),
        "jog": Entry(
            "jog:jog",
            "Move a joint or the tool by a step, or while a key is held.",
            "jog",
            "jog --joint 2 --by -5",
            "jog --axis z --by 10 --speed 50",
            "jog --frame tray --axis x --by 5",
        ),
        "teach": Entry(
            "teach:teach",
            "Teach: store the arm's present position.",
            "teach points.toml",
            "teach --posture above_tray",
            "teach frame tray",
            "teach tool gripper",
        ),
        "run": Entry(
            "run:run",
            "Run a motion, a sequence or a program, and record it.",
            "run first.json",
            "run first.json --repeat 3 --speed 50",
            "run sequence_name",
        ),
        "program": Entry(
            "programs:program",
            "Check a program in MicroPython, store it and run it.",
            "program pick.py",
            "program pick.py --check",
        ),
        "speed": Entry("speed:speed", "Change the speed of the running motion, in percent.", "speed 50"),
        "pause": Entry(
            "speed:pause",
            "Bring the running motion to rest on its path.",
            "pause",
        ),
        "resume": Entry("speed:resume", "Continue a paused motion at the speed before the pause.", "resume"),
        "output": Entry(
            "wired:output",
            "Set an output of the arm, or list them.",
            "output",
            "output gripper open",
            "output lamp 0.5",
        ),
        "input": Entry("wired:read_inputs", "Read the inputs of the arm.", "input", "input part"),
        "stop": Entry("stop:stop", "Brake or freeze, and print the arm's position.", "stop", "stop --now"),
        "clear": Entry("stop:clear", "Clear the pending fault; its cause must be gone.", "clear"),
        "status": Entry(
            "state:status",
            "Show the board, its state and the joints' positions.",
            "status",
            "status --json",
        ),
        "watch": Entry(
            "watch:watch",
            "Show what another armtempo program does with the port.",
            "watch",
            "watch --json > samples.jsonl",
        ),
        "fetch": Entry(
            "run:fetch",
            "Fetch the samples of the last run from the board.",
            "fetch",
            "fetch first.json",
        ),
        "report": Entry(
            "report:report",
            "Write report.html and its figures into a run folder.",
            "report runs/first-001",
            "report runs/first-001 runs/first-002 --out both.html",
        ),
        "panel": Entry(
            "panel:panel",
            "Open the panel in a browser: move, teach, plan and run.",
            "panel",
            "panel --port sim --arm ar4",
        ),
    },
    "Board": {
        "ports": Entry("config:ports", "List the serial ports, likely boards first.", "ports"),
        "deploy": Entry(
            "deploy:deploy",
            "Install or update the board program on a board.",
            "deploy --port /dev/ttyACM0",
            "deploy --arm ar4",
        ),
        "undeploy": Entry("deploy:undeploy", "Remove the board program from a board.", "undeploy"),
        "firmware": Entry(
            "firmware:firmware",
            "Build a MicroPython firmware with the board program in it.",
            "firmware --board STM32F4DISC --micropython ~/micropython",
        ),
        "flash": Entry(
            "firmware:flash",
            "Flash MicroPython with the board program built in.",
            "flash",
            "flash --image armtempo-firmware-STM32F4DISC.zip --port /dev/ttyACM0",
        ),
        "selftest": Entry(
            "selftest:selftest",
            "Let the board measure itself: clocks, flash, pulses.",
            "selftest --port /dev/ttyACM0",
            "selftest --out first-power-on",
            "selftest --with-motors --arm my_arm.toml",
        ),
        "configure": Entry(
            "deploy:configure",
            "Set the board up for an arm.",
            "configure --arm my_arm.toml",
        ),
        "upload": Entry(
            "stored:upload",
            "Store a motion, a sequence or a program on the board.",
            "upload first.json",
            "upload first.json --name pick --default",
            "upload pick_place.py --arm my_arm.toml --default",
        ),
        "list": Entry(
            "stored:list_motions",
            "List what is stored on the board, and what is old.",
            "list",
        ),
        "show": Entry("stored:show", "Show a stored motion, read back.", "show pick"),
        "remove": Entry("stored:remove", "Remove stored motions from the board.", "remove pick place"),
        "rename": Entry("stored:rename", "Give a stored motion another name.", "rename pick pick_old"),
        "virtual-board": Entry(
            "virtual_board:virtual_board",
            "Start a virtual board, and run it until Ctrl-C.",
            "virtual-board",
            "virtual-board --flash my_board --real-time",
        ),
        "monitor": Entry("watch:monitor", "Show decoded traffic.", "monitor", "monitor traffic.log"),
        "config": Entry(
            "config:config",
            "Show the arm, port, job and run folder of this folder.",
            "config",
        ),
        "doctor": Entry(
            "doctor:doctor",
            "Check the installation, the project and the board.",
            "doctor",
            "doctor --port /dev/ttyACM0",
        ),
        "help": Entry(
            "help:show_page", "Show a page of the documentation, or list them.", "help", "help recovery"
        ),
    },
    "Develop": {
        "paper": Entry(
            "paper:paper",
            "Repeat the paper: every number next to the printed one.",
            "paper --quick",
        ),
    },
}
"""In the order of the help page."""
COMMANDS = {name: entry for entries in GROUPS.values() for name, entry in entries.items()}
