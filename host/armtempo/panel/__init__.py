"""The panel: a page in a browser to see, move, teach, run and watch the arm.

::

    panel_board.py the panel's board: one command at a time, one client in control, states for all
    live.py        data from the board: state, samples, inputs, outputs, sequence
    press.py       which presses are still meant: number, age, state
    hold.py        a motion that lasts while a browser reports that its button is held
    access.py      access control of the server
    arm_scene.py   the arm in 3-D
    panel_page.py  common parts of a page's tabs
    layout.py      header with stop, banner, scene, tabs, and what is always in view
    problem.py     what is wrong, and the button that helps
    move_tab.py, job_tab.py, run_tab.py, sequence_tab.py, board_tab.py
    job_plan.py    the part of the job's tab that makes and plays the plan
    floor.py, homing.py, teaching.py  dialogs of the tab where the arm is moved
    targets.py, teach_points.py, names.py  its parts: postures and typed targets; frames and tools that are taught;
                   what is renamed and removed
    job_editor.py  the job that is edited and planned, and its file
    sequence_editor.py  the sequence that is edited, and its file
    fields.py      fields of these that show the file without losing what is being typed
    file_editor.py, file_row.py  what both have: text, undo, file; and its row on the page
    toml_blocks.py  the tables of a file as blocks of lines with their comments
    past_runs.py   the recorded runs
    charts.py      curves of all joints
    words.py       all texts
    server.py      the server

It has no logic of its own, but calls the library.
"""
