"""An arm for MoveIt: the action FollowJointTrajectory and the topic joint_states, by a rosbridge of ROS 2.

In ROS: ``ros2 launch rosbridge_server rosbridge_websocket_launch.xml``; here ``pip install roslibpy`` and
``python ros_bridge.py --arm arm.toml --port PORT --host HOST``. The arm must be homed. A goal is followed on its own
times (slowed where the arm's limits ask for it), one at a time; cancelling it brakes the arm. MoveIt's controller is
called ``arm_controller`` and has the action ``follow_joint_trajectory``; its joints have the names of the arm file.
"""

import argparse
import json
import queue
import threading
import time

import armtempo
from armtempo.model import exchange, joint_trajectory
from armtempo.planning import recorded

ACTION = "/arm_controller/follow_joint_trajectory"
ACTION_TYPE = "control_msgs/action/FollowJointTrajectory"
STATES, STATES_TYPE = "/joint_states", "sensor_msgs/msg/JointState"
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6  # action_msgs/GoalStatus
INVALID_GOAL, INVALID_JOINTS, SUCCESSFUL = -1, -2, 0  # FollowJointTrajectory.Result
PERIOD_S = 0.1


class Bridge(armtempo.Watcher):
    """Serves one board; ``send`` gets each message of the rosbridge protocol."""

    def __init__(self, board, arm, send):
        self.board, self.arm, self.send = board, arm, send
        self.goals = queue.Queue()
        self.stops = {}  # of the goals that wait or are followed, by their ids
        self.lock = threading.Lock()

    def begin_service(self):
        """Advertise the action and the topic, which rosbridge wants after every connection."""
        self.send({"op": "advertise_action", "action": ACTION, "type": ACTION_TYPE})
        self.send({"op": "advertise", "topic": STATES, "type": STATES_TYPE})

    def on_goal(self, message):
        """A goal; called by the thread of the connection."""
        with self.lock:
            if self.stops:
                self.finish(message["id"], ABORTED, INVALID_GOAL, "another goal is being followed")
                return
            self.stops[message["id"]] = armtempo.StopRequest()
        self.goals.put(message)

    def on_cancel(self, message):
        """The end of a goal is asked for; the arm brakes along its path."""
        with self.lock:
            if message["id"] in self.stops:
                self.stops[message["id"]].ask("ROS")

    def serve(self, once=False):
        """Follow goals, and publish where the arm is between them; ``once``: return after a goal."""
        while True:
            try:
                goal = self.goals.get(timeout=PERIOD_S)
            except queue.Empty:
                self.publish(self.board.posture_deg())
                continue
            self.follow(goal)
            if once:
                return

    def follow(self, goal):
        """Run a goal, and say how it ended."""
        stop = self.stops[goal["id"]]
        try:
            found = joint_trajectory.of_text(json.dumps(goal["args"]), "the goal", self.arm)
            plan = recorded.plan(self.arm, "ros", found.times_s, found.angles_deg, notes=found.notes)
            print(*plan.notes, sep="\n")
            self.board.upload(plan, replace=True)
            stop.check()
            self.board.run(plan, watcher=self, stop=stop)
            self.finish(goal["id"], SUCCEEDED, SUCCESSFUL, "; ".join(plan.notes))
        except armtempo.Stopped as stopped:
            self.finish(goal["id"], CANCELED, SUCCESSFUL, str(stopped))
        except armtempo.InputError as refused:
            self.finish(goal["id"], ABORTED, INVALID_JOINTS, str(refused))
        except armtempo.ArmtempoError as failed:
            self.finish(goal["id"], ABORTED, INVALID_GOAL, str(failed))
        finally:
            with self.lock:
                del self.stops[goal["id"]]

    def finish(self, goal, status, code, text):
        """The result of a goal."""
        values = {"error_code": code, "error_string": text}
        message = {"op": "action_result", "action": ACTION, "id": goal, "values": values}
        self.send({**message, "status": status, "result": status == SUCCEEDED})

    def on_sample(self, sample, duration_s):
        """Publish where the arm is during a motion."""
        self.publish(self.arm.transmission.angles_of_steps(sample.positions.commanded_steps))

    def publish(self, positions):
        """A message of joint_states, of the driven joints' positions in degrees, or mm of sliding joints."""
        now = time.time_ns()
        header = {"stamp": {"sec": now // 10**9, "nanosec": now % 10**9}, "frame_id": ""}
        names = [joint.name for joint in self.arm.driven]
        si = exchange.to_si(positions, [joint.unit for joint in self.arm.driven])
        state = {"header": header, "name": names, "position": si.tolist()}
        self.send({"op": "publish", "topic": STATES, "msg": {**state, "velocity": [], "effort": []}})


def main():
    """Connect to the rosbridge and serve until Ctrl-C."""
    import roslibpy

    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--arm", required=True)
    options.add_argument("--port")
    options.add_argument("--host", default="localhost")
    given = options.parse_args()
    arm = armtempo.Arm.load(given.arm)
    ros = roslibpy.Ros(given.host, 9090)
    with armtempo.connect(given.port, arm) as board:
        board.configure(arm)
        bridge = Bridge(board, arm, lambda message: ros.send_on_ready(roslibpy.Message(message)))

        def connected():
            ros.factory.ready(serve_actions)
            bridge.begin_service()

        def serve_actions(protocol):
            protocol.register_message_handlers("send_action_goal", bridge.on_goal)
            protocol.register_message_handlers("cancel_action_goal", bridge.on_cancel)

        ros.on_ready(connected)
        ros.run()
        bridge.serve()


if __name__ == "__main__":
    main()
