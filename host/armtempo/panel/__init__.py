"""The panel: a page in a browser to see, move, teach, run and watch the arm.

::

    operator.py    the panel's board: one command at a time, one client in control, states for all
    live.py        data from the board: state, samples, inputs, sequence
    held_jog.py    a jog that lasts while a browser reports that its button is held
    access.py      access control of the server
    arm_scene.py   the arm in 3-D
    panel_page.py  common parts of a page's tabs
    layout.py      header with stop, scene, tabs
    move_tab.py, plan_tab.py, run_tab.py, sequence_tab.py, board_tab.py
    desk.py        the job that is planned, and its file
    sequence_desk.py  the sequence that is edited, and its file
    charts.py      curves of all joints
    words.py       all texts
    server.py      the server

It has no logic of its own, but calls the library.
"""
