"""Traps before the functions of the board program: an exception wherever one can come from."""

import sys

import machine_state


class Planned(Exception):
    """What the traps raise."""


class Trap:
    """Stands before a function; raises when armed, but never within an interrupt."""

    def __init__(self, owner, name, path):
        self._owner = owner
        self._name = name
        self.path = path
        self.function = getattr(owner, name)
        self.armed = self.behind = False
        self.calls = 0

    def set(self):
        """Put it there; AttributeError or TypeError if the function is none of the program's."""

        def trapped(*arguments, **named):
            self.calls += 1
            if not self.armed or machine_state.board.serving:
                return self.function(*arguments, **named)
            self.armed = False
            if self.behind:
                self.function(*arguments, **named)
            raise Planned(self.path)

        setattr(self._owner, self._name, trapped)

    def remove(self):
        """The function stands there again."""
        setattr(self._owner, self._name, self.function)
        self.armed = False

    def arm(self):
        """The next call raises."""
        self.armed = True


NEVER = (
    "fail", "freeze", "_trip", "halt", "_stopped",  # what stops the outputs
    "run_once", "run", "_serve_panel",  # what catches exceptions
    "arm_channel", "release_channel", "disable_irq", "enable_irq", "release",  # interrupts are off there
)  # fmt: skip
"""What must not fail: nothing would be left to rely on."""


def everywhere():
    """One for each function of the board program, by name."""
    found, owners = [], []
    for name in sorted(sys.modules):
        if name.startswith("armtempo_board."):
            module = sys.modules[name]
            owners.append(module)
            _add(found, module, name)
            for entry in sorted(dir(module)):
                owner = getattr(module, entry)
                if isinstance(owner, type) and owner not in owners:
                    owners.append(owner)
                    _add(found, owner, name + "." + entry)
    return found


def _add(found, owner, path):
    for name in sorted(dir(owner)):
        function = getattr(owner, name)
        if type(function).__name__ == "function" and name not in NEVER and not name.startswith("__"):
            trap = Trap(owner, name, path + "." + name)
            try:
                trap.set()
                trap.remove()
            except (AttributeError, TypeError):  # of a built-in type that was imported
                continue
            found.append(trap)
