"""`sosmith monitor`: shows, records and judges what a board measures, for as long as it is left alone."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sosmith.commands.options import BAUD, default_folder
from sosmith.model.errors import SpecificationError
from sosmith.terminal import note, output_option

if TYPE_CHECKING:
    from sosmith.host.monitor import Event
    from sosmith.host.readings import Readings
    from sosmith.model.link.identity import Identity

REFRESHES = 8
"""Pictures of the live view in a second."""


@click.command("monitor")
@click.argument("port")
@click.option(
    "--trace", type=click.Path(path_type=Path), metavar="TRACE.csv", help="Samples to feed, as for `sosmith stream`."
)
@click.option(
    "--speed", type=click.FloatRange(min=0), default=1.0, show_default=True, help="Factor of real time; 0: at once."
)
@click.option(
    "--files",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder with manifest and certificate of the core that must be there.  [default: build/<name>, if any]",
)
@click.option(
    "--alarm", "alarms", multiple=True, metavar="FLAG", help="Flag that is an alarm.  [default: wear_critical, fault]"
)
@click.option(
    "--hook", metavar="COMMAND", help="Command to run for each alarm; SOSMITH_FLAG, SOSMITH_CHANNEL, ... tell it why."
)
@click.option("--page", is_flag=True, help="Show the same in a browser, at a local address that is told on stderr.")
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
    influx: bool,
    baud: int,
    output: Path | None,
) -> None:
    """Watch the board at PORT: live values, wear, rate and flags in the terminal, or in a browser.

    The samples of --trace are fed at the board's sample rate. The board must have the core whose manifest and
    certificate are in --files. After it was unplugged, it is waited for; its filter then starts from reset, and the
    recording has the next session. Every alarm is told once, when its flag rises. Exits with 1 if there was one.

    The recording has the columns utc, time_s, session, channel if there are several, the result with its unit, its code
    and its status. Ctrl-C and even a kill leave every row that was received.

    \b
        sosmith monitor /dev/ttyUSB1 --trace ramp.csv -o week.csv --page
        sosmith monitor /dev/ttyUSB1 --trace ramp.csv --alarm wear_warning --hook 'mail-the-depot now'
    """
    from sosmith.host.board import Board
    from sosmith.host.monitor import watch
    from sosmith.host.trace_samples import samples_for

    if trace is None:
        raise SpecificationError("--trace must be given: the board takes its samples over the link")
    with ExitStack() as stack:
        shown = stack.enter_context(_Monitor(port, files, alarms, hook, page, influx, output))
        for event in watch(
            lambda: Board(port, baud=baud),
            lambda identity: samples_for(identity, trace),
            check=shown.check,
            speed=speed,
        ):
            shown.take(event)
    if shown.raised:
        sys.exit(1)


class _Monitor:
    """Everything that is done with what a board says."""

    def __init__(
        self,
        port: str,
        files: Path | None,
        alarms: tuple[str, ...],
        hook: str | None,
        page: bool,
        influx: bool,
        output: Path | None,
    ) -> None:
        from sosmith.host.alarms import ALARMS

        self._port, self._files, self._with_page, self._influx, self._output = port, files, page, influx, output
        self._flags, self._hook_command = alarms or ALARMS, hook
        self._manifest: dict[str, Any] | None = None
        self._stack = ExitStack()
        self._start = 0.0
        self._readings: Readings | None = None

    def __enter__(self) -> _Monitor:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    @property
    def raised(self) -> int:
        """Alarms so far."""
        return 0 if self._readings is None else self._readings.alarms

    def check(self, identity: Identity) -> None:
        """Hold a board against the files of its core."""
        from sosmith.host.identity_check import check_files

        folder = self._files or default_folder(identity.name)
        if self._files is None and not (folder / f"{identity.name}.json").exists():
            note(f"the board has the core {identity.name}; it was not checked, as there is no {folder}: see --files")
            return
        self._manifest = check_files(identity, folder)
        note(f"the board has the core {identity.name} of {folder}")

    def take(self, event: Event) -> None:
        """Show, record and judge what happened."""
        from sosmith.host.monitor import Connected, Lost, Received

        if isinstance(event, Connected):
            if self._readings is None:
                self._begin(event.identity)
            else:
                note(f"{self._port}: connected again")
            self._show("connected")
        elif isinstance(event, Lost):
            note(f"{event.reason}; waiting for it")
            self._show("lost")
        elif isinstance(event, Received):
            self._received(event)

    def _begin(self, identity: Identity) -> None:
        from sosmith.host.alarms import Alarms, Hook
        from sosmith.host.readings import Readings
        from sosmith.host.recording import recording
        from sosmith.host.rows import columns

        self._identity, self._start = identity, time.time()
        self._alarms = Alarms(self._flags, identity.flags)
        self._hook = None
        if self._hook_command is not None:
            self._hook = Hook(self._hook_command, identity.output_port.unit)
            self._stack.callback(self._hook.finish)
        first, *rest = columns(identity)
        self._recording = None
        if self._output is not None:
            self._recording = self._stack.enter_context(recording(self._output, ("utc", first, "session", *rest)))
        self._readings = Readings(identity, self._manifest, self._port)
        self._page = None
        if self._with_page:
            from sosmith.host.page import LivePage

            self._page = self._stack.enter_context(LivePage(self._readings))
            note(f"the live view is at {self._page.address}")
        self._live = None
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.live import Live

            console = Console(stderr=True)
            self._live = Live(console=console, refresh_per_second=REFRESHES, transient=False)
            self._stack.enter_context(self._live)

    def _received(self, event: Any) -> None:
        from sosmith.host.line_protocol import influx_lines
        from sosmith.host.rows import rows

        assert self._readings is not None
        results = event.results
        if self._recording is not None:
            made = rows(self._identity, results, event.first)
            self._recording.add((self._utc(row[0]), row[0], event.session, *row[1:]) for row in made)
        if self._influx:
            click.echo("\n".join(influx_lines(self._identity, results, event.first, self._start)))
            sys.stdout.flush()
        for alarm in self._alarms.rises(results, event.first):
            self._readings.alarm(alarm)
            unit = self._identity.output_port.unit
            when = alarm.sample / self._identity.sample_rate
            note(f"alarm: {alarm.flag} of channel {alarm.channel} at {when:.3f} s, {alarm.value:g} {unit}".rstrip())
            if self._hook is not None:
                self._hook.run(alarm)
        self._readings.add(results, event.first)
        self._show("connected")

    def _show(self, state: str) -> None:
        assert self._readings is not None
        self._readings.state = state
        if self._page is not None:
            self._page.update()
        if self._live is not None:
            from sosmith.host.live_view import render

            self._live.update(render(self._readings, self._live.console.width))

    def _utc(self, seconds: float) -> str:
        return (
            datetime.fromtimestamp(self._start + seconds, UTC).isoformat(timespec="microseconds").replace("+00:00", "Z")
        )
