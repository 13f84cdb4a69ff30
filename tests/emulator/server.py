"""The robot on the network: commands over TCP, states and answers over UDP, orders on a pipe.

One thread does everything, one millisecond of the robot's clock after the other. What a cycle
waits for is its pace:

    lockstep    while a motion runs, the next state leaves only after the answer to the last. The
                machine's noise then changes nothing but the wall clock. At most SPEED times as
                fast as a real robot, for a client's Python has to keep up with its C++.
    wall        a state each millisecond of the wall clock, answered or not, as a real robot does

Between motions a state leaves each millisecond of the wall clock in both.

A client's Python may lead the lockstep: after a datagram to the port :data:`LEAD` that says which
time of the robot it has seen [ms], this motion and all later ones of that client go at most
:data:`AHEAD_MS` beyond what it has seen; 0 lets the motion go.
"""

from __future__ import annotations

import contextlib
import select
import socket
import struct
import time
from typing import Any

import numpy as np
from emulator import model, wire
from emulator.robot import Motion, Robot
from emulator.wire import HEADER, Mode

#: Where a client's Python says how far the robot may go, and how far that is.
LEAD = 1338
AHEAD_MS = 5

#: Between two states when nobody answers them [s].
PERIOD_S = 1e-3

#: Python that does not look for so long does not lead any more [s].
LEAD_PATIENCE_S = 30.0

#: Between states that a client has not begun to answer yet, from the third of a motion on [s].
START_S = 0.02

#: A lockstep is at most this many times as fast as the wall clock, unless ordered otherwise.
SPEED = 2.0

#: A client that lets a lockstep wait this long has gone [s].
PATIENCE_S = 2.0

#: A wall clock that is further behind than this begins anew instead of catching up [s].
LATE_MAX_S = 0.05


