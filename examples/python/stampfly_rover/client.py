"""A client of the simulated rover: sends the operator's commands at a rate, receives the log."""

from __future__ import annotations

import socket
import time
from types import TracebackType
from typing import Callable, Iterator, Optional, Tuple, Type

from .datagram import Datagram, DatagramError
from .messages import (
    PARAMETERS,
    LogRecord,
    Message,
    OperatorCommand,
    ParameterAction,
    ParameterRequest,
    ParameterStatus,
    Subscription,
)

Address = Tuple[str, int]

#: Where the simulated rover listens unless told otherwise.
DEFAULT_ADDRESS: Address = ("127.0.0.1", 47003)

#: Seconds between repetitions of the subscription, which lapses after two.
RENEWAL = 0.5

#: Seconds after which a silent rover has gone: as long as a subscription lasts.
PATIENCE = 2.0

#: What a socket reports when an earlier datagram has found no rover: Linux and macOS the first,
#: Windows the second.
UNREACHABLE = (ConnectionRefusedError, ConnectionResetError)

#: Seconds to wait for a change of parameters. A rover at a tenth of real time tells of them once a second.
ANSWER = 5.0


class RoverClient:
    """One end of the conversation with a rover.

    Use it as a context manager. It has no thread: time passes in :meth:`receive` and :meth:`drive`. Damaged and old
    datagrams are counted in :attr:`refused` and not returned; those from other senders are never received.

    >>> with RoverClient() as rover:                          # doctest: +SKIP
    ...     for record in rover.drive(lambda t: OperatorCommand(throttle=0.5), seconds=2.0):
    ...         print(record.t, record.v)
    """

    def __init__(self, address: Address = DEFAULT_ADDRESS, *, rate: float = 50.0, use_json: bool = False) -> None:
        if not rate > 0.0:
            raise ValueError("the rate must be positive")
        self.period = 1.0 / rate
        self.use_json = use_json
        #: Datagrams received and not used.
        self.refused = 0
        #: The newest status of the parameters.
        self.parameters: Optional[ParameterStatus] = None
        self._sequence = 0
        self._newest: Optional[int] = None
        self._heard = 0.0
        self._started = time.monotonic()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        # A connected socket receives from this address only.
        self._socket.connect(address)

    def __enter__(self) -> RoverClient:
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    def close(self) -> None:
        """Gives the socket back."""
        self._socket.close()

    def send(self, message: Message) -> None:
        """Sends one message. Raises :class:`DatagramError` when it is not valid."""
        micros = int((time.monotonic() - self._started) * 1e6)
        datagram = Datagram(self._sequence, micros, message)
        data = datagram.to_json().encode() + b"\n" if self.use_json else datagram.to_bytes()
        self._sequence = (self._sequence + 1) % (1 << 32)
        try:
            self._socket.send(data)
        except UNREACHABLE:
            # Reports an earlier datagram: there is no rover at this address yet. The next one may arrive.
            pass

    def receive(self, timeout: float) -> Optional[Message]:
        """The next valid message, or ``None`` after ``timeout`` seconds."""
        deadline = time.monotonic() + timeout
        while True:
            remaining = deadline - time.monotonic()
            if remaining <= 0.0:
                return None
            self._socket.settimeout(remaining)
            try:
                datagram = Datagram.read(self._socket.recv(2048))
            except (socket.timeout, TimeoutError):
                return None
            except UNREACHABLE:
                time.sleep(min(remaining, 0.01))
                continue
            except DatagramError:
                self.refused += 1
                continue
            if not self._is_news(datagram.sequence):
                self.refused += 1
                continue
            if isinstance(datagram.message, ParameterStatus):
                self.parameters = datagram.message
            return datagram.message

    def _is_news(self, sequence: int) -> bool:
        """Refuses repetitions and what was overtaken; a rover that was silent for a second may have restarted."""
        now = time.monotonic()
        ahead = (sequence - (self._newest or 0)) % (1 << 32)
        news = self._newest is None or 0 < ahead < 1 << 31 or now - self._heard > 1.0
        if news:
            self._newest, self._heard = sequence, now
        return news

    def drive(
        self,
        command: Callable[[float], Optional[OperatorCommand]],
        seconds: float,
        every: int = 1,
        patience: float = PATIENCE,
    ) -> Iterator[LogRecord]:
        """Sends ``command(t)`` at the rate for ``seconds`` and yields the log, every n-th line.

        ``t`` and ``seconds`` are the rover's time since its first record here, so a script follows the vehicle's clock,
        however fast it goes; ``t`` is 0 until there is a record. ``None`` sends nothing. A rover that is silent for
        ``patience`` seconds of this computer ends the loop as well.
        """
        heard = renew = send = time.monotonic()
        first: Optional[float] = None
        t = 0.0
        while t < seconds:
            now = time.monotonic()
            if now - heard >= patience:
                return
            if now >= renew:
                self.send(Subscription(every))
                renew = now + RENEWAL
            if now >= send:
                asked = command(t)
                if asked is not None:
                    self.send(asked)
                # From the plan, not from now, so the rate is kept; but a program that was stopped does not catch up.
                send = max(send + self.period, now)
            wake = min(send, renew, heard + patience)
            message = self.receive(max(wake - time.monotonic(), 1e-4))
            if isinstance(message, LogRecord):
                heard = time.monotonic()
                first = message.t if first is None else first
                t = message.t - first
                yield message

    def change_parameters(self, timeout: float = ANSWER, **values: float) -> ParameterStatus:
        """Changes parameters together and waits until the rover uses them.

        Names are written with two underscores for the dot: ``change_parameters(engine__max_accel=1.0)``. Raises
        :class:`ParameterRefused` when the rover refuses a value, :class:`TimeoutError` when it does not answer.
        """
        requests = [
            ParameterRequest(ParameterAction.Set, PARAMETERS.index(name.replace("__", ".")), value)
            for name, value in values.items()
        ]
        return self._request(requests + [ParameterRequest(ParameterAction.Apply)], timeout)

    def roll_back(self, timeout: float = ANSWER) -> ParameterStatus:
        """Returns to the parameters before the last change, and waits until the rover uses them."""
        return self._request([ParameterRequest(ParameterAction.RollBack)], timeout)

    def _request(self, requests: "list[ParameterRequest]", timeout: float) -> ParameterStatus:
        deadline = time.monotonic() + timeout
        before = self._status(deadline)
        for request in requests:
            self.send(request)
        while True:
            status = self._status(deadline)
            if status.refused != before.refused:
                raise ParameterRefused(status)
            if status.version != before.version:
                return status

    def _status(self, deadline: float) -> ParameterStatus:
        """The next status, which every subscriber gets."""
        renew = 0.0
        while True:
            now = time.monotonic()
            if now >= deadline:
                raise TimeoutError("the rover does not answer")
            if now >= renew:
                self.send(Subscription(1))
                renew = now + RENEWAL
            message = self.receive(min(deadline, renew) - now)
            if isinstance(message, ParameterStatus):
                return message


class ParameterRefused(ValueError):
    """The rover refused a value; it uses the parameters it used before."""

    def __init__(self, status: ParameterStatus) -> None:
        super().__init__(f"refused; version {status.version} is in use")
        self.status = status
