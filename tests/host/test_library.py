"""``import armtempo``: what is public, what it costs, and that it does what README and docs say."""

from __future__ import annotations

import ast
import inspect
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import armtempo
import numpy as np
import pytest
from armtempo.basics import errors
from armtempo.encoding import encoded_plan
from armtempo.encoding.encoded_plan import Encoded
from armtempo.kinematics import PoseSolver
from armtempo.kinematics.chain import chains_mm
from armtempo.link.board_messages import Sample
from armtempo.model import shipped
from armtempo.model.parts import Driver, LimitSwitches, Safety
from armtempo.robot import arm_state
from armtempo.simulator import LaunchOptions, launch
from numpy.typing import ArrayLike

START_DEG, END_DEG = (0.0, -60.0, 40.0), (20.0, -75.0, 50.0)
"""The paper's home posture, and one that is two seconds away."""
LAZY = ("numpy", "scipy", "matplotlib", "click", "serial", "armtempo.model", "armtempo.link")


@pytest.fixture(scope="module")
def arm() -> armtempo.Arm:
    """The paper's."""
    return armtempo.Arm.paper()


def test_the_button_starts_an_uploaded_sequence_only_where_asked(
    arm: armtempo.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    defaults: list[str] = []
    client: Any = SimpleNamespace(set_default=defaults.append)
    monkeypatch.setattr(arm_state, "configure", lambda *_: None)
    sequence = armtempo.plan_sequence(arm, armtempo.Sequence("pick", (armtempo.Wait(1.0),)))
    encoded = Encoded("pick", arm, (), (), bytes(4))  # the board takes no row without a step
    monkeypatch.setattr(encoded_plan, "of_plan", lambda *_: encoded)
    monkeypatch.setattr("armtempo.robot.store.store", lambda *_: None)
    board = armtempo.Board(client, "pipe")
    board.upload_sequence(sequence)
    assert defaults == []
    board.upload_sequence(sequence, default=True)
    assert defaults == ["pick"]


@pytest.fixture(scope="module")
def plan(arm: armtempo.Arm) -> armtempo.Plan:
    """A plan that needs little search."""
    job = armtempo.Job("small", via_deg=[START_DEG, END_DEG], population=5, iterations=20, path="through")
    return armtempo.plan(arm, job)


def modules_after(code: str) -> set[str]:
    """What a Python of its own has imported after ``code``."""
    found = subprocess.run(
        [sys.executable, "-c", f"import sys\n{code}\nprint('\\n'.join(sys.modules))"],
        capture_output=True,
        text=True,
        check=True,
    )
    return set(found.stdout.split())


def test_the_import_alone_loads_nothing_heavy() -> None:
    assert not modules_after("import armtempo") & set(LAZY)


@pytest.mark.slow
def test_a_plan_is_computed_without_plots_and_ports() -> None:
    code = (
        "import armtempo\n"
        "arm = armtempo.Arm.paper()\n"
        "job = armtempo.Job('x', via_deg=[[0, -60, 40], [1, -60, 40]], population=4, iterations=1, path='through')\n"
        "armtempo.plan(arm, job)"
    )
    assert not modules_after(code) & {"matplotlib", "click", "scipy.interpolate"}


def test_a_goto_to_angles_loads_no_inverse_kinematics_and_no_report() -> None:
    """The names of what it does without, as each costs every move by hand its milliseconds."""
    code = (
        "import armtempo.cli.posture, armtempo.robot.connect\n"
        "from armtempo.model.arm import Arm\n"
        "from armtempo.planning import brake_time, point_to_point\n"
        "arm = Arm.paper()\n"
        "found = point_to_point.straight('x', arm.home_deg, [20.0, -50.0, 30.0], arm)\n"
        "brake_time.of_motion(found, [joint.limits for joint in arm.driven])"
    )
    heavy = {"scipy", "numpy.ma", "armtempo.kinematics.solver", "armtempo.planning.via_points"}
    heavy |= {"armtempo.encoding.encoded_program", "armtempo.model.thinning", "armtempo.model.steps"}
    heavy |= {"armtempo.planning.jog.jog_line", "armtempo.report.run", "armtempo.diagnosis.selftest"}
    assert not modules_after(code) & heavy


def test_every_public_name_is_there_and_described() -> None:
    assert dir(armtempo) == sorted(armtempo.__all__)
    places = {
        alias.asname: str(node.module)
        for node in ast.walk(ast.parse(Path(armtempo.__file__).read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname
    }
    wanted = armtempo._HOME_OF | dict.fromkeys(armtempo._MODULES, "armtempo")
    assert places == wanted, "what type checkers are told is what is imported"
    for name in armtempo.__all__:
        value = getattr(armtempo, name)
        assert name == "__version__" or inspect.getdoc(value), name
        if inspect.isclass(value) and not issubclass(value, BaseException):
            for method, function in inspect.getmembers(value, inspect.isfunction):
                assert method.startswith("_") or inspect.getdoc(function), f"{name}.{method}"


def test_a_name_that_is_not_public_is_no_attribute() -> None:
    with pytest.raises(AttributeError, match="no attribute 'planer'"):
        armtempo.planer  # noqa: B018


def test_public_functions_are_typed() -> None:
    for name in ("plan", "connect", "forward", "inverse", "summary", "compare"):
        signature = inspect.signature(getattr(armtempo, name))
        assert signature.return_annotation is not inspect.Signature.empty
        assert all(one.annotation is not inspect.Parameter.empty for one in signature.parameters.values())


@pytest.mark.slow
def test_the_errors_are_the_tree_that_is_drawn() -> None:
    for found in pkgutil.walk_packages(armtempo.__path__, "armtempo."):
        if "simulator." not in found.name and not found.name.endswith(("__main__", "firmware.manifest")):
            import_module(found.name)

    def drawn(kind: type[BaseException], depth: int) -> list[tuple[int, str]]:
        below = [line for child in kind.__subclasses__() for line in drawn(child, depth + 1)]
        return [(depth, kind.__name__), *below]

    lines = (inspect.getdoc(errors) or "").split("::")[1].split("Every")[0].splitlines()
    tree = [(len(line) - len(line.lstrip(" │├└─")), line.strip(" │├└─").split()[0]) for line in lines if line]
    indents = sorted({indent for indent, _ in tree})
    assert [(indents.index(indent), name) for indent, name in tree] == drawn(errors.ArmtempoError, 0)


def test_a_job_takes_angles_and_refuses_what_is_no_motion(arm: armtempo.Arm) -> None:
    job = armtempo.Job("mine", via_deg=np.array([START_DEG, END_DEG]).tolist())
    assert job.via == (START_DEG, END_DEG)
    for wrong in ([], [START_DEG], [(0.0, -60.0), (1.0, -60.0)]):
        with pytest.raises(armtempo.InputError, match="mine"):
            armtempo.plan(arm, armtempo.Job("mine", via_deg=wrong))


@pytest.mark.slow
def test_a_plan_goes_through_its_via_points_and_its_file(plan: armtempo.Plan, tmp_path: Path) -> None:
    np.testing.assert_allclose(plan.trajectory(0.0), START_DEG, atol=1e-9)
    np.testing.assert_allclose(plan.trajectory(plan.total_s), END_DEG, atol=1e-9)
    np.testing.assert_allclose(plan.trajectory(plan.total_s, 1), 0.0, atol=1e-6)
    plan.save(tmp_path / "small.json")
    again = armtempo.Plan.load(tmp_path / "small.json")
    assert again.total_s == plan.total_s
    assert again.job == plan.job


@pytest.mark.slow
def test_a_plan_goes_to_other_programs_and_comes_back_as_a_job(
    plan: armtempo.Plan, arm: armtempo.Arm, tmp_path: Path
) -> None:
    (tmp_path / "small.csv").write_text(plan.to_csv(1.0))
    job = armtempo.Job.from_csv(tmp_path / "small.csv", arm)
    assert job.name == "small"
    np.testing.assert_allclose(np.array(job.via)[[0, -1]], [START_DEG, END_DEG], atol=1e-6)
    assert plan.to_ros(10.0, "base").startswith("header:")


@pytest.mark.slow
def test_a_run_on_the_virtual_board(plan: armtempo.Plan, arm: armtempo.Arm, tmp_path: Path) -> None:
    told: list[tuple[float, float]] = []
    with armtempo.connect("sim", arm) as board:
        board.home(arm)
        run = board.run(plan, repeat=2, out=tmp_path, progress=lambda *done: told.append(done))
        assert [motion.name for motion in board.list()] == ["small"]
    assert run.complete
    assert told == sorted(told)
    assert told[-1][0] == pytest.approx(2 * plan.total_s, abs=1e-3)
    samples = run.samples
    assert set(samples["repetition"]) == {1, 2}
    assert samples["angle_deg"].shape == (len(samples), 3)
    planned = plan.trajectory(samples["time_s"])
    assert np.max(np.abs(samples["commanded_deg"] - planned)) < 0.03  # half a step of joint 1
    assert all(abs(joint.error_deg) < 0.2 for joint in run.results)
    assert run.report() == run.path / "report.html"
    assert armtempo.Run.load(run.path).plan is not None


@pytest.mark.long
@pytest.mark.slow
def test_a_second_run_of_the_same_board_starts_where_it_should(
    plan: armtempo.Plan, arm: armtempo.Arm, tmp_path: Path
) -> None:
    """The virtual arm goes back by itself; what it is told about its position stays true."""
    with armtempo.connect("sim", arm) as board:
        for _ in range(2):
            run = board.run(plan, out=tmp_path)
            assert all(abs(joint.error_deg) < 0.2 for joint in run.results)


def test_names_and_files_will_do_for_arm_and_job(tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_text(
        'name = "go"\nvia_deg = [[0, -60, 40], [5, -58, 41]]\npath = "through"\niterations = 1\npopulation = 4\n',
        encoding="utf-8",
    )
    plan = armtempo.plan("paper", tmp_path / "job.toml")
    assert repr(plan) == f"<Plan 'go' for 'paper-1to5': 2 via points, {plan.total_s:.3f} s>"
    assert len(repr(plan.trajectory)) < 80
    np.testing.assert_allclose(
        armtempo.forward("ar4", [0.0] * 6), armtempo.forward(armtempo.Arm.load("ar4"), [0.0] * 6)
    )


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (
            {"name": "two words"},
            r"'two words': not a valid name on the board; give at most 24 of the characters",
        ),
        ({"name": "x", "timing": "x"}, r"timing 'x' is not allowed; give 'shared' or 'per-joint'"),
        ({"name": "x", "population": 2}, "population 2 must be a whole number from 4"),
        ({"name": "x", "bounds_s": (2.0, 1.0)}, "bounds_s"),
        ({"name": "x", "via_deg": [[0, "a"]]}, "via_deg is .* give a list, each entry a list"),
    ],
)
def test_a_job_that_no_planner_takes_is_not_even_made(settings: dict[str, Any], said: str) -> None:
    with pytest.raises(armtempo.InputError, match=said):
        armtempo.Job(**settings)


def test_angles_that_are_a_name_are_refused_in_words(arm: armtempo.Arm) -> None:
    with pytest.raises(armtempo.InputError, match="forward: angles_deg is 'home'; give finite numbers"):
        armtempo.forward(arm, "home")


@pytest.mark.slow
def test_an_arm_and_a_sequence_are_made_in_code() -> None:
    limits = armtempo.Limits(speed_deg_s=50, acceleration_deg_s2=100, jerk_deg_s3=500)
    motor = armtempo.Motor(channel=1, steps_per_rev=200, microsteps=16, gear_ratio=10)
    joint = armtempo.Joint("table", 100, 150, 0, 0, (-90, 90), limits=limits, motor=motor)
    gripper = armtempo.Output("gripper", "switch", "PE9", 0.0, states=(("closed", 1.0),))
    arm = armtempo.Arm("mine", (joint,), outputs=(gripper,))
    swing = armtempo.Job("swing", via_deg=[[45], [0]], iterations=1, population=4, path="through")
    steps = (armtempo.Goto((45.0,)), armtempo.SetOutput("gripper", "closed"), armtempo.RunMotion(swing))
    sequence = armtempo.Sequence("pick", (armtempo.Repeat(steps, times=2), armtempo.Wait(0.5)))
    planned = armtempo.plan_sequence(arm, sequence)
    assert planned.start_deg == pytest.approx((45.0,))
    assert [row.words for row in planned.rows if row.words.startswith("output")] == 2 * [
        "output gripper closed"
    ]
    record = encoded_plan.of_plan(planned)  # the board takes no row without a step
    assert record.rows[-1].step == 6
    assert [step.step for step in sequence.steps] == [1, 6]
    with pytest.raises(armtempo.InputError, match="no output 'griper'"):
        armtempo.plan_sequence(arm, armtempo.Sequence("pick", (armtempo.SetOutput("griper", 1),)))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: armtempo.Motor(1, steps_per_rev=200, microsteps=0, gear_ratio=10), "microsteps is 0; give 1 to 256"),
        (lambda: Driver(dir_setup_us=2000.0), "dir_setup_us is 2000; give 0.1 to 500"),
        (lambda: Driver(pulse_us=float("nan")), "pulse_us is nan"),
        (lambda: Driver(enable_active="up"), "enable_active"),
        (lambda: Safety(on_link_loss="brake"), "on_link_loss"),
        (lambda: Safety(link_timeout_ms=5), "link_timeout_ms is 5"),
        (lambda: LimitSwitches(low=4), "low is 4; give an input from 1 to 3, or a pin"),
        (lambda: LimitSwitches(high=1, high_deg=float("inf")), "high_deg is inf"),
        (lambda: LimitSwitches(low=1, active="on"), "active is 'on'; give low or high"),
    ],
)  # fmt: skip
def test_parts_made_in_code_have_values_that_the_arm_file_allows(
    make: Callable[[], object], said: str
) -> None:
    with pytest.raises(armtempo.InputError, match=said):
        make()


