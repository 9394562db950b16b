"""`sosmith monitor`: shows, records and judges what a board measures, for as long as it is left alone."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sosmith.commands.options import BAUD
from sosmith.commands.standard_streams import check_stdout
from sosmith.output_paths import output_option
from sosmith.terminal import live, note, width

if TYPE_CHECKING:
    from rich.console import RenderableType

REFRESHES = 8
"""Pictures of the live view in a second."""


@click.command("monitor")
@click.argument("port")
@click.option(
    "--trace",
    type=click.Path(path_type=Path),
    metavar="TRACE.csv|wav",
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
    Every alarm is reported once, when its flag rises. Exits with 1 if there was one.

    The recording has the columns utc, time_s, run, session, channel if there are several, the result with its unit, its
    code, its status, and board, a digest of what the board says that it is; only the same board continues it. Ctrl-C
    and even a kill leave every row that was received.

    --mqtt publishes TOPIC/status, TOPIC/channel/0 and so on, which are retained, and TOPIC/alarm, all with QoS 1.
    Alarms wait while the broker is away. TOPIC is sosmith/NAME, by the name of the core, unless the URL has one.

    \b
        sosmith monitor /dev/ttyUSB1 --trace ramp.csv -o week.csv --page
        sosmith monitor /dev/ttyUSB1 --trace ramp.csv --alarm wear_warning --hook 'mail-the-depot now'
    """
    from sosmith.interface.monitor import Monitor, MqttOptions

    with ExitStack() as stack:
        monitor = Monitor(
            port=port,
            note=note,
            files=files,
            hook=hook,
            page=page,
            mqtt=None
            if mqtt is None
            else MqttOptions(
                url=mqtt,
                credentials=mqtt_credentials,
                authorities=mqtt_ca,
                plain_text=mqtt_plain_text,
                keep=mqtt_keep,
            ),
            recording=output,
            lines=_print_lines if influx else None,
            view=(lambda draw: _on_terminal(draw, stack)) if sys.stderr.isatty() else None,
            **({"alarms": alarms} if alarms else {}),
        )
        raised = monitor.run(trace, speed=speed, baud=baud)
    if raised:
        sys.exit(1)


def _print_lines(text: str) -> None:
    click.echo(text)
    sys.stdout.flush()
    check_stdout()


def _on_terminal(draw: Callable[[int], RenderableType], stack: ExitStack) -> Callable[[], None]:
    """Begin the live view in the terminal; return what renews it."""
    from rich.console import Console
    from rich.live import Live

    console = Console(stderr=True, width=width())
    view = Live(console=console, refresh_per_second=REFRESHES, transient=False)
    stack.enter_context(live(view))
    return lambda: view.update(draw(console.width))
