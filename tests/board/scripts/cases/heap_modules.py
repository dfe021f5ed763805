"""Which modules stay in the heap."""

import sys

import cases
from armtempo_board import heap

NAME = "armtempo_shared.basis"


def load():
    __import__(NAME)


def case_modules_that_come_and_go_are_given_up():
    load()
    heap.forget()
    assert NAME not in sys.modules


def case_modules_of_a_name_are_given_up():
    load()
    heap.forget("table")
    assert NAME in sys.modules
    heap.forget("basis")
    assert NAME not in sys.modules


def case_code_that_is_kept_stays_until_it_is_not():
    load()
    heap.keep_code(True)
    heap.forget()
    heap.tidy()
    assert NAME in sys.modules
    heap.keep_code(False)
    heap.tidy()
    assert NAME not in sys.modules


def case_the_heap_is_collected_seldom_while_code_is_kept_and_not_while_a_motion_runs():
    import gc

    if not hasattr(gc, "mem_free"):
        return
    before = gc.threshold()
    try:
        heap.collect_often()
        often = gc.threshold()
        heap.keep_code(True)
        assert gc.threshold() > 3 * often > 0
        heap.collect_often(0)
        assert gc.threshold() == -1
        heap.keep_code(False)
        assert gc.threshold() < 2 * often
    finally:
        gc.threshold(before)


cases.run(globals())
