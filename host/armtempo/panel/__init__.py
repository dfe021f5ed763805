"""The panel: the arm in a browser, to see, move, teach, run and watch it.

::

    operator.py    the panel's board: one command at a time, one client in control, states for all
    live.py        data from the board: state, samples, inputs, sequence
    held_jog.py    a jog that lasts as long as a browser says that its button is held
    access.py      who may ask the server for anything
    arm_scene.py   the arm in 3-D
    panel_page.py  what the tabs of a page share
    layout.py      header with stop, scene, tabs
    move_tab.py, plan_tab.py, run_tab.py, sequence_tab.py, board_tab.py
    desk.py        the job that is planned, and its file
    sequence_desk.py  the sequence that is edited, and its file
    charts.py      curves of all joints
    words.py       every English text
    server.py      all of it served

It has no logic of its own: it calls the library.
"""
