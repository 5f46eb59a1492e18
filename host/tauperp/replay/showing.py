"""The robot in a bus log, cycle by cycle, for the viewers: pose from the log, guard as replayed."""

import can
import numpy as np

from tauperp.config import TASKS, Configuration
from tauperp.firmware import Verdict
from tauperp.robot_side import SENSOR_OK
from tauperp.run.moment import moment_of
from tauperp.sim.moment import Puppet, Watch
from tauperp.wire import E2EStatus, Receiver


class LogShow:
    """`hear` receives every frame of the log in order; `show` draws every tick of the replayed guard.

    A joint stays at the position of its last good JointState; before the first one it is at zero.
    """

    def __init__(self, configuration: Configuration, watch: Watch) -> None:
        self._watch = watch
        self._receiver = Receiver(configuration.wire)
        self._joints = {configuration.wire.message(f"JointState{i + 1}").id: i for i in range(configuration.robot.n)}
        self._position = np.zeros(configuration.robot.n)
        self._stage = Puppet(configuration.robot)
        self._threshold = {
            number: configuration.threshold_nm(name)
            for name, number in TASKS.items()
            if configuration.settings.task[name].index != "off"
        }
        self._nothing = np.zeros(configuration.robot.n)
        self._torque = np.zeros(configuration.robot.n)
        self._heard = np.zeros(configuration.robot.n, bool)  # good readings since the last tick

    def hear(self, frame: can.Message) -> None:
        joint = self._joints.get(frame.arbitration_id)
        if joint is None:
            return
        received = self._receiver.receive(frame)
        if received is None or received.invalid:
            return
        if received.status is E2EStatus.INITIAL:  # its signals are not decoded, and nothing is wrong with it
            self._heard[joint] = True
        elif received.status.accepted:
            self._position[joint], self._torque[joint] = received.signals["Position"], received.signals["Torque"]
            self._heard[joint] = received.signals["SensorStatus"] == SENSOR_OK

    def show(self, verdict: Verdict, time_s: float) -> None:
        """time_s since the log's beginning."""
        self._stage.pose(self._position, time_s)
        threshold = self._threshold.get(verdict.task, self._nothing)
        self._watch(moment_of(self._stage, verdict, threshold, self._torque.copy(), ~self._heard))
        self._heard[:] = False
