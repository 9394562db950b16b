"""What is done with what a board measures, for as long as it is left alone: shown, recorded, judged, published."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sosmith.host.alarms import ALARMS, Alarm, Alarms, Hook
from sosmith.host.board import BAUD, Board
from sosmith.host.identity_check import check_files, folder_of
from sosmith.host.line_protocol import influx_lines
from sosmith.host.monitor import Changed, Connected, Event, Idle, Lost, Received, watch
from sosmith.host.readings import Readings
from sosmith.host.run_recording import RunRecording
from sosmith.host.trace_samples import samples_for
from sosmith.interface.files import default_folder
from sosmith.model.arrays import Codes
from sosmith.model.errors import SpecificationError
from sosmith.model.link.identity import Identity

if TYPE_CHECKING:
    from rich.console import RenderableType

    from sosmith.host.mqtt import Broker, Publisher
    from sosmith.host.page import LivePage


@dataclass(frozen=True, kw_only=True)
class MqttOptions:
    """Where results and alarms are published.

    Attributes
    ----------
    url : str
        ``mqtt://HOST[:PORT][/TOPIC]``, or ``mqtts://`` for TLS.
    credentials, authorities : Path or None
        Files with user and password, and with the certificates to trust; None for the environment and the system's.
    plain_text : bool
        Whether user and password may go over a line that others can read.
    keep : Path or None
        File that keeps alarms until the broker has acknowledged them.
    """

    url: str
    credentials: Path | None = None
    authorities: Path | None = None
    plain_text: bool = False
    keep: Path | None = None

    def broker(self) -> Broker:
        """Return the broker; raises SpecificationError and ToolError as `sosmith.host.mqtt` does."""
        from sosmith.host.mqtt import Broker, paho

        paho()
        return Broker.at(
            self.url, credentials=self.credentials, authorities=self.authorities, plain_text=self.plain_text
        )


@dataclass(frozen=True, kw_only=True)
class Monitor:
    """Watches the board at a port: `run` returns at the end of its trace; a board with converters has none.

    Attributes
    ----------
    port : str
        Name of the serial port.
    note : callable
        Called with each sentence about what happens.
    files : Path or None
        Folder with manifest and certificate of the core; None for ``build/<name>`` or a folder in it, if any.
    alarms : sequence of str
        Flags that are alarms.
    hook : str or None
        Command to run for each alarm.
    page : bool
        Whether a browser can show the same, at an address that is noted.
    mqtt : MqttOptions or None
        Where to publish.
    recording : Path or None
        CSV or Parquet file for the results.
    lines : callable or None
        Called with the results in the line protocol of InfluxDB.
    view : callable or None
        Called once there is a board, with what draws a terminal of a width in columns; returns what is called whenever
        there is something new to see.
    """

    port: str
    note: Callable[[str], None]
    files: Path | None = None
    alarms: tuple[str, ...] = ALARMS
    hook: str | None = None
    page: bool = False
    mqtt: MqttOptions | None = None
    recording: Path | None = None
    lines: Callable[[str], None] | None = None
    view: Callable[[Callable[[int], RenderableType]], Callable[[], None]] | None = None

    def run(self, trace: Path | None = None, *, speed: float = 1.0, baud: int = BAUD) -> int:
        """Feed the samples of a trace at `speed` times the board's rate, 0 for at once; return the count of alarms.

        A page stays after the last sample, until an interrupt.

        Raises
        ------
        SpecificationError, ToolError, LinkError, ShortfallError
            If an option or the trace does not fit, or the board is missing at first, makes no sense or is not the one
            that it must be.
        """
        broker = None if self.mqtt is None else self.mqtt.broker()
        with ExitStack() as stack:
            watching = _Watching(self, broker, stack)
            for event in watch(
                lambda: Board(self.port, baud=baud),
                lambda identity: _samples(identity, trace),
                check=watching.check,
                speed=speed,
            ):
                watching.take(event)
            watching.stay()
        return watching.raised


class _Watching:
    """Everything that is done with what a board says, in one run."""

    def __init__(self, asked: Monitor, broker: Broker | None, stack: ExitStack) -> None:
        self._asked, self._broker, self._stack = asked, broker, stack
        self._manifest: dict[str, Any] | None = None
        self._readings: Readings | None = None
        self._recording: RunRecording | None = None
        self._publisher: Publisher | None = None
        self._page: LivePage | None = None
        self._on_alarm: list[Callable[[Alarm], None]] = []
        self._views: list[Callable[[], None]] = []

    @property
    def raised(self) -> int:
        """Alarms so far."""
        return 0 if self._readings is None else self._readings.alarms

    def stay(self) -> None:
        """Leave the page open after the last sample: a browser may come later than a short trace ends."""
        if self._page is not None:
            self._asked.note("the trace has ended; the live view stays until Ctrl-C")
            self._page.stay()

    def check(self, identity: Identity) -> None:
        """Hold a board against the files of its core."""
        usual = default_folder(identity.name)
        folder = self._asked.files or folder_of(identity, usual)
        if folder is None:
            self._asked.note(
                f"the board has the core {identity.name}; it was not checked, as there is no {usual}: see --files"
            )
            return
        self._manifest = check_files(identity, folder)
        self._asked.note(f"the board has the core {identity.name} of {folder}")

    def take(self, event: Event) -> None:
        """Show, record and judge what happened."""
        if isinstance(event, Connected):
            if self._readings is None:
                self._begin(event.identity)
            else:
                self._asked.note(f"{self._asked.port}: connected again")
            self._show("connected")
        elif isinstance(event, Lost):
            self._asked.note(f"{event.reason}; waiting for it")
            self._show("lost")
        elif isinstance(event, Received):
            self._received(event)
        elif isinstance(event, Changed):
            for (channel, name), faults in event.readings.items():
                wrong = ", ".join(faults).replace("_", " ") or "good again"
                self._asked.note(f"the converter of {name}, channel {channel}: {wrong}")
        elif isinstance(event, Idle) and self._readings is not None:
            self._show(self._readings.state)

    def _begin(self, identity: Identity) -> None:
        self._identity = identity
        self._alarms = Alarms(self._asked.alarms, identity.flags, identity.result_rate)
        self._readings = Readings(identity, self._manifest, self._asked.port)
        self._on_alarm += [self._note_alarm, self._readings.alarm]
        if self._asked.hook is not None:
            hook = Hook(self._asked.hook, identity.output_port.unit)
            self._stack.callback(hook.finish)
            self._on_alarm.append(hook.run)
        if self._asked.recording is not None:
            self._recording = self._stack.enter_context(RunRecording(self._asked.recording, identity))
        if self._asked.mqtt is not None and self._broker is not None:
            from sosmith.host.mqtt import Publisher

            publisher = Publisher(self._broker, self._readings, time.time(), self._asked.mqtt.keep)
            self._publisher = self._stack.enter_context(publisher)
            self._on_alarm.append(self._publisher.alarm)
            self._views.append(self._publisher.update)
        if self._asked.page:
            from sosmith.host.page import LivePage

            self._page = self._stack.enter_context(LivePage(self._readings))
            self._asked.note(f"the live view is at {self._page.address}")
            self._views.append(self._page.update)
        if self._asked.view is not None:
            from sosmith.host.live_view import render

            readings = self._readings
            self._views.append(self._asked.view(lambda width: render(readings, width)))

    def _received(self, event: Received) -> None:
        assert self._readings is not None
        results = event.results
        if self._recording is not None:
            self._recording.add(event)
        if self._asked.lines is not None:
            self._asked.lines("\n".join(influx_lines(self._identity, results, event.first, event.start)))
        for alarm in self._alarms.rises(results, event.first, event.start):
            for act in self._on_alarm:
                act(alarm)
        self._readings.add(results, event.first, event.start)
        self._show("connected")

    def _note_alarm(self, alarm: Alarm) -> None:
        unit = self._identity.output_port.unit
        when = alarm.sample / self._identity.result_rate
        self._asked.note(
            f"alarm: {alarm.flag} of channel {alarm.channel} at {when:.3f} s, {alarm.value:g} {unit}".rstrip()
        )

    def _show(self, state: str) -> None:
        assert self._readings is not None
        self._readings.state = state
        for renew in self._views:
            renew()
        for text in self._publisher.news() if self._publisher is not None else ():
            self._asked.note(text)


def _samples(identity: Identity, trace: Path | None) -> Codes:
    """Return the samples for a board that is fed."""
    if trace is None:
        raise SpecificationError("--trace must be given: the board takes its samples over the link")
    return samples_for(identity, trace)