@pytest.mark.long
@pytest.mark.slow
def test_goto_takes_a_speed_and_a_closed_board_says_so(arm: armtempo.Arm, tmp_path: Path) -> None:
    with armtempo.connect("sim", arm) as board:
        board.home(arm)
        times: list[float] = []
        for speed, where in ((1.0, END_DEG), (0.05, START_DEG)):
            board.goto(where, lambda _done, whole: times.append(whole), speed=speed)
        limits = [0.05 * joint.limits.speed_deg_s for joint in arm.driven]
        moves = zip(START_DEG, END_DEG, limits, strict=True)
        slow_s = max(abs(end - start) / limit for start, end, limit in moves)
        assert slow_s < times[-1] < 1.5 * slow_s
        assert times[0] < 0.5 * times[-1]
        with pytest.raises(armtempo.InputError, match=r"speed of 50 times the planned one, 5000 %.*fraction"):
            board.speed(50)
        with pytest.raises(armtempo.InputError, match=r"missing\.json"):
            board.run("missing.json")
        with pytest.raises(armtempo.InputError, match=r"'x\.jsn' is not a valid name of a motion"):
            board.run("x.jsn")
    with pytest.raises(armtempo.LinkError, match="the board on sim was closed; open it again"):
        board.status()


@pytest.mark.slow
def test_a_real_arm_does_not_move_by_surprise(plan: armtempo.Plan, arm: armtempo.Arm, tmp_path: Path) -> None:
    with launch(LaunchOptions(arm=arm)) as process, armtempo.connect(process.port) as board:
        with pytest.raises(armtempo.InputError, match="no arm is set"):
            board.goto(START_DEG)
        with pytest.raises(armtempo.LinkError, match="position of joint 1"):
            board.run(plan, out=tmp_path)
        board.home(arm, END_DEG)
        with pytest.raises(armtempo.LinkError, match="is not at the start of 'small'"):
            board.run(plan, out=tmp_path)
        assert board.last_run is None
        assert not list(tmp_path.iterdir())
        np.testing.assert_allclose(board.posture_deg(), END_DEG, atol=0.03)
        assert board.status().run == 0  # nothing was ever started


