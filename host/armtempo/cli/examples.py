"""Examples at the end of each command's help page; a test takes every one through the command's own parser."""

from __future__ import annotations

EXAMPLES = {
    "new": ("new my_arm", "new my_arm --like ar4 --port /dev/ttyACM0"),
    "plan": (
        "plan",
        "plan --job pick.toml -o pick.json",
        "plan sequence.toml",
        "plan --path free --corridor-mm 5",
    ),
    "ik": ("ik --position 240 180 80", "ik --arm ar4 --position 300 0 300 --rpy 0 90 0 --json"),
    "fk": ("fk 0,-60,40", "fk first.json"),
    "check": ("check", "check --arm my_arm.toml --job first.toml --picture arm.png"),
    "import": ("import points.csv", "import motion.csv --tolerance-deg 0.05 -o back.toml"),
    "export": ("export first.json -o first.csv --rate 250", "export first.json --format ros > first.yaml"),
    "import-urdf": ("import-urdf robot.urdf -o arm.toml --tip tool0",),
    "demo": ("demo", "demo --pick-and-place"),
    "home": ("home", "home 0,-60,40", "home --switches"),
    "goto": ("goto home", "goto 10,-50,30", "goto first.json"),
    "jog": ("jog", "jog --joint 2 --by -5", "jog --axis z --by 10 --speed 50"),
    "teach": ("teach points.toml", "teach --posture above_tray"),
    "run": ("run first.json", "run first.json --repeat 3 --speed 50", "run sequence_name"),
    "speed": ("speed 50",),
    "pause": ("pause",),
    "resume": ("resume",),
    "output": ("output", "output gripper open", "output lamp 0.5"),
    "input": ("input", "input part"),
    "stop": ("stop", "stop --now"),
    "clear": ("clear",),
    "status": ("status", "status --json"),
    "watch": ("watch", "watch --json > samples.jsonl"),
    "fetch": ("fetch", "fetch first.json"),
    "panel": ("panel", "panel --port sim --arm ar4"),
    "report": ("report runs/first-001", "report runs/first-001 runs/first-002 --out both.html"),
    "ports": ("ports",),
    "deploy": ("deploy --port /dev/ttyACM0", "deploy --mpy"),
    "undeploy": ("undeploy",),
    "firmware": ("firmware --board STM32F4DISC --micropython ~/micropython",),
    "flash": ("flash", "flash --image armtempo-firmware-STM32F4DISC.zip --port /dev/ttyACM0"),
    "selftest": ("selftest --port /dev/ttyACM0", "selftest --json > selftest.json"),
    "configure": ("configure --arm my_arm.toml",),
    "upload": ("upload first.json", "upload first.json --name pick --default"),
    "list": ("list",),
    "show": ("show pick",),
    "remove": ("remove pick place",),
    "rename": ("rename pick pick_old",),
    "virtual-board": ("virtual-board", "virtual-board --flash my_board --real-time"),
    "monitor": ("monitor", "monitor traffic.log"),
    "config": ("config",),
    "doctor": ("doctor", "doctor --port /dev/ttyACM0"),
    "paper": ("paper --quick",),
    "help": ("help", "help recovery"),
    "completion": ("completion bash >> ~/.bashrc",),
}


def of(name: str) -> str:
    """The end of a command's help page; "" where there are none."""
    lines = "\n".join(f"  armtempo {line}" for line in EXAMPLES.get(name, ()))
    return f"Examples:\n\n\b\n{lines}" if lines else ""
