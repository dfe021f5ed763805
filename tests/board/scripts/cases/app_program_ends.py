"""How users' programs end on the program above the engine: by themselves, by a stop, by a fault."""

# all cases: slow on CPython

import sys

import cases
import sequence_rig
from app_rig import state
from armtempo_shared import wire
from program_rig import World


def case_an_exception_brakes_and_is_a_fault_with_its_line():
    def script(world):
        engine = world.board.engine
        if "brake" in engine.calls:
            engine.finish()

    world = World(
        "def pick():\n    cell.start('there')\n    cell.active('part')\n    return 1 // 0\n\npick()\n", script
    )
    ending, code, line = world.run()
    assert (ending, line) == ("fault", 5), (ending, line)
    assert wire.ERRORS[code][0] == "program_failed" and state(world.host) == "fault"
    (text,) = world.said()
    assert text.startswith('  File "pick.py", line 7') and "line 5, in pick" in text, text
    assert "ZeroDivisionError" in text and "cell.py" not in text, text
    assert world.start_stored()[:2] == ("error", "fault_pending")
    assert world.host.ask("clear")[0] == "ok"


def case_a_long_text_of_an_exception_hides_neither_its_name_nor_its_line():
    world = World("\nraise ValueError('x' * 3000)\n")
    assert world.run()[0] == "fault"
    (text,) = world.said()
    assert text.startswith('  File "pick.py", line 3') and "ValueError: xxx" in text, text


def case_of_endless_recursion_the_last_lines_are_told():
    world = World("def f(n):\n    return f(n + 1) + 1\n\nf(0)\n")
    ending, _, line = world.run()
    assert (ending, line) == ("fault", 3), (ending, line)
    (text,) = world.said()
    assert "line 3, in f" in text and "maximum recursion depth" in text, text
    assert len(world.board.failure) < 600, len(world.board.failure)


def case_a_text_just_before_an_exception_does_not_hide_it():
    world = World("cell.sleep(0.2)\nprint('here')\n1 // 0\n")
    assert world.run()[0] == "fault"
    assert world.said()[0] == "here" and "ZeroDivisionError" in world.said()[1], world.said()


def case_a_stop_ends_it_and_nothing_is_done_after():
    asked = []

    def script(world):
        if world.turns == 20:
            asked.append(world.host.ask("start", (0, 0), "there")[:2])
            asked.append(world.host.ask("put_once", (0, 9), b"")[:2])
            assert world.host.ask("stop", (0,))[0] == "ok"
        if world.turns == 30:
            world.board.engine.finish()

    world = World(
        "try:\n"
        "    cell.start('there')\n"
        "    while True:\n"
        "        try:\n"
        "            cell.active('part')\n"
        "        except Exception:\n"
        "            print('swallowed')\n"
        "finally:\n"
        "    cell.set('gripper', 'closed')\n",
        script,
    )
    assert world.run()[0] == "stopped"
    assert asked == [("error", "busy"), ("error", "busy")]
    assert not world.said() and not world.board.outputs.log
    assert world.turns == 30 and "brake" in world.board.engine.calls
    assert state(world.host) == "idle"


def case_a_fault_of_the_board_ends_it():
    def script(world):
        if world.turns == 10:
            world.board.engine.fault = 40
            world.board.engine.finish()

    world = World("cell.run('there')\nprint('after')\n", script)
    ending, code, _ = world.run()
    assert (ending, code) == ("fault", 40) and not world.said()


def case_nothing_of_it_acts_after_its_end():
    world = World(
        "import cases, sys\nsys.modules['helper'] = cases\ncases.kept = cell\n"
        "cases.Ended = sys.modules['armtempo_board.app.cell'].Ended\n"
    )
    assert world.run()[0] == "finished"
    assert "helper" not in sys.modules and cases is sys.modules["cases"]
    assert not [name for name in sys.modules if name.endswith(("cell", "user_program", "rest_to_rest"))]
    assert not hasattr(sys.modules["armtempo_board.app"], "cell")
    for call in (lambda: cases.kept.goto("there"), lambda: cases.kept.set("gripper", "closed")):
        try:
            call()
            raise AssertionError("it acted")
        except cases.Ended:
            pass
    assert world.start_stored()[0] == "ok"  # what it needs is imported again
    world.execute()
    assert not sequence_rig.runs(world.app) and not world.board.outputs.log


def case_wrong_syntax_leaves_nothing():
    import armtempo_board

    ending, _, line = World("pass\nx = = 1\n").run()
    assert (ending, line) == ("fault", 3), (ending, line)
    assert not hasattr(armtempo_board, "cell")


def case_a_full_heap_ends_it():
    world = World("found = []\nwhile __at__(3):\n    found.append(bytearray(1 << 40))\n")
    ending, _, line = world.run()
    assert (ending, line) == ("fault", 4), (ending, line)
    text = world.said()[0]
    assert "MemoryError" in text or "OverflowError" in text, text


def case_a_pass_without_memory_is_the_programs_fault():
    """The program has filled the heap, and what the board's own work lacks is missing; or the stack, by recursion."""
    for error in (MemoryError, RuntimeError):
        _lacks(error)


def _lacks(error):

    def script(world):
        engine = world.board.engine
        if "brake" in engine.calls:
            engine.finish()
        elif world.turns == 10:
            world.app.link.poll = full

    def full():
        del world.app.link.poll
        raise error

    world = World("cell.start('there')\nwhile True:\n    cell.moving()\n", script)
    ending, code, line = world.run()
    assert (ending, wire.ERRORS[code][0], line) == ("fault", "program_failed", 4), (ending, code, line)
    assert "brake" in world.board.engine.calls and "freeze" not in world.board.engine.calls
    assert error.__name__ in world.said()[0]


def case_what_a_lost_host_was_not_told_gives_way_to_the_traceback():
    def script(world):
        world.app.link.has_space = lambda size: False

    world = World("print('one')\nprint('two')\n1 // 0\n", script)
    assert world.start()[0] == "ok"
    world.host.turn = lambda times=1: [world.app.run_once() for _ in range(times)]
    world.execute()
    assert b"ZeroDivisionError" in world.board.failure and world.board.failure_waits


cases.run(globals())