@pytest.mark.long
@pytest.mark.slow
def test_the_arm_goes_where_a_motion_begins(plan: armtempo.Plan, arm: armtempo.Arm, tmp_path: Path) -> None:
    with launch(LaunchOptions(arm=arm)) as process, armtempo.connect(process.port) as board:
        board.home(arm)
        board.goto(END_DEG)
        board.goto(plan)
        assert board.run(plan, out=tmp_path).complete


@pytest.mark.slow
def test_a_stop_that_is_asked_for_ends_a_run_early(
    plan: armtempo.Plan, arm: armtempo.Arm, tmp_path: Path
) -> None:
    stop = armtempo.StopRequest()

    class Impatient(armtempo.Watcher):
        def on_sample(self, sample: Sample, duration_s: float) -> None:
            stop.wanted = True

    with armtempo.connect("sim", arm) as board:
        with pytest.raises(armtempo.Stopped):
            board.run(plan, 2, tmp_path, watcher=Impatient(), stop=stop)
        assert not board.status().moving
        assert board.last_run is not None
    assert [entry.state for entry in board.last_run.entries] == ["interrupted"]


@pytest.mark.slow
def test_a_stored_motion_runs_by_its_name(plan: armtempo.Plan, arm: armtempo.Arm, tmp_path: Path) -> None:
    with armtempo.connect("sim", arm) as board:
        board.upload(plan, "kept", default=True)
        run = board.run("kept", out=tmp_path)
        assert run.plan is None
        np.testing.assert_allclose(run.trajectory(1.0), plan.trajectory(1.0), atol=1e-6)
        assert all(abs(joint.error_deg) < 0.2 for joint in run.results)
        board.rename("kept", "other")
        assert [(motion.name, motion.default) for motion in board.list()] == [("other", True)]
        board.remove("other")
        assert board.list() == ()


