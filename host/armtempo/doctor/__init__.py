"""What a fault report needs to know: this machine, its packages, ports, project, arm, and the board."""

from armtempo.doctor.item import Condition, Item
from armtempo.doctor.machine import examine_machine, packages
from armtempo.doctor.robot import examine_arm, examine_board, ports

__all__ = ["Condition", "Item", "examine_arm", "examine_board", "examine_machine", "packages", "ports"]
