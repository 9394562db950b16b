"""`sosmith monitor`: shows, records and judges what a board measures, for as long as it is left alone."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.commands.options import BAUD, default_folder
from sosmith.model.errors import SpecificationError
from sosmith.output_paths import output_option
from sosmith.terminal import live, note, width

if TYPE_CHECKING:
    from sosmith.host.alarms import Alarm
    from sosmith.host.monitor import Event, Received
    from sosmith.host.mqtt import Broker, Publisher
    from sosmith.host.page import LivePage
    from sosmith.host.readings import Readings
    from sosmith.host.run_recording import RunRecording
    from sosmith.model.arrays import Codes
    from sosmith.model.link.identity import Identity

REFRESHES = 8
"""Pictures of the live view in a second."""


@click.command("monitor")
@click.argument("port")
@click.option(
    "--trace",
    type=click.Path(path_type=Path),
    metavar="TRACE.csv",
    help="Samples to feed, as for `sosmith stream`; for a board without converters.",
)
@click.option(
    "--speed", type=click.FloatRange(min=0), default=1.0, show_default=True, help="Factor of real time; 0: at once."
)
@click.option(
    "--files",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder with the manifest and certificate of the core.  [default: build/<name> or a folder in it, if any]",
)
@click.option(
    "--alarm", "alarms", multiple=True, metavar="FLAG", help="Flag that is an alarm.  [default: wear_critical, fault]"
)
@click.option(
    "--hook", metavar="COMMAND", help="Command to run for each alarm; SOSMITH_FLAG, SOSMITH_CHANNEL, ... tell it why."
)
@click.option(
    "--page",
    is_flag=True,
    help="Show the same in a browser, at a local address that is printed; it stays until Ctrl-C.",
)
@click.option("--mqtt", metavar="URL", help="Publish to the broker at mqtt://HOST[:PORT][/TOPIC], or mqtts:// for TLS.")
@click.option(
    "--mqtt-credentials",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="File with user:password, for its owner only.  [default: SOSMITH_MQTT_USER, SOSMITH_MQTT_PASSWORD]",
)
@click.option(
    "--mqtt-ca",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Certificates that mqtts:// trusts.  [default: the system's]",
)
@click.option(
    "--mqtt-plain-text", is_flag=True, help="Send user and password over mqtt://, which others on the line can read."
)
@click.option(
    "--mqtt-keep",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="File that keeps alarms until the broker has acknowledged them, over restarts and kills.",
)
@click.option("--influx", is_flag=True, help="Print every result in the line protocol of InfluxDB.")
@BAUD
@output_option("Recording: a CSV file, or a Parquet file if its name ends so; CSV is continued.")
def monitor_command(
    port: str,
    trace: Path | None,
    speed: float,
    files: Path | None,
    alarms: tuple[str, ...],
    hook: str | None,
    page: bool,
    mqtt: str | None,
    mqtt_credentials: Path | None,
    mqtt_ca: Path | None,
    mqtt_plain_text: bool,
    mqtt_keep: Path | None,
    influx: bool,
    baud: int,
    output: Path | None,
) -> None:
    """Watch the board at PORT: live values, wear, rate and flags in the terminal, or in a browser.

    The samples of --trace are fed at the board's sample rate; a board with converters measures by itself. The board
    must have the core whose manifest and certificate are in --files. After it was unplugged, it is waited for; its
    filter then starts from reset, and the recording has the next session. Another board at its place ends the monitor.
    Every alarm is told once, when its flag rises. Exits with 1 if there was one.

    The recording has the columns utc, time_s, run, session, channel if there are several, the result with its unit, its
    code, its status, and board, a digest of what the board says that it is; only the same board continues it. Ctrl-C
    and even a kill leave every row that was received.

    --mqtt publishes TOPIC/status, TOPIC/channel/0 and so on, which are retained, and TOPIC/alarm, all with QoS 1.
    Alarms wait while the broker is away. TOPIC is sosmith/NAME, by the name of the core, unless the URL has one.

    \b
        sosmith monitor /dev/ttyUSB1 --trace ramp.csv -o week.csv --page
        sosmith monitor /dev/ttyUSB1 --trace ramp.csv --alarm wear_warning --hook 'mail-the-depot now'
    """
    from sosmith.host.alarms import ALARMS
    from sosmith.host.board import Board
    from sosmith.host.monitor import watch

    broker = None
    if mqtt is not None:
        from sosmith.host.mqtt import Broker, paho

        paho()
        broker = Broker.at(mqtt, credentials=mqtt_credentials, authorities=mqtt_ca, plain_text=mqtt_plain_text)
    asked = _Asked(port, files, alarms or ALARMS, hook, page, broker, mqtt_keep, influx, output)
    with ExitStack() as stack:
        shown = stack.enter_context(_Monitor(asked))
        for event in watch(
            lambda: Board(port, baud=baud),
            lambda identity: _samples(identity, trace),
            check=shown.check,
            speed=speed,
        ):
            shown.take(event)
        shown.stay()
    if shown.raised:
        sys.exit(1)


def _samples(identity: Identity, trace: Path | None) -> Codes:
    """Return the samples for a board that is fed."""
    from sosmith.host.trace_samples import samples_for

    if trace is None:
        raise SpecificationError("--trace must be given: the board takes its samples over the link")
    return samples_for(identity, trace)


@dataclass(frozen=True)
class _Asked:
    """What the options ask for."""

    port: str
    files: Path | None
    flags: tuple[str, ...]
    hook: str | None
    page: bool
    broker: Broker | None
    keep: Path | None
    influx: bool
    output: Path | None


class _Monitor:
    """Everything that is done with what a board says."""

    def __init__(self, asked: _Asked) -> None:
        self._asked = asked
        self._manifest: dict[str, Any] | None = None
        self._stack = ExitStack()
        self._start = 0.0
        self._readings: Readings | None = None
        self._recording: RunRecording | None = None
        self._publisher: Publisher | None = None
        self._told: list[Callable[[Alarm], None]] = []
        self._views: list[Callable[[], None]] = []
        self._page: LivePage | None = None

    def __enter__(self) -> _Monitor:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def stay(self) -> None:
        """Leave the page open after the last sample: a browser may come later than a short trace ends."""
        if self._page is not None:
            note("the trace has ended; the live view stays until Ctrl-C")
            self._page.stay()

    @property
    def raised(self) -> int:
        """Alarms so far."""
        return 0 if self._readings is None else self._readings.alarms

    def check(self, identity: Identity) -> None:
        """Hold a board against the files of its core."""
        from sosmith.host.identity_check import check_files, folder_of

        folder = self._asked.files or folder_of(identity, default_folder(identity.name))
        if folder is None:
            place = default_folder(identity.name)
            note(f"the board has the core {identity.name}; it was not checked, as there is no {place}: see --files")
            return
        self._manifest = check_files(identity, folder)
        note(f"the board has the core {identity.name} of {folder}")

    def take(self, event: Event) -> None:
        """Show, record and judge what happened."""
        from sosmith.host.monitor import Changed, Connected, Idle, Lost, Received

        if isinstance(event, Connected):
            if self._readings is None:
                self._begin(event.identity)
            else:
                note(f"{self._asked.port}: connected again")
            self._show("connected")
        elif isinstance(event, Lost):
            note(f"{event.reason}; waiting for it")
            self._show("lost")
        elif isinstance(event, Received):
            self._received(event)
        elif isinstance(event, Changed):
            for (channel, name), faults in event.readings.items():
                wrong = ", ".join(faults).replace("_", " ") or "good again"
                note(f"the converter of {name}, channel {channel}: {wrong}")
        elif isinstance(event, Idle) and self._readings is not None:
            self._show(self._readings.state)

    def _begin(self, identity: Identity) -> None:
        from sosmith.host.alarms import Alarms, Hook
        from sosmith.host.readings import Readings
        from sosmith.host.run_recording import RunRecording

        asked, self._identity = self._asked, identity
        self._alarms = Alarms(asked.flags, identity.flags, identity.sample_rate)
        self._readings = Readings(identity, self._manifest, asked.port)
        self._told += [self._note, self._readings.alarm]
        if asked.hook is not None:
            hook = Hook(asked.hook, identity.output_port.unit)
            self._stack.callback(hook.finish)
            self._told.append(hook.run)
        if asked.output is not None:
            self._recording = self._stack.enter_context(RunRecording(asked.output, identity))
        if asked.broker is not None:
            from sosmith.host.mqtt import Publisher

            self._publisher = self._stack.enter_context(
                Publisher(asked.broker, self._readings, time.time(), asked.keep)
            )
            self._told.append(self._publisher.alarm)
            self._views.append(self._publisher.update)
        if asked.page:
            from sosmith.host.page import LivePage

            self._page = self._stack.enter_context(LivePage(self._readings))
            note(f"the live view is at {self._page.address}")
            self._views.append(self._page.update)
        if sys.stderr.isatty():
            self._views.append(self._on_terminal(self._readings))

    def _on_terminal(self, readings: Readings) -> Callable[[], None]:
        """Begin the live view in the terminal; return what renews it."""
        from rich.console import Console
        from rich.live import Live

        from sosmith.host.live_view import render

        console = Console(stderr=True, width=width())
        view = Live(console=console, refresh_per_second=REFRESHES, transient=False)
        self._stack.enter_context(live(view))
        return lambda: view.update(render(readings, console.width))

    def _received(self, event: Received) -> None:
        from sosmith.host.line_protocol import influx_lines

        assert self._readings is not None
        results = event.results
        if self._recording is not None:
            self._recording.add(event)
        if self._asked.influx:
            click.echo("\n".join(influx_lines(self._identity, results, event.first, event.start)))
            sys.stdout.flush()
        for alarm in self._alarms.rises(results, event.first, event.start):
            for tell in self._told:
                tell(alarm)
        self._readings.add(results, event.first, event.start)
        self._show("connected")

    def _note(self, alarm: Alarm) -> None:
        unit = self._identity.output_port.unit
        when = alarm.sample / self._identity.sample_rate
        note(f"alarm: {alarm.flag} of channel {alarm.channel} at {when:.3f} s, {alarm.value:g} {unit}".rstrip())

    def _show(self, state: str) -> None:
        assert self._readings is not None
        self._readings.state = state
        for renew in self._views:
            renew()
        for text in self._publisher.news() if self._publisher is not None else ():
            note(text)