@pytest.mark.parametrize("angles", [(0.0, -60.0, 40.0), (0.0, -60.0, 40.0, 10.0, 20.0, 30.0)])
def test_inverse_finds_what_forward_says(angles: ArrayLike, arm: armtempo.Arm) -> None:
    pose = armtempo.forward(arm, angles)
    assert pose.shape == (4, 4)
    solutions = armtempo.inverse(arm, pose)
    assert len(solutions) == 8
    usable = [one.usable for one in solutions]
    assert usable == sorted(usable, reverse=True)
    for one in solutions[: sum(usable)]:
        np.testing.assert_allclose(armtempo.forward(arm, one.angles_deg), pose, atol=1e-6)
    assert all(one.rejections for one in solutions[sum(usable) :])


@pytest.mark.parametrize("name", shipped.files())
def test_every_shipped_arm_gets_back_the_posture_that_made_a_pose(name: str) -> None:
    arm = armtempo.Arm.load(name)
    rng = np.random.default_rng(41)
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    for _ in range(3):
        angles = rng.uniform(0.9 * low + 0.1 * high, 0.1 * low + 0.9 * high)
        pose = armtempo.forward(arm, angles)
        first, *_ = armtempo.inverse(arm, pose, near_deg=angles)
        assert first.usable, f"{name}, seed 41: {first.rejections}"
        np.testing.assert_allclose(armtempo.forward(arm, first.angles_deg), pose, atol=1e-4)
        assert (first.branch == "") == bool(PoseSolver(arm).refusals)