class Server:
    """One robot for one client at a time.

    Args:
        robot: What is behind it.
        address: Where it listens, e.g. ``127.0.0.21``; the port is always the same.

    Attributes:
        lockstep: The pace, see the module.
        speed: Of a lockstep, at most.
        patience_s: A client that lets a lockstep wait this long has gone.
        version: What the robot says that it speaks.
        lose: States that are yet to be lost on their way.
        noticed_s: How long the client had been silent when the robot last missed it, wall clock.
        orders: Where orders come from, if anywhere; :mod:`emulator.orders` obeys them.
    """

    def __init__(self, robot: Robot, address: str) -> None:
        self.robot = robot
        self.mend()
        self._listener = socket.create_server((address, wire.PORT), reuse_port=False)
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind((address, 0))
        self._udp.setblocking(False)  # noqa: FBT003 - the standard library's own
        self._lead = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._lead.bind((address, LEAD))
        self._lead.setblocking(False)  # noqa: FBT003 - as above
        self._led_ms: int | None = None
        self._is_led = False
        self._tcp: socket.socket | None = None
        self._client: tuple[str, int] | None = None
        self._inbox, self._sent = b"", True
        self._due = self._heard = time.monotonic()
        self.orders: Orders | None = None

    def mend(self) -> None:
        """Let nothing be wrong with the network, and the pace be lockstep."""
        self.lockstep, self.speed, self.patience_s = True, SPEED, PATIENCE_S
        self.version = self.robot.protocol.version
        self.lose, self.noticed_s = 0, 0.0

    @property
    def connected(self) -> bool:
        """Whether a client is there."""
        return self._tcp is not None

    def serve(self) -> None:
        """Serve for ever."""
        command: Any = None
        while True:
            error = self.robot.tick(command)
            if error is not None:
                self._reply_end(self.robot.reflex(error), "ReflexAborted")
            self._send()
            command = self._await_answer()

    # -- one cycle --------------------------------------------------------------------------------

    def _send(self) -> None:
        self._sent = self.lose == 0
        self.lose -= self.lose > 0
        if self._client is None or not self._sent:
            return
        with contextlib.suppress(OSError):  # nobody there any more: TCP tells
            self._udp.sendto(self.robot.state, self._client)

    def _await_answer(self) -> Any:
        """Wait until the next state is due, and return the answer to the last, if one came."""
        began = time.monotonic()
        self._due = max(self._due + PERIOD_S, began - LATE_MAX_S)
        answer: Any = None
        while True:
            motion, now = self.robot.motion, time.monotonic()
            waits = self._waits(motion)
            if not waits:
                until = began + START_S if self._begins(motion) else self._due
            elif answer is None:
                until = began + self.patience_s
            elif self._leads():
                until = began + LEAD_PATIENCE_S
            else:
                until = self._due = began + PERIOD_S / self.speed
            left = until - now
            if left <= 0.0 and waits:
                self._led_ms = None
                if answer is None:
                    self._miss()
                return answer
            answer = self._listen(max(left, 0.0), answer)
            if left <= 0.0:
                return answer

    def _begins(self, motion: Motion | None) -> bool:
        """Whether the next state would leave unasked for in a lockstep that begins.

        A client takes two states before it answers one, and more if it is quick; one that is sent
        while it is at work would be lost to it.
        """
        if motion is None or motion.answered or not self.lockstep:
            return False
        return self.robot.time_ms >= motion.began_ms + 2

    def _waits(self, motion: Motion | None) -> bool:
        """Whether the next state is to wait for an answer, however long it takes."""
        asked = self.lockstep and motion is not None and motion.answered
        return asked and self._sent and not self.robot.lies.frozen

    def _follow(self) -> None:
        """Take the newest that the client's Python says it has seen."""
        with contextlib.suppress(BlockingIOError):
            while True:
                seen_ms = int(self._lead.recv(32))
                self._is_led |= seen_ms > 0
                self._led_ms = seen_ms + AHEAD_MS if seen_ms > 0 else None

    def _leads(self) -> bool:
        """Whether the client's Python has to come along before the robot goes on."""
        return self._led_ms is not None and self.robot.time_ms >= self._led_ms

    def _listen(self, timeout_s: float, answer: Any) -> Any:
        """Serve whatever comes within a time, and return the newest answer."""
        sources: list[Any] = [self._udp, self._lead, self._listener]
        if self._tcp is not None:
            sources.append(self._tcp)
        if self.orders is not None:
            sources.append(self.orders)
        for source in select.select(sources, (), (), timeout_s)[0]:
            if source is self._udp:
                answer = self._newest(answer)
            elif source is self._lead:
                self._follow()
            elif source is self._listener:
                self._accept()
            elif source is self._tcp:
                self._read()
            elif self.orders is not None:
                self.orders.obey(self)
        return answer

    def _newest(self, answer: Any) -> Any:
        robot = self.robot
        dtype = robot.protocol.command
        while True:
            try:
                data = self._udp.recv(4096)
            except (BlockingIOError, ConnectionRefusedError):
                return answer
            if len(data) != dtype.itemsize or robot.motion is None:
                continue
            command = np.frombuffer(data, dtype)[0]
            self._heard = time.monotonic()
            if self.lockstep and command["message_id"] != robot.time_ms:
                continue  # at the beginning states leave unasked for, and answers overtake
            robot.motion.answered = True
            if _finished(command):
                self._reply_end(robot.end("finished", Mode.IDLE), "Success")
                return None
            answer = command

    def _miss(self) -> None:
        """Notice that the client has gone."""
        self.noticed_s = time.monotonic() - self._heard
        error = wire.COMMUNICATION_CONSTRAINTS_VIOLATION
        self._reply_end(self.robot.reflex(error), "ReflexAborted")

    # -- connections ------------------------------------------------------------------------------

    def _accept(self) -> None:
        connection, _ = self._listener.accept()
        if self._tcp is not None:
            connection.close()  # one client at a time
            return
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._tcp, self._inbox = connection, b""

    def disconnect(self) -> None:
        """Drop the connection; a motion ends as when the client had died."""
        if self._tcp is not None:
            self._tcp.close()
        self._tcp = self._client = self._led_ms = None
        self._is_led = False
        if self.robot.motion is not None:
            self._miss()

    def _read(self) -> None:
        assert self._tcp is not None
        try:
            data = self._tcp.recv(65536)
        except OSError:
            data = b""
        if not data:
            self.disconnect()
            return
        self._inbox += data
        while len(self._inbox) >= HEADER.size:
            number, identity, size = HEADER.unpack_from(self._inbox)
            if len(self._inbox) < size:
                return
            payload, self._inbox = self._inbox[HEADER.size : size], self._inbox[size:]
            self._handle(number, identity, payload)

    def _reply(self, number: int, identity: int, body: bytes) -> None:
        if self._tcp is not None:
            try:
                self._tcp.sendall(HEADER.pack(number, identity, HEADER.size + len(body)) + body)
            except OSError:
                self._tcp = self._client = None

    def _reply_end(self, motion: Motion | None, status: str) -> None:
        """Say how a motion ended: the second answer to its ``Move``."""
        if motion is not None:
            protocol = self.robot.protocol
            body = bytes([protocol.move.index(status)])
            self._reply(protocol.requests.index("Move"), motion.move, body)

    # -- commands ---------------------------------------------------------------------------------

    def _handle(self, number: int, identity: int, payload: bytes) -> None:
        """Obey one command."""
        robot = self.robot
        protocol = robot.protocol
        request = protocol.requests[number] if number < len(protocol.requests) else "?"
        body = b"\0"
        if request == "Connect":
            body = self._connect(payload)
        elif request == "Move":
            controller, generator = struct.unpack_from("<II", payload)
            begun = robot.begin(identity, controller, generator)
            self._led_ms = robot.time_ms + AHEAD_MS if self._is_led else None
            body = bytes([protocol.move.index("MotionStarted" if begun else "NotPossible")])
        elif request == "StopMove":
            self._reply_end(self._stop(), "Preempted")
        elif request == "AutomaticErrorRecovery":
            body = bytes([protocol.recovery.index(robot.recover())])
        elif request == "LoadModelLibrary":
            body = b"\0" + model.library()
        elif request == "GetRobotModel":
            body = b"\0" + model.urdf().encode()
        elif robot.motion is not None:
            body = b"\1"  # no setter while moving
        else:
            robot.set(request, payload)
        self._reply(number, identity, body)

    def _connect(self, payload: bytes) -> bytes:
        version, port = struct.unpack("<HH", payload)
        if version != self.version:
            return struct.pack("<BH", 1, self.version)
        assert self._tcp is not None
        self._client = (self._tcp.getpeername()[0], port)
        return struct.pack("<BH", 0, self.version)

    def _stop(self) -> Motion | None:
        return self.robot.end("stopped", Mode.IDLE) if self.robot.motion is not None else None

    def press(self) -> None:
        """Press the stop button."""
        self._reply_end(self.robot.press(), "EmergencyAborted")

    def startle(self) -> None:
        """Make the robot stop by itself, as after a collision."""
        self._reply_end(self.robot.reflex(wire.CARTESIAN_REFLEX), "ReflexAborted")


def _finished(command: Any) -> bool:
    if command["motion_finished"]:
        return True
    return "torque_finished" in command.dtype.names and bool(command["torque_finished"])


class Orders:
    """Where orders come from: something to wait for, and what to do when it has come."""

    def fileno(self) -> int:
        """Return what to wait for."""
        raise NotImplementedError

    def obey(self, server: Server) -> None:
        """Obey the order that has come."""
        raise NotImplementedError