@pytest.mark.slow
def test_inverse_serves_poses_that_ask_for_less() -> None:
    arm = armtempo.Arm.load("moveo")
    home = armtempo.forward(arm, arm.home_deg)
    wanted = armtempo.Pose.of_angles(home[:3, 3] + (5.0, 5.0, -5.0), {})
    (solution,) = armtempo.inverse(arm, wanted)
    assert (solution.usable, solution.branch) == (True, "")
    assert solution.miss_mm < wanted.tolerance_mm
    assert (
        np.linalg.norm(armtempo.forward(arm, solution.angles_deg)[:3, 3] - (home[:3, 3] + (5, 5, -5))) < 0.1
    )
    assert armtempo.inverse(arm, armtempo.Pose.of_angles((5000.0, 0.0, 0.0), {})) == ()


def test_a_pose_just_out_of_reach_is_taken_within_its_tolerance(arm: armtempo.Arm) -> None:
    """0.02 mm beyond the stretched elbow the closed form has nothing; 0.1 mm are allowed."""
    elbows = np.linspace(*arm.joints[2].range_deg, 20_001)
    angles = np.column_stack([np.full_like(elbows, fixed) for fixed in (20.0, -40.0)] + [elbows])
    links = chains_mm(arm, angles)
    reach = np.linalg.norm(links[:, 4] - links[:, 1], axis=1)  # wrist centre from the shoulder
    _, shoulder, _, _, wrist, *_ = links[np.argmax(reach)]
    pose = armtempo.forward(arm, [*angles[np.argmax(reach)], 0.0, 0.0, 0.0])
    assert armtempo.inverse(arm, pose)[0].branch
    pose[:3, 3] += 0.02 * (wrist - shoulder) / reach.max()
    first, *_ = armtempo.inverse(arm, pose)
    assert (first.usable, first.branch) == (True, "")
    assert 0.0 < first.miss_mm < 0.1
    pose[:3, 3] += 2.0 * (wrist - shoulder) / reach.max()
    refused = armtempo.inverse(arm, pose)
    assert len(refused) == 8
    assert not any(one.usable for one in refused)
    assert any("out of reach by 2.02 mm" in one.rejections[0] for one in refused)


def test_poses_and_postures_of_the_wrong_shape_are_refused(arm: armtempo.Arm) -> None:
    with pytest.raises(armtempo.InputError, match="4 angles"):
        armtempo.forward(arm, [0.0] * 4)
    with pytest.raises(armtempo.InputError, match="near_deg"):
        armtempo.inverse(arm, np.eye(4), [0.0])
    with pytest.raises(armtempo.InputError, match="near_deg"):
        armtempo.inverse(arm, np.eye(4), [[0.0] * 6])
    with pytest.raises(armtempo.InputError, match="pose"):
        armtempo.inverse(arm, np.zeros((4, 4)))


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("points", [[0.0, 1.0, 4.0, 2.0], [[0.0, 1.0], [1.0, 2.0], [4.0, 3.0]]])
def test_a_spline_goes_through_its_points_and_rests_at_the_ends(points: ArrayLike, degree: int) -> None:
    spline = armtempo.Spline.through(points, degree)
    values = np.asarray(points)
    np.testing.assert_allclose(spline(np.arange(len(values))), values, atol=1e-9)
    for end in (0, spline.segments):
        np.testing.assert_allclose(spline(end, 1), 0.0, atol=1e-9)
    u, step = np.linspace(0.01, spline.segments - 0.01, 50), 1e-6
    slope = (spline(u + step) - spline(u - step)) / (2 * step)
    np.testing.assert_allclose(spline(u, 1), slope, atol=1e-5)
    with pytest.raises(armtempo.InputError, match="defined for u"):
        spline(spline.segments + 0.1)


def test_minimise_finds_the_bottom_of_a_bowl() -> None:
    rng = np.random.default_rng(4)
    found = armtempo.optimise.minimise(lambda x: ((x - 0.5) ** 2).sum(1), [(-2, 2)] * 2, rng)
    np.testing.assert_allclose(found.x, 0.5, atol=1e-3)
